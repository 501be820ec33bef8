"""Runs on workers: processes of our own, or any `concurrent.futures.Executor`, here or elsewhere.

A run that is lost with its worker has failed, since the robot may have ended it. Where the user
declares that workers go away independently of their runs it is made again, and counted.
"""

import multiprocessing
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from dataclasses import dataclass
from queue import LifoQueue
from typing import NamedTuple
from uuid import uuid4

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
    """As many places as workers; a process starts with the first call in its place, or the first
    after one died there.
    """

    def __init__(self, workers: int):
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            raise SystemExit(1)  # a worker that imports an unguarded script; its parent says so
        self._free: LifoQueue[ProcessPoolExecutor | None] = LifoQueue()
        self._at_work: set[ProcessPoolExecutor] = set()
        for _ in range(workers):
            self._free.put(None)

    def submit(self, function: Callable, /, *arguments) -> Future:
        """The call on its way; waits for a free place. A process that dies is ChildProcessError."""
        process = self._free.get() or _process()
        self._at_work.add(process)
        outer: Future = Future()

        def ended(inner: Future) -> None:
            self._at_work.discard(process)
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

    def kill(self) -> None:
        """End all processes, with the calls that they are at."""
        for process in list(self._at_work):
            for one in list((process._processes or {}).values()):
                one.kill()
        self.shutdown()


def _process() -> ProcessPoolExecutor:
    # fresh: a fork of one that runs JAX may hang. Ctrl-C is the parent's, and fails no run
    ignoring = {"initializer": signal.signal, "initargs": (signal.SIGINT, signal.SIG_IGN)}
    return ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"), **ignoring)


RUNS_PER_PART = 4  # of runs that are made again; others go alone, so that none is lost with another
LOSSES = 3  # of a part, then its runs go out alone; of a run alone, then the work ends
SLOW = 3.0  # [longest time of a part so far] after which a part is sent once more
LEAST_S = 1.0  # [s] least time of a slow part, and between two checks for some
UNKNOWN = 64  # workers of an executor that does not report their number
MAKE_AGAIN = ("distributed",)  # packages whose executors make lost calls again in silence


class Sent(NamedTuple):
    """A call on its way, and its executor."""

    future: Future
    executor: Executor


@dataclass
class Share:
    """Some runs of a batch. places: in the batch. lost: number of losses. copies: sent for being
    slow. since: [s] time of the last sending.
    """

    places: range
    lost: int = 0
    copies: int = 0
    since: float = 0.0


class Fleet:
    """An executor, or a function that makes one, and so another when it broke.

    name: of the system, for messages. workers: None = as many as the executor reports. again: lost
    runs are made again, and slow ones twice; else each of them is begun once at most. own:
    processes started here, which hold the same code.
    """

    def __init__(
        self,
        name: str,
        executor: Executor | Callable[[], Executor],
        workers: int | None,
        again: bool = False,
        own: bool = False,
    ):
        self.name, self.again, self.own = name, again, own
        self._make = None if hasattr(executor, "submit") else executor
        self._executor = executor if self._make is None else None
        self._changing, self._one_by_one = threading.Lock(), threading.Lock()
        self._beginning, self._has_begun = threading.Lock(), False
        self._longest_s = 0.0  # that a part took
        self.workers: int = workers or getattr(self._current(), "_max_workers", UNKNOWN)
        # no run waits in the queue of an executor, where it would be lost with a running one
        self._room = threading.Semaphore(sys.maxsize if again else self.workers)
        self._uncounted = not own and type(self._current()).__module__.startswith(MAKE_AGAIN)
        if self._uncounted and not again:
            raise InputError(
                f"{name}: expected an executor that loses the calls of a lost worker; "
                f"{type(self._current()).__name__} makes them again, until they succeed. Where "
                'workers go away whatever their runs do, say so: lost="again".'
            )

    def run(self, function, seeds, arguments: list[tuple], *shapes) -> list[Call]:
        """The runs of a batch, in order. Raises InputError for workers that do not begin or have
        other code, for runs that are made again and lost every time, and where an executor broke
        and nobody makes another; ImportError for what a worker lacks.
        """
        code = "" if self.own else code_of(function)

        def send(places) -> Sent:
            of_part = [seeds[i] for i in places], [arguments[i] for i in places]
            return self._sent(run_sent, uuid4().hex, code, function, *of_part, *shapes)

        self._begin(send)
        found = self._together(send, len(seeds))
        with self._one_by_one:
            for place in sorted(range(len(seeds)) - found.keys()):
                found[place] = self._alone(send, place, arguments[place])
        for place, call in found.items():
            if isinstance(call, str):
                why = f"as its worker was lost ({call}), with k = {arguments[place][0]}"
                found[place] = failed(*shapes, why)
            elif self._uncounted:
                found[place] = call._replace(lost=UNCOUNTED)
        return [found[place] for place in range(len(seeds))]

    def _begin(self, send: Callable[[range], Sent]) -> None:
        """An empty call before the first run, whose failure is no run's. Raises InputError."""
        with self._beginning:
            for _ in range(LOSSES if self.again else 1):
                if self._has_begun:
                    return
                sent = send(range(0))
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

    def _together(self, send: Callable[[range], Sent], n: int) -> dict[int, Call | str]:
        """Finished runs of n by place; of lost ones the fate of their worker, or nothing where they
        are made again and were lost LOSSES times.
        """
        calls_at: dict[int, Call | str] = {}
        out: dict[Future, tuple[Sent, Share]] = {}
        each = RUNS_PER_PART if self.again else 1
        waiting = deque(Share(range(i, min(i + each, n))) for i in range(0, n, each))

        def go(part: Share) -> None:
            part.since = time.monotonic()
            try:
                sent = send(part.places)
            except BaseException:
                self._room.release()
                raise
            sent.future.add_done_callback(lambda _: self._room.release())
            out[sent.future] = sent, part

        # a part that is out and has come back was sent twice
        while waiting or any(part.places[0] not in calls_at for _, part in out.values()):
            while waiting and self._room.acquire(blocking=not out):
                go(waiting.popleft())
            done, _ = wait(out, timeout=LEAST_S, return_when=FIRST_COMPLETED)
            for future in done:
                sent, part = out.pop(future)
                calls = self._brought(sent)
                if part.places[0] in calls_at:
                    continue
                if calls is not None:
                    self._longest_s = max(self._longest_s, time.monotonic() - part.since)
                    lost = part.lost + part.copies
                    calls = [call._replace(lost=lost) for call in calls]
                    calls_at.update(zip(part.places, calls, strict=True))
                elif not self.again:
                    calls_at[part.places[0]] = said(_error_of(future))
                elif part.lost + 1 < LOSSES:
                    part.lost += 1
                    waiting.append(part)
            for part in self._slow(out, calls_at):
                part.copies += 1
                waiting.append(part)
        return calls_at

    def _slow(self, out: dict, calls_at: dict) -> list[Share]:
        """Parts whose worker may have stopped in silence."""
        if not self.again or self._longest_s == 0.0:
            return []  # or no part has come back yet
        latest = time.monotonic() - max(LEAST_S, SLOW * self._longest_s)
        parts = {id(part): part for _, part in out.values() if part.places[0] not in calls_at}
        return [part for part in parts.values() if part.since < latest and part.copies < LOSSES]

    def _alone(self, send: Callable[[range], Sent], place: int, given: tuple) -> Call:
        """A run by itself, so that a loss is its own."""
        for lost in range(LOSSES):
            sent = send(range(place, place + 1))
            wait([sent.future])
            calls = self._brought(sent)
            if calls is not None:
                return calls[0]._replace(lost=LOSSES + lost)
        raise InputError(
            f"{self.name}: expected workers that finish their runs; the one with k = {given[0]} "
            f"was lost {LOSSES} times when it was sent alone, the last time with "
            f"{said(_error_of(sent.future))}. A run that fails raises an exception and does not "
            "end its process; a function for other processes stands at the top level of a module "
            "that they can import."
        )

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
            raise InputError(
                f"{self.name}: expected workers with the program that is here; {brought.where} has "
                "other code of the system, or another parc_jax, NumPy or Python. Bring the same "
                "there and start its workers anew."
            )
        return brought

    def _sent(self, *call) -> Sent:
        """The call on its way. A refused call has not begun, and goes to the next executor. Raises
        InputError.
        """
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
