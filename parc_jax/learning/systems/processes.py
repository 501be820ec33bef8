"""Worker processes of our own, one call at a time in each: one that dies takes its own call with it
and no other.
"""

import multiprocessing
import signal
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from queue import LifoQueue


class Processes(Executor):
    """As many places as workers; a process starts with the first call in its place, or the first
    after one died there.
    """

    def __init__(self, workers: int):
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            raise SystemExit(1)  # a worker that imports an unguarded script; its parent says so
        self._free: LifoQueue[ProcessPoolExecutor | None] = LifoQueue()
        for _ in range(workers):
            self._free.put(None)

    def submit(self, function: Callable, /, *arguments) -> Future:
        """The call on its way; waits for a free place. A process that dies is ChildProcessError."""
        process = self._free.get() or _process()
        outer: Future = Future()

        def ended(inner: Future) -> None:
            error = inner.exception()
            dead = isinstance(error, BrokenExecutor)
            self._free.put(None if dead else process)
            if dead:
                outer.set_exception(ChildProcessError("its worker process died"))
            elif error is not None:
                outer.set_exception(error)
            else:
                outer.set_result(inner.result())

        process.submit(function, *arguments).add_done_callback(ended)
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes that are free."""
        while not self._free.empty():
            process = self._free.get()
            if process is not None:
                process.shutdown(wait, cancel_futures=cancel_futures)


def _process() -> ProcessPoolExecutor:
    # fresh: a fork of one that runs JAX may hang. Ctrl-C is the parent's, and fails no run
    ignoring = {"initializer": signal.signal, "initargs": (signal.SIGINT, signal.SIG_IGN)}
    return ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"), **ignoring)
