"""Episodes in worker processes, one at a time in each, so that an episode which ends its process is
identified. Imports NumPy alone: workers start at once.
"""

import functools
import json
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from parc_jax.common.errors import InputError, is_text
from parc_jax.common.said import most_and_often
from parc_jax.learning.systems.content import whole_digest
from parc_jax.learning.systems.fleet import Processes
from parc_jax.learning.systems.user_code import own_place, said

if TYPE_CHECKING:
    from parc_jax.drive.loop.commitment import Commitment


class Outcome(NamedTuple):
    """The result of an episode. touched: anything, ever; of moving obstacles, before the rest of
    the manoeuvre under way, since they may run into a robot that rests [T38]. left: a tube was left
    by the executed part of its manoeuvre (`left_tube`); None where that was not tested; where none
    was, why it counts as bad all the same, such as "odometry drifted too far". told: plain values
    stored with it. committed: manoeuvres that loops committed to and the robot drove, in any order;
    of them alone (C) is said. touched_at: [s] of the loops' clock, the first time; None if unknown.
    """

    touched: bool
    left: bool | str | None = None
    told: Mapping[str, Any] = {}
    committed: "Sequence[Commitment]" = ()
    touched_at: float | None = None


class Driven(NamedTuple):
    """One stored episode. number: from 0. failed: why it has no outcome, else empty. loops: those
    that committed to its manoeuvres, by content. told_for: [s] from a manoeuvre's begin, the least
    for which what moves was told of; None where until the end of each, 0 where that is unknown.
    told_then: whether what moves was told of at the first contact. rests_on, told_in: as of
    `most_and_often`. manoeuvres: each by content. drifted: [m] all that loops were told of. before:
    its earlier begins, of which none came to an end; None without a folder.
    """

    number: int
    touched: bool | None
    left: bool | str | None
    failed: str
    told: dict
    loops: list[str]
    told_for: float | None = 0.0
    told_then: bool = False
    rests_on: Mapping[str, int] = {}
    told_in: Mapping[str, int] = {}
    manoeuvres: Sequence[str] = []
    drifted: float = 0.0
    before: int | None = None

    @property
    def bad(self) -> bool:
        """Whether it counts against the claim: only a positive finding makes an episode good."""
        return bool(self.failed) or self.touched is not False or bool(self.left)

    def differs(self, other: "Driven") -> set[str]:
        """Names of what another drive of this episode told otherwise."""
        if self.failed or other.failed:  # a process may die of others
            return {"failed"} if not (self.failed and other.failed) else set()
        none = dict.fromkeys(("number", "told", "before"))
        one, two = ({**x.told, **x._asdict(), **none} for x in (self, other))
        return {x for x in one.keys() | two.keys() if repr(one.get(x)) != repr(two.get(x))}


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
            raise InputError(f"episodes: expected an Outcome of drive(world, seed); got {kind}.")
        touched, left, told, committed, at = outcome
        kind = bool | np.bool_
        words = isinstance(left, str) and left.strip() and is_text(left)
        if not isinstance(touched, kind) or not (words or isinstance(left, kind | None)):
            raise InputError(
                f"Outcome: expected touched True or False, and left too, None or a text; got "
                f"{touched!r:.40} and {left!r:.40}."
            )
        number = isinstance(at, int | float | np.number) and not isinstance(at, bool)
        if at is not None and not (touched and number and np.isfinite(at)):
            raise InputError(
                f"Outcome: expected touched_at of what was touched, a finite time; got {at!r:.40}, "
                f"touched {touched!r}."
            )
        told = json.loads(json.dumps(dict(told), default=_of_numpy))
        committed = sorted(dict.fromkeys(committed), key=lambda one: one.begin)
        for one in committed:  # the last that began may not have been driven
            given = {x.begin for x in committed if x.episode is one.episode}
            if not given.issuperset((begun := one.episode.begins)[:-1]):
                of = f"{len(given)} of {len(begun)} that its loop committed to"
                raise InputError(f"Outcome: expected all that the robot drove; got {of}.")
        # a pose that a loop saw outside of its tube was there, or is outside of its uncertainty
        seen = any(one.episode.outside or one.others_left for one in committed)
        left = seen or (left if isinstance(left, str | None) else bool(left))
        loops = sorted({one.loop for one in committed})
        short = (float(x.told_until - x.begin) for x in committed if x.told_until < x.end)
        at = -np.inf if at is None else float(at)
        under_way = {id(x.episode): x for x in committed if x.begin <= at}  # one of each robot
        last = max((x.begin for x in under_way.values()), default=0)
        # a robot that has begun anew since has another one under way
        under_way = {i: x for i, x in under_way.items() if x.episode or x.end > last}
        told_then = bool(under_way) and all(at < x.told_until for x in under_way.values())
        told_of = (one.asked.problem.rests_on for one in committed)
        rests = most_and_often((x, dict.fromkeys(x, 1)) for x in told_of)
        drifted = sum({id(one.episode): one.drifted for one in committed}.values(), 0.0)
        asked = ([repr(one), one.asked.pose, one.asked.problem] for one in committed)
        begun = sorted(map(whole_digest, asked))  # of several robots, in any order
        found = loops, min(short, default=None), told_then, *map(dict, rests), begun, drifted
        return Driven(task.number, bool(touched), left, "", told, *found)
    except (Exception, SystemExit) as error:
        where = f"in {place}: " if (place := own_place(error)) else ""
        return failed(task.number, where + said(error))


def failed(number: int, why: str) -> Driven:
    """An episode without an outcome."""
    return Driven(number, None, None, why, {}, [])


def _of_numpy(value: object):
    """NumPy's numbers and arrays as JSON has them."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise InputError(f"Outcome: expected told of plain values; got {type(value).__name__}.")


@functools.cache
def _unpickled(pickled: bytes) -> tuple[Callable, Callable]:
    return pickle.loads(pickled)


def run_pickled(pickled: bytes, task: Task | None) -> Driven | None:
    """`run_one` in a worker process, of drive and law as they were pickled; None to begin alone."""
    drive, law = _unpickled(pickled)
    return None if task is None else run_one(drive, law, task)


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
    waiting, processes, at_work = iter(tasks), Processes(workers), {}
    try:
        for begun in [processes.submit(run_pickled, pickled, None) for _ in range(workers)]:
            if (error := begun.exception()) is not None:  # before the first episode, so of none
                raise InputError(
                    f"episodes: expected worker processes to start; {said(error)}. Guard the "
                    'script\'s own start with `if __name__ == "__main__":`, or pass workers=0.'
                )
        while True:
            for task in islice(waiting, workers - len(at_work)):  # none is taken before it begins
                at_work[processes.submit(run_pickled, pickled, task)] = task
            if not at_work:
                return
            for done in wait(at_work, return_when=FIRST_COMPLETED).done:
                task, error = at_work.pop(done), done.exception()
                # an episode that ends its process has failed; another process takes its place
                yield done.result() if error is None else failed(task.number, said(error))
    finally:
        processes.kill()
