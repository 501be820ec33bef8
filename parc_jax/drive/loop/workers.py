"""Episodes in worker processes, one at a time in each, so that an episode which ends its process is
identified. Imports NumPy alone: workers start at once.
"""

import json
import multiprocessing
import pickle
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.systems.user_code import own_place, said

READY = "ready"


class Outcome(NamedTuple):
    """The result of an episode. touched: anything, ever; of moving obstacles, before the rest of
    the manoeuvre under way, since they may run into a robot that rests [T38]. left: a tube was left
    by the executed part of its manoeuvre (`left_tube`); None where that was not tested. told: plain
    values that are stored with it.
    """

    touched: bool
    left: bool | None = None
    told: Mapping[str, Any] = {}


class Driven(NamedTuple):
    """One stored episode. number: from 0. failed: why it has no outcome, else empty."""

    number: int
    touched: bool | None
    left: bool | None
    failed: str
    told: dict

    @property
    def bad(self) -> bool:
        """Whether it counts against the claim: only a positive finding makes an episode good."""
        return bool(self.failed) or self.touched is not False or self.left is True


class Task(NamedTuple):
    """An episode to drive. seeds: two words each, for its world and for its drive."""

    number: int
    of_world: np.ndarray
    of_drive: np.ndarray


def run_one(drive: Callable, law: Callable, task: Task) -> Driven:
    """drive(law(seed), seed); any exception in it, or another result, is a failed episode."""
    try:
        outcome = drive(law(task.of_world), task.of_drive)
        if not isinstance(outcome, Outcome):
            kind = type(outcome).__name__
            raise InputError(
                f"episodes: expected drive(world, seed) to return an Outcome; got {kind}."
            )
        touched, left, told = outcome
        kind = bool | np.bool_
        if not isinstance(touched, kind) or not isinstance(left, kind | None):
            raise InputError(
                f"Outcome: expected touched True or False, and left too or None; got "
                f"{touched!r:.40} and {left!r:.40}."
            )
        told = json.loads(json.dumps(dict(told), default=_of_numpy))
        return Driven(task.number, bool(touched), None if left is None else bool(left), "", told)
    except Exception as error:
        place = own_place(error)
        where = f"in {place}: " if place else ""
        return failed(task.number, where + said(error))


def failed(number: int, why: str) -> Driven:
    """An episode without an outcome."""
    return Driven(number, None, None, why, {})


def _of_numpy(value: object):
    """NumPy's numbers and arrays as JSON has them."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise InputError(f"Outcome: expected told of plain values; got {type(value).__name__}.")


def serve(parent: Connection, pickled: bytes) -> None:
    """Run in a worker process: receive tasks and send episodes by the connection `parent`, one at a
    time, until it is closed.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's, which ends its workers
    try:
        drive, law = pickle.loads(pickled)
    except Exception as error:
        parent.send(said(error))
        return
    try:
        parent.send(READY)
        while True:
            parent.send(run_one(drive, law, parent.recv()))
    except (EOFError, OSError):  # the parent is gone
        return


def driven(drive: Callable, law: Callable, tasks: Iterable[Task], workers: int) -> Iterator[Driven]:
    """The episodes of tasks, in the order in which they end. workers: 0 for none, all in this
    process. Raises InputError where one cannot be sent to workers.
    """
    if not workers:
        yield from (run_one(drive, law, task) for task in tasks)
        return
    try:
        pickled = pickle.dumps((drive, law))
    except Exception as error:  # hooks of an object may raise anything
        raise InputError(
            "episodes: expected a drive and a law that can be sent to worker processes; "
            f"{error}. Define them at the top level of a module, or pass workers=0."
        ) from None
    crew = _Crew(pickled, deque(tasks))
    with closing(crew):
        for _ in range(min(workers, len(crew.waiting))):
            crew.begin()
        while crew.at_work:
            yield from crew.some()


class _Crew:
    """Processes and their tasks. waiting: tasks that are not begun."""

    def __init__(self, pickled: bytes, waiting: deque[Task]):
        self.pickled, self.waiting = pickled, waiting
        self.at_work: dict[Connection, tuple] = {}  # connection: process and its task, if any
        # fresh processes: a fork of one that runs JAX may hang
        self._context = multiprocessing.get_context("spawn")

    def begin(self) -> None:
        """One process more."""
        here, there = self._context.Pipe()
        process = self._context.Process(target=serve, args=(there, self.pickled), daemon=True)
        process.start()
        there.close()  # so that its end is seen here
        self.at_work[here] = process, None

    def some(self) -> Iterator[Driven]:
        """Episodes that ended by now; waits for one at least, or for a process that is ready."""
        for here in wait(list(self.at_work)):
            process, task = self.at_work[here]
            try:
                message = here.recv()
            except (EOFError, OSError):
                yield self._lost(here, process, task)
                continue
            if isinstance(message, Driven):
                yield message
            elif message != READY:
                raise InputError(f"episodes: expected to be sent to a worker process; {message}.")
            if self.waiting:
                self.at_work[here] = process, self.waiting.popleft()
                here.send(self.at_work[here][1])
            else:
                del self.at_work[here]
                here.close()

    def _lost(self, here: Connection, process: BaseProcess, task: Task | None) -> Driven:
        """An episode that ended its process; another process takes its place."""
        del self.at_work[here]
        here.close()
        process.join()
        if task is None:
            raise InputError(
                "episodes: expected worker processes to start; one ended before its first episode. "
                'Guard the script\'s own start with `if __name__ == "__main__":`, or pass '
                "workers=0."
            )
        if self.waiting:
            self.begin()
        return failed(task.number, f"its process ended with exit code {process.exitcode}")

    def close(self) -> None:
        for here, (process, _) in self.at_work.items():
            process.kill()
            process.join()
            here.close()
