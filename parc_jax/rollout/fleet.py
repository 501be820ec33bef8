"""Runs on workers of somebody else's: any `concurrent.futures.Executor`, here or on other machines.

Rows go out in small parts, a few per worker at a time, and what comes back depends on the rows
alone. A part that is lost with its worker is sent again: only a run that says so itself has failed.
"""

import threading
import time
from collections.abc import Callable
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from dataclasses import dataclass
from typing import NamedTuple
from uuid import uuid4

from parc_jax.errors import InputError
from parc_jax.rollout.python_worker import Call, OtherCode, code_of, run_sent
from parc_jax.rollout.user_code import blamed, said

RUNS_PER_PART = 4
LOSSES = 3  # of a part, then its runs go out alone; of a run alone, then the work ends
SLOW = 3.0  # times as long as the longest so far: a part that is out as long is sent once more
LEAST_S = 1.0  # [s] what is out for less is not slow; time between two looks
UNKNOWN = 64  # workers of an executor that does not say how many it has


class Sent(NamedTuple):
    """What comes of a call, and the executor that was asked."""

    future: Future
    executor: Executor


@dataclass
class Share:
    """Some runs of a batch. places: in the batch. lost: how often. copies: sent for being slow.
    since: when it was sent last [s].
    """

    places: range
    lost: int = 0
    copies: int = 0
    since: float = 0.0


class Fleet:
    """An executor of the user's, or a function that makes one, and so another when it broke.

    name: of the system, for messages. workers: None = as many as the executor says.
    """

    def __init__(self, name: str, executor: Executor | Callable[[], Executor], workers: int | None):
        self.name = name
        self._make = None if hasattr(executor, "submit") else executor
        self._executor = executor if self._make is None else None
        self._changing = threading.Lock()
        self._one_by_one = threading.Lock()
        self._longest_s = 0.0  # that a part took
        self.workers: int = workers or getattr(self._current(), "_max_workers", UNKNOWN)

    def run(self, function, seeds, arguments: list[tuple], *shapes) -> list[Call]:
        """The runs of a batch, in order. Raises InputError for workers with other code, for a run
        that takes every worker with it, and where an executor broke and nobody makes another.
        """
        code = code_of(function)

        def send(places) -> Sent:
            of_part = [seeds[i] for i in places], [arguments[i] for i in places]
            return self._sent(run_sent, uuid4().hex, code, function, *of_part, *shapes)

        found = self._together(send, len(seeds))
        with self._one_by_one:
            for place in sorted(range(len(seeds)) - found.keys()):
                found[place] = self._alone(send, place, arguments[place])
        return [found[place] for place in range(len(seeds))]

    def close(self) -> None:
        """End an executor that was made here; another is made when needed."""
        with self._changing:
            if self._make is not None and self._executor is not None:
                self._executor.shutdown(wait=True)
                self._executor = None

    def _together(self, send: Callable[[range], Sent], n: int) -> dict[int, Call]:
        """What the parts of n runs bring, all out at the same time; without those that were lost
        LOSSES times.
        """
        found: dict[int, Call] = {}
        out: dict[Future, tuple[Sent, Share]] = {}

        def go(part: Share) -> None:
            part.since = time.monotonic()
            sent = send(part.places)
            out[sent.future] = sent, part

        for first in range(0, n, RUNS_PER_PART):
            go(Share(range(first, min(first + RUNS_PER_PART, n))))
        while any(part.places[0] not in found for _, part in out.values()):  # else they are copies
            done, _ = wait(out, timeout=LEAST_S, return_when=FIRST_COMPLETED)
            for future in done:
                sent, part = out.pop(future)
                calls = self._brought(sent)
                if calls is not None:
                    found.update(zip(part.places, calls, strict=True))
                    self._longest_s = max(self._longest_s, time.monotonic() - part.since)
                elif part.lost + 1 < LOSSES and part.places[0] not in found:
                    part.lost += 1
                    go(part)
            for part in self._slow(out, found):
                part.copies += 1
                go(part)
        return found

    def _slow(self, out: dict, found: dict) -> list[Share]:
        """Parts of which nobody knows whether their worker still works on them."""
        if self._longest_s == 0.0:
            return []  # how long one takes is not known yet
        latest = time.monotonic() - max(LEAST_S, SLOW * self._longest_s)
        parts = {id(part): part for _, part in out.values() if part.places[0] not in found}
        return [part for part in parts.values() if part.since < latest and part.copies < LOSSES]

    def _alone(self, send: Callable[[range], Sent], place: int, given: tuple) -> Call:
        """A run by itself, so that what is lost is lost by it."""
        for _ in range(LOSSES):
            sent = send(range(place, place + 1))
            wait([sent.future])
            calls = self._brought(sent)
            if calls is not None:
                return calls[0]
        raise InputError(
            f"{self.name}: expected workers that finish their runs; the one with k = {given[0]} "
            f"was lost {LOSSES} times when it was sent alone, the last time with "
            f"{said(_error_of(sent.future))}. A run that fails raises an exception and does not "
            "end its process; a function for other processes stands at the top level of a module "
            "that they can import."
        )

    def _brought(self, sent: Sent) -> list[Call] | None:
        """The finished runs, None for lost ones. Raises InputError."""
        error = _error_of(sent.future)
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
        """The call on its way; an executor that takes none is told by the future."""
        executor = self._current()
        try:
            future = executor.submit(*call)
        except Exception as error:  # broken, shut down, or what it cannot pickle
            future = Future()
            future.set_exception(error)
        return Sent(future, executor)

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
                    "Give a function that makes one, so that another can take its place; finished "
                    "chunks are kept where a path was given."
                )
            self._executor = None
        executor.shutdown(wait=False)


def _error_of(future: Future) -> BaseException | None:
    return CancelledError() if future.cancelled() else future.exception()
