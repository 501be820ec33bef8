"""Black box -> batches of recorded runs, resumable and independent of chunking."""

import logging
import shutil
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import numpy as np

from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, as_key, key_data
from parc_jax.common.options import check_count
from parc_jax.learning.labels import labels_of
from parc_jax.learning.runs.batch import RolloutBatch, concatenate, rollout_batch
from parc_jax.learning.runs.chunks import (
    Arrays,
    ChunkStore,
    Forecast,
    Pace,
    default_chunk,
    finished,
    require_same_runs,
    run_chunks,
    worker_devices,
)
from parc_jax.learning.runs.files import save_rollouts
from parc_jax.learning.runs.law import GIVEN, SAMPLER, LawSpec, given_of, law_of
from parc_jax.learning.runs.simulate import is_traceable, remembered, simulator
from parc_jax.learning.system import Retried, check_system, points_of, rotation_of
from parc_jax.learning.systems.chained import Chained
from parc_jax.learning.systems.identity import identity_of
from parc_jax.learning.systems.user_code import blamed


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
        Stage.SCENE: "tests in the scene",
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


_log = logging.getLogger(__name__)


def collect(
    system,
    key: jax.Array,
    n: int,
    stage: Stage = Stage.TRAIN,
    *,
    k=None,
    first_row=0,
    dtype=np.float64,
    chunk=None,
    path=None,
    quiet=False,
    forecast: Forecast | None = None,
) -> RolloutBatch:
    """Run the system n times. Row i depends on (key, stage, i) alone.

    Does not consume `key`: other stages draw from it too, and never meet these numbers.
    k: None = uniform on the domain; (n_k,) = the same for all; (n, n_k) = as given; a function key
        -> (n_k,) = its law.
    first_row: number of the first row, to continue a stream. dtype: storage of p, float64 or
        float32.
    chunk: runs per compiled call. Same chunk, same bits; another chunk may round differently in the
        last digit.
    path: an .npz file. Finished chunks are kept beside it, so a killed run continues where it was;
        an existing file of the same work is loaded. Either way the first of the stored runs are
        simulated again: a system that does not repeat them is refused. Runs of a system that is not
        compiled here and that were begun before the stop count as lost (`RolloutBatch.lost`).
    quiet: no progress bar, and no word about the cost. forecast: of a longer work that these runs
        are part of. Raises InputError.
    """
    check_asked(system, key, n, k)
    identity = identity_of(system) | {"law": law_of(system, k_law(system, k)).hash}
    if path is not None and Path(path).exists():
        return _finished(system, key, n, stage, k, first_row, dtype, path, identity)
    parts = None if path is None else Path(f"{path}.parts")
    chunk = chunk_of(system, n, chunk, parts)
    stream = stream_rollouts(
        system,
        key,
        n,
        stage,
        k=k,
        first_row=first_row,
        dtype=dtype,
        chunk=chunk,
        path=parts,
        quiet=quiet,
        forecast=forecast,
    )
    batch = concatenate(stream, n)
    if parts is not None:
        save_rollouts(path, batch, {"system": identity, "chunk": chunk})
        shutil.rmtree(parts, ignore_errors=True)
    return batch


def _finished(system, key, n, stage, k, first_row, dtype, path, identity) -> RolloutBatch:
    """The rollouts of a finished file, after some of them have been simulated again."""
    asked = {
        "n": n,
        "first_row": first_row,
        "seed": seed_of(key),
        "stage": int(stage),
        "dtype": np.dtype(dtype).name,
        "k": k if is_given(k) else None,
    }
    batch, chunk = finished(path, identity, asked)
    rows = first_row + np.arange(rows_again(system, chunk or chunk_of(system, n, None, None)))
    stored = {"k": batch.k, "p": batch.p, "q": batch.q}
    again = _simulated(system, key, stage, k, first_row, dtype, rows)
    require_same_runs(path, stored, again, system)
    return replace(
        batch, rotation=rotation_of(system), labels=labels_of(system), given=given_of(system)
    )


def stream_rollouts(
    system,
    key: jax.Array,
    n: int,
    stage: Stage = Stage.TRAIN,
    *,
    k=None,
    first_row=0,
    dtype=np.float64,
    chunk=None,
    path=None,
    quiet=False,
    forecast: Forecast | None = None,
) -> Iterator[RolloutBatch]:
    """The batches of `collect` chunk by chunk, in order, in bounded memory, on several workers.
    path: a folder that keeps the chunks. Raises InputError, also when the system changes while it
    runs.
    """
    from tqdm import tqdm

    check_asked(system, key, n, k)
    devices = worker_devices(system)
    chunk = chunk_of(system, n, chunk, path)
    law, grid = law_of(system, k_law(system, k)), system.time
    meta = _identity(system, key, stage, k, first_row, dtype) | {"chunk": chunk}
    sim = simulator(system)
    chunks = chunks_of_rows(n, first_row, chunk, sim.traceable)
    work = partial(_simulated, system, key, stage, k, first_row, dtype)
    store = None
    if path is not None:
        store = ChunkStore(path, meta)
        require_same_chunk(store, system, work, chunks, devices[0])
    told = None if quiet else forecast or Forecast(n)
    pace = Pace(len(devices), sim.traceable, told, system.name)

    def one(index, device):
        arrays = pace.timed(len(chunks[index]), lambda: work(chunks[index], device))
        same = (law_of(system, k_law(system, k)), system.time) == (law, grid)
        if not same or remembered(system).content != sim.content:
            raise InputError(
                f"{system.name}: expected a system that stays as it is while it runs; it was "
                "changed. Make another one instead."
            )
        return arrays

    title = f"{system.name}: {title_of(stage, first_row)}"
    _log.info("%s: %d rows in %d chunks", title, n, len(chunks))
    with tqdm(total=n, unit="rollout", desc=title, disable=quiet) as bar:
        done = run_chunks(one, len(chunks), devices, store, count_losses=not sim.traceable)
        for rows, arrays in zip(chunks, done, strict=True):
            kept = min(chunk, first_row + n - int(rows[0]))
            _log.debug("%s: rows %d to %d", title, rows[0], rows[0] + kept - 1)
            bar.update(kept)
            some = {name: array[:kept] for name, array in arrays.items()}
            yield _batch(system, key, stage, law, rows=rows[:kept], **some)


def _identity(system, key, stage: Stage, k, first_row: int, dtype) -> dict:
    """What runs are those of, but for how many they are: a folder or file of others is refused."""
    return identity_of(system) | {
        "what": "rollouts",
        "dtype": np.dtype(dtype).name,
        "law": law_of(system, k_law(system, k)).hash,
        "seed": list(seed_of(key)),
        "stage": int(stage),
        "first_row": first_row,
        "k": content_hash(k) if is_given(k) else "",
    }


def _batch(system, key, stage: Stage, law: LawSpec, **arrays) -> RolloutBatch:
    """Runs of the system as a batch."""
    return rollout_batch(
        **arrays,
        time=system.time,
        domain=system.domain,
        law=law,
        seed=seed_of(key),
        stage=int(stage),
        points=points_of(system),
        rotation=rotation_of(system),
        labels=labels_of(system),
        given=given_of(system),
    )


def _simulated(system, key, stage, k, first_row, dtype, rows, device=None) -> Arrays:
    """What is kept of the runs of global rows (B,)."""
    with blamed(f"{system.name}: expected the system to run"):
        drawn, trajectory = simulate_rows(system, key, stage, rows, k, first_row, device)
    p, q = np.asarray(trajectory.p, dtype), np.asarray(trajectory.q, np.float64)
    lost = {"lost": trajectory.lost} if isinstance(trajectory, Retried) else {}
    return {"k": drawn, "p": p, "q": q} | lost
