"""Work in chunks: several worker threads, bounded memory, results in order, finished chunks kept on
disk.
"""

import json
import os
import queue
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax
import numpy as np

from parc_jax.common.backend import backend
from parc_jax.common.errors import InputError
from parc_jax.learning.runs.files import read_npz, write_atomic, write_npz
from parc_jax.learning.runs.resume import refuse_other_work
from parc_jax.learning.system import points_of

Arrays = dict[str, np.ndarray]


class ChunkStore:
    """A folder with one .npz per finished chunk and a meta.json that says what work it belongs
    to.
    """

    def __init__(self, folder, meta: dict):
        """Open or create. Raises InputError when the folder holds chunks of other work."""
        self.folder = Path(folder)
        known = self.folder / "meta.json"
        if known.exists():
            refuse_other_work(self.folder, json.loads(known.read_text()), meta)
        else:
            write_atomic(known, json.dumps(meta, sort_keys=True, indent=1).encode())

    @staticmethod
    def stored_chunk(folder) -> int | None:
        """Chunk size of the work already in the folder: resuming must cut the rows in the same
        places.
        """
        known = Path(folder) / "meta.json"
        return json.loads(known.read_text())["chunk"] if known.exists() else None

    def get(self, index: int) -> Arrays | None:
        """A finished chunk, or None. A damaged file counts as unfinished and is computed again."""
        path = self._path(index)
        try:
            return read_npz(path) if path.exists() else None
        except InputError:
            return None

    def first(self) -> tuple[int, Arrays] | None:
        """The first finished chunk that can be read, with its number."""
        for path in sorted(self.folder.glob("chunk_*.npz")):
            index = int(path.stem.removeprefix("chunk_"))
            arrays = self.get(index)
            if arrays is not None:
                return index, arrays
        return None

    def put(self, index: int, arrays: Arrays) -> None:
        """Keep a finished chunk, atomically."""
        write_npz(self._path(index), arrays)
        self._marker(index).unlink(missing_ok=True)

    def begin(self, index: int) -> int:
        """Note that a chunk is begun. Returns how often it was begun before and never finished."""
        with open(self._marker(index), "ab") as marker:
            marker.write(b".")
            marker.flush()
            os.fsync(marker.fileno())
            return marker.tell() - 1

    def _path(self, index: int) -> Path:
        return self.folder / f"chunk_{index:06d}.npz"

    def _marker(self, index: int) -> Path:
        return self.folder / f"begun_{index:06d}"


def cores() -> int:
    """That this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def worker_devices(system) -> list:
    """One entry per worker thread: the device it runs on. XLA releases the interpreter, so threads
    use all CPU cores. However many devices a CPU is divided into, they are the same cores, and a
    program is compiled for each device that runs it: all threads share the first.

    A system with its own `rollout_batch` gets one worker, or as many as its `at_once` says: its
    parallelism is its own.
    """
    if callable(getattr(system, "rollout_batch", None)):
        return [None] * getattr(system, "at_once", 1)
    devices = jax.local_devices()
    if not backend(devices[0]).threads:
        return devices
    return devices[:1] * cores()


def run_chunks(
    work: Callable[[int, object], Arrays],
    n_chunks: int,
    devices: list,
    store: ChunkStore | None = None,
    count_losses: bool = False,
) -> Iterator[Arrays]:
    """Yield work(index, device) for every index, in order, at most two results per worker ahead of
    the consumer.

    A chunk found in the store is not computed again. On an error or Ctrl-C, waiting chunks are
    cancelled. count_losses: the rows of a chunk that was begun before and never finished count as
    lost so often; for work that may end its own process, where a second attempt is a choice.
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
            before = store.begin(index) if store is not None and count_losses else 0
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
    how = backend()
    largest = max(how.rollouts, how.rollout_bytes // row_bytes)
    wanted = max(16, -(-n // workers))
    return min(1 << (largest.bit_length() - 1), 1 << (wanted - 1).bit_length())
