"""Numbered rows of a random stream: what is run of them, and whether stored ones repeat."""

import jax
import numpy as np

from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, as_key, key_data
from parc_jax.common.options import check_count
from parc_jax.learning.runs.chunks import ChunkStore, default_chunk, worker_devices
from parc_jax.learning.runs.law import GIVEN, SAMPLER
from parc_jax.learning.runs.resume import require_same_runs
from parc_jax.learning.runs.simulate import is_traceable, simulator
from parc_jax.learning.runs.subject import given_of
from parc_jax.learning.system import check_system
from parc_jax.learning.systems.chained import Chained


def simulate_rows(system, key, stage: Stage, rows: np.ndarray, k=None, first_row=0, device=None):
    """Run the given global rows (B,). Returns k (B, n_k) on the host and the Trajectory (B, ...) on
    the device, its p as columns (B, n_record + 1, n_c).
    """
    sim = simulator(system)
    if is_given(k) and np.ndim(k) == 2:
        # padding rows beyond the list repeat its last entry; they are cut off again
        k = np.asarray(k, np.float64)[np.minimum(rows - first_row, len(k) - 1)]
    drawn = sim.rows(key, stage, rows, k, device)
    return drawn.k, sim.run(drawn, device)


def chunks_of_rows(n: int, first_row: int, chunk: int, traceable: bool) -> list[np.ndarray]:
    """The n global rows from first_row on, in chunks of one size, so that one program is compiled;
    what needs no fixed shape does not run what will be cut off.
    """
    parts = [np.arange(first_row + i, first_row + i + chunk) for i in range(0, n, chunk)]
    if not traceable:
        parts[-1] = parts[-1][parts[-1] < first_row + n]
    return parts


def chunk_of(system, n: int, chunk: int | None, path) -> int:
    """Runs per call: as asked for, as stored, or as suits system and machine."""
    if path is not None:
        chunk = chunk or ChunkStore.stored_chunk(path)
    chunk = chunk or getattr(system, "chunk", None)
    return int(chunk or default_chunk(system, n, len(worker_devices(system))))


def rows_again(system, chunk: int) -> int:
    """How many runs to repeat before stored ones are believed: a compiled chunk as a whole, for
    the same bits; one run of anything else.
    """
    return chunk if is_traceable(system) else 1


def require_same_chunk(store: ChunkStore, system, work, chunk_rows, device) -> None:
    """Run stored rows again and compare. Raises InputError."""
    known = store.first()
    if known is None or known[0] >= len(chunk_rows):
        return
    index, stored = known
    rows = chunk_rows[index][: rows_again(system, len(chunk_rows[index]))]
    require_same_runs(store.folder, stored, work(rows, device), system)


def title_of(stage: Stage, first_row: int) -> str:
    """What the runs are for, in words; no two stages share them."""
    if stage == Stage.TRAIN and first_row:
        return "further runs for the profile"
    return {
        Stage.TRAIN: "training runs",
        Stage.BOUND: "fresh runs for the bound",
        Stage.REPLAY: "replay",
        Stage.VALIDATE: "validation",
    }.get(stage, Stage(stage).name.lower())


def k_law(system, k) -> str:
    """Name of the law of k for a LawSpec."""
    if k is None:
        return system.k_law if isinstance(system, Chained) else "uniform"
    if not callable(k):
        values = np.asarray(k, np.float64)
        if values.ndim == 1:
            return f"{GIVEN}({', '.join(f'{value:.10g}' for value in values)})"
        return f"{GIVEN}({len(values):,} values, sha256 {content_hash(values)[:12]})"
    name = getattr(k, "__name__", type(k).__name__)
    return SAMPLER + ("without a name" if name == "<lambda>" else name)


def seed_of(key) -> tuple[int, ...]:
    """The data of a random key, as plain numbers: part of the identity of every row."""
    return tuple(int(v) for v in key_data(key).ravel())


def is_given(k) -> bool:
    """Are these values of k, and not a law of them?"""
    return k is not None and not callable(k)


def check_asked(system, key: jax.Array, n: int, k) -> None:
    """Refuse what is no system, no key, no whole number of runs, and given k that are not n of its
    domain. Raises InputError.
    """
    check_system(system)
    as_key(key)
    check_count("n", n, 1, "collect(system, key, n=1000)")
    given_of(system)
    if not is_given(k):
        return
    shape = np.shape(k)
    if shape not in ((system.domain.n,), (n, system.domain.n)):
        raise InputError(
            f"rollouts k: expected ({system.domain.n},), ({n}, {system.domain.n}) or a function; "
            f"got {shape}."
        )
    if not system.domain.contains(np.asarray(k)).all():
        raise InputError(
            f"rollouts k: expected every k inside the domain {system.domain.lo} .. "
            f"{system.domain.hi}."
        )
