"""Runs on workers: processes of this machine, or any `concurrent.futures.Executor`, anywhere.

A run that is lost with its worker has failed, since the robot may have ended it. Where the user
declares that workers go away independently of their runs it is made again, and counted.
"""

import multiprocessing
import pickle
import signal
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from queue import LifoQueue
from typing import NamedTuple
from uuid import uuid4
from weakref import finalize

from parc_jax.common.errors import InputError
from parc_jax.learning.systems.python_worker import (
    UNCOUNTED,
    Call,
    OtherCode,
    code_of,
    failed,
    run_sent,
)
from parc_jax.learning.systems.user_code import blamed, said


class Processes(Executor):
    """As many places as workers; a place's first call starts its process, also after a death."""

    def __init__(self, workers: int):
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            raise SystemExit(1)  # a worker that imports an unguarded script; its parent says so
        self._free: LifoQueue[ProcessPoolExecutor | None] = LifoQueue()
        self._at_work: set[ProcessPoolExecutor] = set()
        for _ in range(workers):
            self._free.put(None)
        finalize(self, self._free.queue.clear)  # before Python ends, while their modules are there

    def submit(self, function: Callable, /, *arguments) -> Future:
        """The call on its way; waits for a free place. A process that dies is ChildProcessError."""
        # fresh: a fork of one that runs JAX may hang. Ctrl-C is the parent's, and fails no run
        fresh, ignoring = multiprocessing.get_context("spawn"), (signal.SIGINT, signal.SIG_IGN)
        process = self._free.get() or ProcessPoolExecutor(1, fresh, signal.signal, ignoring)
        try:
            inner = process.submit(function, *arguments)
        except BaseException as error:  # as Python ends
            self._free.put(None)
            if isinstance(error, BrokenExecutor):  # it died while it was free: nothing has begun
                return self.submit(function, *arguments)
            raise
        self._at_work.add(process)
        outer: Future = Future()

        def ended(inner: Future) -> None:
            self._at_work.discard(process)
            error = inner.exception()
            dead = isinstance(error, BrokenExecutor)
            self._free.put(None if dead else process)
            if error is None:
                outer.set_result(inner.result())
            else:
                outer.set_exception(ChildProcessError("its worker process died") if dead else error)

        inner.add_done_callback(ended)
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes that are free."""
        while not self._free.empty():
            if (process := self._free.get()) is not None:
                process.shutdown(wait, cancel_futures=cancel_futures)

    def kill(self) -> None:
        """End all processes, with the calls that they are at."""
        for process in list(self._at_work):
            for one in list((process._processes or {}).values()):
                one.kill()
        self.shutdown()


LOSSES = 3  # of a run, then the work ends
CHECK_S = 1.0  # [s] between two looks at the room that other batches leave
UNKNOWN = 64  # workers of an executor that does not report their number
MAKE_AGAIN = ("distributed",)  # packages whose executors make lost calls again in silence
# others may do so too, as a wrapper with retries does, whatever is declared of them
COUNTED = (Processes, ProcessPoolExecutor, ThreadPoolExecutor)


class Sent(NamedTuple):
    """A call on its way, and its executor."""

    future: Future
    executor: Executor


class Fleet:
    """An executor, or a function that makes one, and so another when it broke.

    name: of the system, for messages. workers: None = as many as the executor reports. again: lost
    runs are made again; else each is begun once at most, but by executors that are not COUNTED.
    """

    def __init__(self, name: str, executor: Executor | Callable, workers: int | None, again: bool):
        self.name, self.again = name, again
        self._make = None if hasattr(executor, "submit") else executor
        self._executor = executor if self._make is None else None
        self._changing, self._beginning, self._has_begun = threading.Lock(), threading.Lock(), False
        self.workers: int = workers or getattr(self._current(), "_max_workers", UNKNOWN)
        # no run waits in the queue of an executor, where it would be lost with a running one
        self._room = threading.Semaphore(self.workers)
        kind = type(self._current())
        self.own = kind is Processes
        if kind.__module__.startswith(MAKE_AGAIN) and not again:
            raise InputError(
                f"{name}: expected an executor that loses the calls of a lost worker; "
                f"{kind.__name__} makes them again, until they succeed. Where "
                'workers go away whatever their runs do, say so: lost="again".'
            )

    def run(self, both, which, seeds, arguments: list[tuple], *shapes) -> list[Call]:
        """Runs of a batch by both[which], in order. Raises InputError for workers that do not begin
        or have other code, for runs that are made again and lost every time, and where an executor
        broke and nobody makes another; ImportError for what a worker lacks.
        """
        as_sent = pickle.loads(pickle.dumps(both)) if self.own else both  # some leave parts out
        code, self._named = code_of(as_sent, self.own)

        def send(*places) -> Sent:
            of_part = [seeds[i] for i in places], [arguments[i] for i in places]
            return self._sent(run_sent, uuid4().hex, code, both, which, *of_part, *shapes)

        self._begin(send)
        calls: dict[int, Call] = {}
        losses = [0] * len(seeds)
        out: dict[Future, tuple[Sent, int]] = {}
        waiting = deque(range(len(seeds)))
        while waiting or out:
            while waiting and self._room.acquire(blocking=not out):
                try:
                    sent = send(waiting[0])
                except BaseException:
                    self._room.release()
                    raise
                sent.future.add_done_callback(lambda _: self._room.release())
                out[sent.future] = sent, waiting.popleft()
            done, _ = wait(out, timeout=CHECK_S, return_when=FIRST_COMPLETED)
            for future in done:
                sent, place = out.pop(future)
                if (call := self._brought(sent)) is not None:
                    lost = losses[place] if type(sent.executor) in COUNTED else UNCOUNTED
                    calls[place] = call[0]._replace(lost=lost)
                    continue
                why, k = said(_error_of(future)), arguments[place][0]
                losses[place] += 1
                if not self.again:
                    calls[place] = failed(*shapes, f"as its worker was lost ({why}), with k = {k}")
                elif losses[place] < LOSSES:
                    waiting.append(place)
                else:
                    raise InputError(
                        f"{self.name}: expected workers that finish their runs; the one with k = "
                        f"{k} was lost {LOSSES} times, the last time with {why}. A run that fails "
                        "raises an exception and does not end its process; a function for other "
                        "processes stands at the top level of a module that they can import."
                    )
        return [calls[place] for place in range(len(seeds))]

    def _begin(self, send: Callable[..., Sent]) -> None:
        """An empty call before the first run, whose failure is no run's. Raises InputError."""
        with self._beginning:
            for _ in range(LOSSES if self.again else 1):
                if self._has_begun:
                    return
                sent = send()
                wait([sent.future])
                error = _error_of(sent.future)
                self._has_begun = error is None and self._brought(sent) is not None
        if not self._has_begun:
            self.close()
            raise InputError(
                f"{self.name}: expected workers that start; an empty call, before the first run, "
                f"ended with {said(error)}. A script guards its own start with "
                '`if __name__ == "__main__":`, since worker processes import it; what they run '
                "stands at the top level of a module that they can import."
            )

    def close(self) -> None:
        """End an executor that was made here; another is made when needed."""
        with self._changing:
            if self._make is not None and self._executor is not None:
                self._executor.shutdown(wait=True)
                self._executor = None

    def _brought(self, sent: Sent) -> list[Call] | None:
        """The finished runs, None for lost ones. Raises InputError, and ImportError."""
        error = _error_of(sent.future)
        if isinstance(error, ImportError):
            raise error
        if error is not None:
            self._replace(sent.executor, error)
            return None
        brought = sent.future.result()
        if isinstance(brought, OtherCode):
            others = [x for x, told in self._named.items() if brought.named.get(x) != told]
            other = "other code of the system, or another parc_jax, NumPy or Python"
            raise InputError(
                f"{self.name}: expected workers with the program that is here; {brought.where} has "
                f"{f'another {others[0]}' if others else other}. Set globals where their module is "
                "imported, pass them by functools.partial, make what is new at each import (a time,"
                " a folder) in the run, or use workers=0; bring the same code, start workers anew."
            )
        return brought

    def _sent(self, *call) -> Sent:
        """The call on its way. A refused one has not begun, and goes on. Raises InputError."""
        for _ in range(LOSSES):
            executor = self._current()
            try:
                return Sent(executor.submit(*call), executor)
            except Exception as error:  # broken, shut down, or what it cannot pickle
                refused = error
                self._replace(executor, error)
        raise InputError(
            f"{self.name}: expected an executor that takes calls; it refused {LOSSES} times, the "
            f"last time with {said(refused)}."
        )

    def _current(self) -> Executor:
        with self._changing:
            if self._executor is None:
                with blamed(f"{self.name}: expected a function that makes an executor"):
                    self._executor = self._make()
            return self._executor

    def _replace(self, executor: Executor, error: BaseException) -> None:
        """Leave a broken executor, once. Raises InputError where there is no other."""
        if not isinstance(error, BrokenExecutor):
            return
        with self._changing:
            if self._executor is not executor:
                return
            if self._make is None:
                raise InputError(
                    f"{self.name}: expected an executor that goes on; it broke with {said(error)}. "
                    "Give a function that makes one, so that another can take its place; where a "
                    "path was given finished chunks are kept, and runs that were begun count as "
                    "lost the next time."
                )
            self._executor = None
        executor.shutdown(wait=False)


def _error_of(future: Future) -> BaseException | None:
    return CancelledError() if future.cancelled() else future.exception()
