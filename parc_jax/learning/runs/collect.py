"""Black box -> batches of recorded runs, resumable and independent of chunking."""

import logging
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from parc_jax.common.errors import InputError, check_count
from parc_jax.common.keys import Stage, as_key, key_data
from parc_jax.common.spelling import hex_text
from parc_jax.learning.runs.batch import RolloutBatch, rollout_batch
from parc_jax.learning.runs.chunks import (
    Arrays,
    ChunkStore,
    default_chunk,
    require_same_runs,
    run_chunks,
    worker_devices,
)
from parc_jax.learning.runs.files import meta_of, read_npz, rollouts_from_npz, save_rollouts
from parc_jax.learning.runs.joined import concatenate
from parc_jax.learning.runs.law import SAMPLER, LawSpec, given_law, identity_of, law_of, subject_of
from parc_jax.learning.runs.simulate import is_traceable, remembered, simulator
from parc_jax.learning.system import Retried, check_system
from parc_jax.learning.systems.chained import Chained
from parc_jax.learning.systems.content import with_digest
from parc_jax.learning.systems.python_system import PythonSystem
from parc_jax.learning.systems.user_code import blamed

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
) -> RolloutBatch:
    """Run the system n times. Row i depends on (key, stage, i) alone.

    Does not consume `key`: other stages draw from it too, and never meet these numbers.
    k: None = uniform on the domain; (n_k,) = the same for all; (n, n_k) = as given; a function key
        -> (n_k,) = its law.
    first_row: number of the first, to continue a stream. dtype: storage of p, float64 or float32.
    chunk: runs per compiled call. Same chunk, same bits; another may differ in the last digit.
    path: an .npz file. Finished chunks are stored beside it, so a killed run continues where it
        was; an existing file of the same work is loaded. Either way the first of the stored runs
        are simulated again: a system that does not repeat them is refused. Runs of a system that is
        not compiled here and that were begun before the stop count as lost (`RolloutBatch.lost`).
    quiet: no progress bar. Raises InputError.
    """
    work = _Work(system, key, n, stage, k, first_row, dtype)
    if path is not None and Path(path).exists():
        return _finished(work, path)
    identity = work.identity()
    parts = None if path is None else Path(f"{path}.parts")
    chunk = work.chunk(chunk, parts)
    batch = concatenate(_streamed(work, chunk, parts, quiet), n)
    if parts is not None:
        made_by = {"system": identity, "chunk": chunk}
        save_rollouts(path, batch, made_by)
        shutil.rmtree(parts, ignore_errors=True)
    return batch


def stream_rollouts(
    system, key: jax.Array, n: int, stage=Stage.TRAIN, *, chunk=None, path=None, quiet=False, **rows
) -> Iterator[RolloutBatch]:
    """The batches of `collect` chunk by chunk, in order, in bounded memory, on several workers.
    path: a folder for the chunks. rows: k, first_row, dtype, as there. Raises InputError, also when
    the system changes while it runs.
    """
    work = _Work(system, key, n, stage, **rows)
    return _streamed(work, work.chunk(chunk, path), path, quiet)


@dataclass(frozen=True, eq=False)
class _Work:
    """Rows of a random stream to be run; fields as of `collect`. Raises InputError."""

    system: Any
    key: jax.Array
    n: int
    stage: Stage
    k: Any = None
    first_row: int = 0
    dtype: Any = np.float64

    def __post_init__(self) -> None:
        system, k = self.system, self.k
        check_system(system)
        as_key(self.key)
        check_count("n", self.n, 1, "collect(system, key, n=1000)")
        check_count("first_row", self.first_row, 0, "collect(system, key, n, first_row=1000)")
        subject_of(system)
        if not isinstance(self.stage, int | np.integer) or self.stage not in list(Stage):
            raise InputError(f"stage: expected a Stage, as Stage.TRAIN; got {self.stage!r:.60}.")
        if self.dtype not in (np.dtype(np.float64), np.dtype(np.float32)):
            raise InputError(f"dtype: expected float64 or float32; got {self.dtype!r:.60}.")
        if k is None or callable(k):
            return
        shape, domain = np.shape(k), system.domain
        if shape not in ((domain.n,), (self.n, domain.n)):
            raise InputError(
                f"rollouts k: expected ({domain.n},), ({self.n}, {domain.n}) or a law; got {shape}."
            )
        if not domain.contains(np.asarray(k)).all():
            raise InputError(
                f"rollouts k: expected every k inside the domain {domain.lo} .. {domain.hi}."
            )

    @property
    def law(self) -> LawSpec:
        """Of the runs, as the system declares it now."""
        return law_of(self.system, k_law(self.system, self.k))

    def identity(self) -> dict:
        """Of the system and its law: part of every file."""
        return identity_of(self.system) | {"law": self.law.hash}

    def facts(self) -> dict:
        """Numbers of the rows and their storage."""
        return {
            "first_row": int(self.first_row),
            "seed": list(seed_of(self.key)),
            "stage": int(self.stage),
            "dtype": np.dtype(self.dtype).name,
        }

    def chunk(self, chunk: int | None = None, path=None) -> int:
        """Runs per call: as given, as stored, or as suits system and machine."""
        if path is not None:
            # resuming must cut the rows in the same places
            chunk = chunk or ChunkStore.stored_chunk(path)
        chunk = chunk or getattr(self.system, "chunk", None)
        return int(chunk or default_chunk(self.system, self.n, len(worker_devices(self.system))))

    def simulate(self, rows: np.ndarray, device=None) -> Arrays:
        """Arrays to be stored of global rows (B,)."""
        about = (self.system, self.key, self.stage, rows, self.k, self.first_row, device)
        with blamed(f"{self.system.name}: expected the system to run"):
            drawn, trajectory = simulate_rows(*about)
        p, q = _kept(trajectory.p, self.dtype), _kept(trajectory.q, np.float64)
        lost = {"lost": np.asarray(trajectory.lost)} if isinstance(trajectory, Retried) else {}
        return {"k": drawn, "p": p, "q": q} | lost


def _kept(x, dtype) -> np.ndarray:
    """The numbers of a call; a copy of what is in host memory, which the next call may reuse."""
    return np.array(x, dtype) if isinstance(x, np.ndarray) else np.asarray(x, dtype)


def _streamed(work: _Work, chunk: int, path, quiet: bool) -> Iterator[RolloutBatch]:
    from tqdm import tqdm

    system, n, first_row = work.system, work.n, work.first_row
    devices = worker_devices(system)
    law, grid = work.law, system.time
    sim = simulator(system)
    # all chunks of one size, so that one program is compiled
    chunks = [np.arange(first_row + i, first_row + i + chunk) for i in range(0, n, chunk)]
    if not sim.traceable:
        chunks[-1] = chunks[-1][chunks[-1] < first_row + n]
    store = None
    if path is not None:
        meta = work.identity() | work.facts() | {"what": "rollouts", "chunk": chunk}
        store = ChunkStore(path, meta)
        first = store.first()
        if first is not None and first[0] < len(chunks):
            index, stored = first
            # a compiled chunk as a whole, for the same bits; one run of anything else
            again = chunks[index] if sim.traceable else chunks[index][:1]
            require_same_runs(store.folder, stored, work.simulate(again, devices[0]), system)

    def one(index, device):
        arrays = work.simulate(chunks[index], device)
        same = (work.law, system.time) == (law, grid)
        if not same or remembered(system).content.digest != sim.content.digest:
            raise InputError(
                f"{system.name}: expected a system that stays as it is while it runs; it was "
                "changed. Make another one instead."
            )
        return arrays

    title = f"{system.name}: {title_of(work.stage, first_row)}"
    _log.info("%s: %d rows in %d chunks", title, n, len(chunks))
    with tqdm(total=n, unit="rollout", desc=title, disable=quiet) as bar:
        done = run_chunks(one, len(chunks), devices, store, count_losses=not sim.traceable)
        early = None  # a run that did not fail, and its row
        for rows, arrays in zip(chunks, done, strict=True):
            size = min(chunk, first_row + n - int(rows[0]))
            _log.info("%s: rows %d to %d", title, rows[0], rows[0] + size - 1)
            bar.update(size)
            arrays = {name: array[:size] for name, array in arrays.items()}
            told = vars(subject_of(system)) | arrays | {"rows": rows[:size], "law": law}
            del told["system"]  # the law names it
            batch = rollout_batch(**told, seed=seed_of(work.key), stage=int(work.stage))
            if early is None and not batch.failed.all():
                at = np.flatnonzero(~batch.failed)[:1]
                early = rows[at], {name: array[at] for name, array in arrays.items()}
            if rows is chunks[-1] and early is not None and isinstance(system, PythonSystem):
                anew = work.simulate(early[0], devices[0])
                # a machine that goes away, or a run that is stopped as slow, tells nothing
                if all(np.isfinite(anew[name]).all() for name in ("p", "q")):
                    require_same_runs(system.name, early[1], anew, system)
            yield batch


def _finished(work: _Work, path) -> RolloutBatch:
    """The runs of a finished file, some of them simulated again. Raises InputError for others."""
    arrays = read_npz(path)
    batch = rollouts_from_npz(path, arrays)
    made_by = meta_of(arrays).get("made_by") or {}
    time, system = batch.time, work.system
    stored = made_by.get("system", {}) | {
        "law": batch.law.hash,
        "grid": hex_text((time.dt, time.t_f, time.dt_record)),
        "n": batch.n,
        "first_row": int(batch.rows[0]),
        "seed": batch.seed and list(batch.seed),
        "stage": batch.stage,
        "dtype": batch.p.dtype.name,
    }
    wanted = work.identity() | work.facts() | {"n": work.n}
    names = stored.keys() | wanted.keys()
    differs = {name for name in names if stored.get(name) != wanted.get(name)}
    if differs:
        raise InputError(
            f"{path}: holds other rollouts than the ones asked for; expected the same "
            f"{', '.join(sorted(differs))}. Delete it or choose another path."
        )
    n_again = made_by.get("chunk") or work.chunk()
    rows = work.first_row + np.arange(n_again if is_traceable(system) else 1)
    runs = {"k": batch.k, "p": batch.p, "q": batch.q}
    require_same_runs(path, runs, work.simulate(rows), system)
    about = subject_of(system)
    return replace(batch, rotation=about.rotation, labels=about.labels, given=about.given)


def simulate_rows(system, key, stage: Stage, rows: np.ndarray, k=None, first_row=0, device=None):
    """Run the given global rows (B,). Returns k (B, n_k) on the host and the Trajectory (B, ...) on
    the device, its p as columns (B, n_record + 1, n_c).
    """
    sim = simulator(system)
    if k is not None and not callable(k) and np.ndim(k) == 2:
        # padding rows beyond the list repeat its last entry; they are cut off again
        k = np.asarray(k, np.float64)[np.minimum(rows - first_row, len(k) - 1)]
    drawn = sim.rows(key, stage, rows, k, device)
    return drawn.k, sim.run(drawn, device)


def title_of(stage: Stage, first_row: int) -> str:
    """Purpose of the runs, in words; no two stages share them."""
    if stage == Stage.TRAIN and first_row:
        return "further runs for the profile"
    return {
        Stage.TRAIN: "training runs",
        Stage.BOUND: "fresh runs for the bound",
        Stage.VALIDATE: "validation",
        Stage.SCENE: "tests in the scene",
    }.get(stage, Stage(stage).name.lower())


def k_law(system, k) -> str:
    """Name of the law of k for a LawSpec."""
    if k is None:
        return system.k_law if isinstance(system, Chained) else "uniform"
    if not callable(k):
        return given_law(k)
    name = getattr(k, "__name__", type(k).__name__)
    return SAMPLER + with_digest("without a name" if name == "<lambda>" else name, k)


def seed_of(key) -> tuple[int, ...]:
    """The data of a random key, as plain numbers: part of the identity of every row."""
    return tuple(int(v) for v in key_data(key).ravel())
