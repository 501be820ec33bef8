"""Black box -> batches of recorded runs, resumable and independent of chunking."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import jax
import numpy as np

from parc_jax.arrays import content_hash
from parc_jax.distributed import from_all, place, require_same
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.rollout.batch import RolloutBatch, concatenate, rollout_batch
from parc_jax.rollout.chunks import Arrays, ChunkStore, default_chunk, run_chunks, worker_devices
from parc_jax.rollout.files import read_npz, rollouts_from_npz, save_rollouts
from parc_jax.rollout.law import law_of
from parc_jax.rollout.simulate import check_shapes, simulator


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
    k: None = uniform on the domain; (n_k,) = the same for all; (n, n_k) = as given; a function key -> (n_k,) = its law.
    first_row: number of the first row, to continue a stream. dtype: storage of p, float64 or float32.
    chunk: runs per compiled call. Same chunk, same bits; another chunk may round differently in the last digit.
    path: an .npz file. Finished chunks are kept beside it, so a killed run continues where it was; an existing file
    of the same
    work is loaded. quiet: no progress bar. Raises InputError.
    """
    if path is not None and all(from_all(Path(path).exists())):
        done = rollouts_from_npz(path, read_npz(path))
        wanted = (law_of(system, k_law(k)), seed_of(key), int(stage), n)
        same = (done.law, done.seed, done.stage, done.n) == wanted and done.rows[0] == first_row
        if not same or (_is_given(k) and not (done.k == np.asarray(k, np.float64)).all()):
            raise InputError(f"{path}: holds other rollouts than the ones asked for. Delete it or choose another path.")
        return done
    parts = None if path is None else Path(f"{path}.parts")
    stream = stream_rollouts(
        system, key, n, stage, k=k, first_row=first_row, dtype=dtype, chunk=chunk, path=parts, quiet=quiet
    )
    batch = concatenate(stream)
    if parts is not None:
        save_rollouts(path, batch)
        shutil.rmtree(parts, ignore_errors=True)  # hosts may share the folder
    return batch


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
) -> Iterator[RolloutBatch]:
    """The batches of `collect` chunk by chunk, in order, in bounded memory. path: a folder that keeps the chunks."""
    law, seed = law_of(system, k_law(k)), seed_of(key)

    def work(rows, device):
        drawn, trajectory = simulate_rows(system, key, stage, rows, k, first_row, device)
        return {"k": drawn, "p": np.asarray(trajectory.p, dtype), "q": np.asarray(trajectory.q, np.float64)}

    label = {"what": "rollouts", "dtype": np.dtype(dtype).name}
    for rows, arrays in map_rows(
        work, system, key, n, stage, k=k, first_row=first_row, chunk=chunk, path=path, quiet=quiet, label=label
    ):
        yield rollout_batch(
            **arrays, time=system.time, domain=system.domain, law=law, rows=rows, seed=seed, stage=int(stage)
        )


def simulate_rows(system, key, stage: Stage, rows: np.ndarray, k=None, first_row=0, device=None):
    """Run the given global rows (B,). Returns k (B, n_k) on the host and the Trajectory (B, ...) on the device."""
    sim = simulator(system)
    if _is_given(k) and np.ndim(k) == 2:
        # padding rows beyond the list repeat its last entry; they are cut off again
        k = np.asarray(k, np.float64)[np.minimum(rows - first_row, len(k) - 1)]
    drawn = sim.rows(key, stage, rows, k)
    trajectory = sim.run(drawn, device)
    check_shapes(system, trajectory)
    return drawn.k, trajectory


def map_rows(
    work, system, key, n: int, stage: Stage, *, k=None, first_row=0, chunk=None, path=None, quiet=False, label: dict
) -> Iterator[tuple[np.ndarray, Arrays]]:
    """Apply work(rows (chunk,), device) -> arrays (chunk, ...) to n rows of a stream; yields (rows, arrays) without
    padding.

    The general form of `stream_rollouts`: results stream in order, several workers, resumable when `path` (a folder)
    is given;
    `label` says what the work is, so that a folder is never continued with other work.
    """
    from tqdm import tqdm

    if n < 1:
        raise InputError(f"rollouts: expected n >= 1; got {n}.")
    _check_k(system, n, k)
    devices = worker_devices(system)
    store = None
    if path is not None:
        chunk = chunk or ChunkStore.stored_chunk(path)
    # hosts may differ in cores and in what they have on disk: the first one decides
    chunk = from_all(int(chunk or getattr(system, "chunk", None) or default_chunk(system, n, len(devices))))[0]
    given = content_hash(k) if _is_given(k) else ""
    law = law_of(system, k_law(k)).hash
    meta = label | {
        "law": law,
        "seed": list(seed_of(key)),
        "stage": int(stage),
        "first_row": first_row,
        "chunk": chunk,
        "k": given,
    }
    require_same(f"{label['what']} of {n} rows", meta)
    if path is not None:
        store = ChunkStore(path, meta)
    chunk_rows = [np.arange(first_row + i, first_row + i + chunk) for i in range(0, n, chunk)]
    if callable(getattr(system, "rollout_batch", None)):  # needs no fixed shape: do not run what will be cut off
        chunk_rows[-1] = chunk_rows[-1][chunk_rows[-1] < first_row + n]

    def one(index, device):
        return work(chunk_rows[index], device)

    quiet, title = quiet or place()[0] > 0, f"{system.name} {Stage(stage).name.lower()}"
    with tqdm(total=n, unit="rollout", desc=title, disable=quiet) as bar:
        for rows, arrays in zip(chunk_rows, run_chunks(one, len(chunk_rows), devices, store), strict=True):
            kept = min(chunk, first_row + n - int(rows[0]))
            bar.update(kept)
            yield rows[:kept], {name: array[:kept] for name, array in arrays.items()}


def k_law(k) -> str:
    """Name of the law of k for a LawSpec."""
    if k is None:
        return "uniform"
    return getattr(k, "__name__", type(k).__name__) if callable(k) else "given"


def seed_of(key) -> tuple[int, ...]:
    """The data of a random key, as plain numbers: part of the identity of every row."""
    data = jax.random.key_data(key) if jax.dtypes.issubdtype(key.dtype, jax.dtypes.prng_key) else key
    return tuple(int(v) for v in np.asarray(data).ravel())


def _is_given(k) -> bool:
    return k is not None and not callable(k)


def _check_k(system, n: int, k) -> None:
    if not _is_given(k):
        return
    shape = np.shape(k)
    if shape not in ((system.domain.n,), (n, system.domain.n)):
        raise InputError(
            f"rollouts k: expected ({system.domain.n},), ({n}, {system.domain.n}) or a function; got {shape}."
        )
    if not system.domain.contains(np.asarray(k)).all():
        raise InputError(f"rollouts k: expected every k inside the domain {system.domain.lo} .. {system.domain.hi}.")
