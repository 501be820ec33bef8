"""One episode of many, and the worker process in which it is driven. Imports NumPy alone, so that
workers start at once.
"""

import json
import pickle
import signal
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.systems.user_code import own_place, said

READY = "ready"


class Outcome(NamedTuple):
    """What came of an episode. touched: anything, ever; of what moves, before the rest of the
    manoeuvre under way, since it may run into a robot that rests [T38]. left: was a tube left by
    what was driven of its manoeuvre (`left_tube`); None where nobody looked. told: plain values
    that are kept with it.
    """

    touched: bool
    left: bool | None = None
    told: Mapping[str, Any] = {}


class Driven(NamedTuple):
    """One episode as it is kept. number: from 0. failed: why it came to no outcome, else empty."""

    number: int
    touched: bool | None
    left: bool | None
    failed: str
    told: dict

    @property
    def bad(self) -> bool:
        """It counts against the claim: what is not known to be good is bad."""
        return bool(self.failed) or self.touched is not False or self.left is True


class Task(NamedTuple):
    """An episode to drive. seeds: two words each, for its world and for its drive."""

    number: int
    of_world: np.ndarray
    of_drive: np.ndarray


def run_one(drive: Callable, law: Callable, task: Task) -> Driven:
    """drive(law(seed), seed); whatever goes wrong in it is a failed episode."""
    try:
        outcome = drive(law(task.of_world), task.of_drive)
        return _kept(task.number, outcome)
    except Exception as error:
        place = own_place(error)
        where = f"in {place}: " if place else ""
        return failed(task.number, where + said(error))


def failed(number: int, why: str) -> Driven:
    """An episode without an outcome."""
    return Driven(number, None, None, why, {})


def _kept(number: int, outcome: object) -> Driven:
    """Raises InputError for what is no outcome."""
    if not isinstance(outcome, Outcome):
        kind = type(outcome).__name__
        raise InputError(f"episodes: expected drive(world, seed) to return an Outcome; got {kind}.")
    touched, left, told = outcome
    if not _is_bool(touched) or not (left is None or _is_bool(left)):
        raise InputError(
            f"Outcome: expected touched True or False, and left too or None; got {touched!r:.40} "
            f"and {left!r:.40}."
        )
    told = json.loads(json.dumps(dict(told), default=_of_numpy))
    return Driven(number, bool(touched), None if left is None else bool(left), "", told)


def _is_bool(value: object) -> bool:
    return isinstance(value, bool | np.bool_)


def _of_numpy(value: object):
    """NumPy's numbers and arrays as JSON has them."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise InputError(f"Outcome: expected told of plain values; got {type(value).__name__}.")


def serve(asked: Connection, pickled: bytes) -> None:
    """A worker process: tasks come in and episodes go out by the connection `asked`, one at a time,
    until it is closed.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's, who ends its workers
    try:
        drive, law = pickle.loads(pickled)
    except Exception as error:
        asked.send(said(error))
        return
    try:
        asked.send(READY)
        while True:
            asked.send(run_one(drive, law, asked.recv()))
    except (EOFError, OSError):  # the parent is gone
        return
