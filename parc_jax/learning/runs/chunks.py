"""Work in chunks: threads, bounded memory, results in order, stored, resumed by one system only."""

import json
import os
import queue
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax
import numpy as np

from parc_jax import __version__
from parc_jax.common.backend import ROLLOUTS, backend
from parc_jax.common.errors import InputError, reading
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.runs.files import read_npz, write_atomic, write_npz
from parc_jax.learning.system import points_of
from parc_jax.learning.systems.content import whole_digest


def require_same_runs(where, stored: dict, again: dict, system) -> None:
    """Refuse runs that the system does not repeat. Raises InputError.

    stored, again: arrays of rows, of before and simulated anew, compared up to the shorter one.
    """
    # another machine may round differently
    single = np.dtype(getattr(system, "dtype", np.float64)) == np.float32
    within = TOLERANCES.resumed_single if single else TOLERANCES.resumed
    n = max(map(len, stored.values()))
    for name, old in stored.items():
        if not np.issubdtype(old.dtype, np.floating):
            continue
        new = np.asarray(again[name])[:n]
        old = old[: len(new)]
        same = old.shape == new.shape and np.isclose(
            new, old, rtol=within, atol=within, equal_nan=True
        )
        if not np.all(same):
            raise InputError(
                f"{where}: expected runs to repeat themselves; simulated again, their {name} comes "
                "out differently. The simulator has changed, keeps something from run to run, or "
                "draws randomness that does not come from the key. Make it begin each run anew, or "
                "learn from a log of its runs; stored ones: delete them or choose another path."
            )


def describe_work(path: Path, meta: dict) -> None:
    """Write into a folder what fills it, by which version. Raises InputError for others there."""
    wanted = meta | {"version": __version__}
    if not path.exists():
        write_atomic(path, json.dumps(wanted, sort_keys=True, indent=1).encode())
        return
    stored = _described(path)
    names = wanted.keys() | stored.keys()
    if differs := sorted(name for name in names if wanted.get(name) != stored.get(name)):
        raise InputError(
            f"{path.parent}: holds other work; expected the same {', '.join(differs)}. Go on with "
            "what began it, or choose another path."
        )


def _described(path: Path) -> dict:
    with reading(path, "a description of work, as it was written"):
        return dict(json.loads(path.read_text(encoding="utf-8")))


def begin(folder: Path, index: int) -> int:
    """Mark a piece of work as begun. Returns the number of its earlier begins without an end."""
    with open(folder / BEGUN.format(index), "ab") as marker:
        marker.write(b".")
        marker.flush()
        os.fsync(marker.fileno())
        return marker.tell() - 1


Arrays = dict[str, np.ndarray]
BEGUN = "begun_{:06d}"
HASH = "hash"  # of a chunk, its number and its folder's work


class ChunkStore:
    """A folder with one .npz per finished chunk and a meta.json that describes the work."""

    def __init__(self, folder, meta: dict):
        """Open or create. Raises InputError when the folder holds chunks of other work."""
        self.folder, self._meta = Path(folder), meta
        describe_work(self.folder / "meta.json", meta)

    @staticmethod
    def stored_chunk(folder) -> int | None:
        """Chunk size of the work already in the folder."""
        path = Path(folder) / "meta.json"
        return _described(path)["chunk"] if path.exists() else None

    def get(self, index: int) -> Arrays | None:
        """A finished chunk, or None. A damaged file counts as unfinished and is computed again.
        Raises InputError for another's, and for one that was changed.
        """
        path = self._path(index)
        try:
            arrays = read_npz(path) if path.exists() else None
        except InputError:
            return None
        if arrays and str(arrays.pop(HASH, "")) != whole_digest([self._meta, index, arrays]):
            raise InputError(
                f"{path}: expected a chunk of this folder, as it was written; it is of other work, "
                "or was changed. Choose another path."
            )
        return arrays

    def first(self) -> tuple[int, Arrays] | None:
        """The first finished chunk that can be read, with its number."""
        paths = sorted(self.folder.glob("chunk_*.npz"))
        numbers = [int(path.stem.removeprefix("chunk_")) for path in paths]
        return next(((i, one) for i in numbers if (one := self.get(i)) is not None), None)

    def put(self, index: int, arrays: Arrays) -> None:
        """Store a finished chunk, atomically."""
        of = {HASH: np.array(whole_digest([self._meta, index, arrays]))}
        write_npz(self._path(index), arrays | of)
        (self.folder / BEGUN.format(index)).unlink(missing_ok=True)

    def _path(self, index: int) -> Path:
        return self.folder / f"chunk_{index:06d}.npz"


def cores() -> int:
    """Number of CPU cores for this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def worker_devices(system) -> list:
    """The device of each worker thread; XLA releases the interpreter, so threads use all CPU cores.

    A system with `rollout_batch` gets one worker, or `at_once`: it is parallel by itself.
    """
    if callable(getattr(system, "rollout_batch", None)):
        return [None] * getattr(system, "at_once", 1)
    devices = jax.local_devices()
    if not backend(devices[0]).in_turn:
        return devices
    # devices of one CPU are the same cores, and a program is compiled for each device
    return devices[:1] * cores()


def run_chunks(
    work: Callable[[int, object], Arrays],
    n_chunks: int,
    devices: list,
    store: ChunkStore | None = None,
    count_losses: bool = False,
) -> Iterator[Arrays]:
    """Yield work(index, device) for every index, in order, at most two results per worker ahead.

    A stored chunk is not computed again. On an error or Ctrl-C, waiting chunks are cancelled.
    count_losses: rows of a chunk that was begun before and never finished count as lost; for work
        that may end its own process, where a second attempt is a choice.
    """
    free = queue.SimpleQueue()
    for device in devices:
        free.put(device)

    def one(index: int) -> Arrays:
        done = store.get(index) if store is not None else None
        if done is not None:
            return done
        device = free.get()
        try:
            before = begin(store.folder, index) if store is not None and count_losses else 0
            arrays = work(index, device)
        finally:
            free.put(device)
        if before:
            lost = arrays.get("lost", np.zeros(len(arrays["k"]), np.int64))
            arrays = arrays | {"lost": np.where(lost < 0, lost, lost + before)}
        if store is not None:
            store.put(index, arrays)
        return arrays

    # one thread more than devices, so that none of these waits while a chunk is written
    pool, waiting = ThreadPoolExecutor(len(devices) + (store is not None)), deque()
    try:
        for index in range(n_chunks):
            waiting.append(pool.submit(one, index))
            if len(waiting) > 2 * len(devices):
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def default_chunk(system, n: int, workers: int) -> int:
    """Rows per compiled call: a power of two, of the size that suits the kind of device."""
    n_c = len(points_of(system)) * system.n_p
    row_bytes = 8 * ((system.time.n_record + 1) * n_c + system.n_q)
    largest = max(ROLLOUTS, backend().rollout_bytes // row_bytes)
    wanted = max(16, -(-n // workers))
    return min(1 << (largest.bit_length() - 1), 1 << (wanted - 1).bit_length())
