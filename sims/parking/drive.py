"""A case driven: a way is searched for, each of its manoeuvres is proved from the pose that the one
before led to, at rest or while the car rolls, the last one into the goal, and driven by the black
box.
"""

import time
from dataclasses import dataclass, field
from functools import cache

import jax
import numpy as np
import shapely

import parc_jax as pj
from parc_jax.common.keys import as_key, generator
from parc_jax.common.spelling import counted
from sims.parking import car as c
from sims.parking.cases import GOAL, Case
from sims.parking.guide import BUDGET, DRAWS, Guide
from sims.parking.kinematics import compose, offset_from
from sims.parking.known import Learned
from sims.parking.prove import Moving, goal_of, link, loop_with, shuffle
from sims.parking.rehearse import rehearsed
from sims.parking.slot import STROKES, Slot, wrong
from sims.parking.way import Tried, Way

LINKS = 80  # manoeuvres of a case
# the end of a way is shuffled when it has so many manoeuvres, of which none is longer [m]
SHUFFLED, STROKE = 6, 0.3
IN_THE_SLOT = 2.0  # [m] beside the goal, as of `wrong`: nearer, strokes are what is tried last
# of the width of its tube a manoeuvre of a first way is clear, and of others when one fails
CLEAR = (1.0, 0.6, 0.3)
BETWEEN = 4  # poses of the judge from record to record


@dataclass(frozen=True)
class Parked:
    """What came of a case. reached: the car rests in the goal. proved: so the last manoeuvre says.
    why: where it ended before. clearance: [m] least distance to an obstacle, not positive where one
    was touched. gears: changes of gear. rolled: manoeuvres begun while the car rolls. seconds:
    driven, turning the wheels included. off (3,): [m] along and across, [rad] from the goal.
    planned: [s] of processor time of all planning. thought: [s] the most of it for a manoeuvre that
    begins while the car rolls. left: was a tube left? commitments: what was proved. path (n, 3),
    times (n,): true poses at all records, and their moments [s].
    """

    reached: bool
    proved: bool
    why: str
    clearance: float
    gears: int
    rolled: int
    seconds: float
    off: np.ndarray
    planned: float
    thought: float
    left: bool
    commitments: list = field(repr=False)
    path: np.ndarray = field(repr=False)
    times: np.ndarray = field(repr=False)

    @property
    def touched(self) -> bool:
        """Was an obstacle touched?"""
        return not self.clearance > 0


@cache
def black_box():
    """The states of a run of the car, compiled once for all cases."""
    return jax.jit(c.system().states)


def drive(case: Case, loop: pj.drive.Loop, key, within=GOAL) -> Parked:
    """Park. key: of the black box and of the measured poses. within: [m] along and across, [rad],
    how far from the goal the car may rest.
    """
    begin = time.process_time()
    one = Drive(case, loop, key, within)
    while len(one.driven) < LINKS and not (one.proved or one.stuck):
        seen = one.seen()
        if one.leads_on(seen.pose):
            one.go_on(seen)
    return one.parked(begin)


class Drive:
    """A drive under way. now: where the car is; at: on the loop's clock; way: what it follows, i:
    the manoeuvre that is next; driven: what was proved, and so driven; proved: is it in the goal?
    stuck: does nothing lead on?
    """

    def __init__(self, case: Case, loop: pj.drive.Loop, key, within):
        self.case, self.loop, self.within, self.key = case, loop, within, as_key(key)
        self._draws = generator(jax.random.fold_in(self.key, 0))
        loop.restart()
        self._around, self._spare = case.pieces, loop_with(loop.model, loop.uncertainty)
        self._guide = Guide(case, Learned(case, loop.model, within, loop.uncertainty))
        self._slot = Slot(case, loop.model, within, loop.uncertainty)
        self._shares, self._best = iter(CLEAR), IN_THE_SLOT
        self.now, self.at = Moving(case.start), 0.0
        self.way: Way | None = None
        self.i, self.driven, self.why, self.thought = 0, [], "", 0.0
        self.proved, self.stuck = False, False
        self._path, self._times = [case.start[None]], [np.zeros(1)]

    def seen(self) -> Moving:
        """Where the car is as far as it is known: all that a driver has."""
        pose = measured(self.now.pose, self.loop.uncertainty, self._draws)
        return self.now._replace(pose=pose)

    def leads_on(self, known: np.ndarray) -> bool:
        """Does a way, or may strokes, lead on from a pose (3,)? If not, the next share may."""
        if self.way is not None and self.i < len(self.way.k):
            return True
        if self.way is None and self._slot.found:  # strokes that are under way
            return True
        self.way, self.i, share = None, 0, next(self._shares, None)
        if share is not None:
            self._guide.space.share = share
            draws = DRAWS[: 1 if self.driven else None]  # a car on its way waits for one
            self.way = self._guide.search(known, self.now.wheels, self._rehearsed, draws)
            if self.way is None:
                followed = BUDGET - self._guide.budget
                self.why = f"no way was found within {followed:,} of {BUDGET:,} poses"
            return self.way is not None
        beside = wrong(self.case, known)
        nearer = beside < self._best  # than where that was the last resort before
        self._best = beside
        self.stuck = not nearer and (beside > IN_THE_SLOT or self._slot.after(known) is None)
        return not self.stuck

    def go_on(self, seen: Moving) -> None:
        """Prove the next manoeuvre, and drive it, or come to rest where none is proved."""
        rest = np.empty((0, 3)) if self.way is None else self.way.k[self.i :]
        short = len(rest) >= SHUFFLED and (np.abs(rest[:, 0]) <= STROKE).all()
        shuffles, last = self.way is None or (short and not seen.speed), len(rest) == 1
        goal = goal_of(self.case, seen.pose, self.within) if last or shuffles else None
        if not shuffles:
            begin = time.process_time()
            step = link(self.loop, self._around, seen, self.way, self.i, goal, self.at)
            if seen.speed:
                self.thought = max(self.thought, time.process_time() - begin)
            # a short stroke corrects little; strokes to and fro bring it there
            shuffles = last and not (step.new or seen.speed)
            shuffles = shuffles and abs(rest[0, 0]) <= c.way_of(STROKES[-1])
        if shuffles:
            gear = -np.sign(self.driven[-1].k[2]) if self.driven else 1.0
            where = self._slot, self.case, self.within, goal, self.at
            step, last = shuffle(self.loop, self._around, seen, gear, *where)
        if step.new:
            self.driven.append(step.committed)
            self._run(step.committed.k, not shuffles and bool(self.way.rolls_on[self.i]))
            self.i, self.why, self._shares = self.i + (not shuffles), "", iter(CLEAR)
            self.proved = last
        elif self.way is None:
            self.stuck = True
        else:
            self.why, self.way = step.reason, None
            self._stop()

    def _rehearsed(self, known: Tried, pose: np.ndarray, wheels: float) -> Tried:
        where = self.case, self.within, known, Moving(pose, wheels)
        return rehearsed(self._spare, self._around, *where)

    def _run(self, k, rolls_on: bool) -> None:
        """The black box drives k, to where the car rolls on or rests."""
        key = jax.random.fold_in(self.key, len(self.driven))
        states = np.asarray(black_box()(key, k, push=self.now.push), float)
        poses = compose(self.now.pose, states[:, :3])
        moments = float(self._times[-1][-1]) + c.moments(k)
        # with a push that no run of the law begins with it does not roll on, but comes to its stop
        usual = abs(states[c.ROLLS_ON * c.EVERY, 5] - c.PUSH) <= c.Law().pushes
        rolls_on = rolls_on and usual
        n = (c.ROLLS_ON if rolls_on else c.SHARES + 2) * c.EVERY
        self._path.append(poses[1 : n + 1])
        self._times.append(moments[1 : n + 1])
        self.now = Moving(poses[n], float(np.clip(states[n, 4], -c.TURN, c.TURN)))
        if rolls_on:
            stop = poses[n + 1 :], moments[n + 1 :], float(states[-1, 4])
            speed, push = float(states[n, 3]), float(states[n, 5])
            self.now = self.now._replace(speed=speed, push=push, stop=stop)
        self.at += n / c.EVERY

    def _stop(self) -> None:
        """A car that rolls drives the rest of the manoeuvre under way, to its stop."""
        if not self.now.speed:
            return
        poses, moments, wheels = self.now.stop
        self._path.append(poses)
        self._times.append(moments)
        self.now = Moving(poses[-1], wheels)
        self.at += self.loop.model.time.t_f - c.ROLLS_ON

    def parked(self, begin: float) -> Parked:
        """What came of it. begin: [s] of processor time when it began."""
        path, times = np.concatenate(self._path), np.concatenate(self._times)
        off = offset_from(self.case.goal, self.now.pose)
        ways = np.array([one.k[2] for one in self.driven])
        begins = np.array([float(one.begin) for one in self.driven])
        points = c.corners(*path.T)
        late = "" if self.proved else f"not in the goal after {counted(LINKS, 'manoeuvre')}"
        return Parked(
            reached=bool((np.abs(off) <= [self.within[0], *self.within]).all()),
            proved=self.proved,
            why=self.why or late,
            clearance=judged(self.case, path),
            gears=int((np.diff(np.sign(ways)) != 0).sum()),
            rolled=int((np.diff(begins) == c.ROLLS_ON).sum()),
            seconds=float(times[-1]),
            off=off,
            planned=time.process_time() - begin,
            thought=self.thought,
            left=bool(self.driven) and pj.drive.left_tube(self.driven, points, path[:, 2]),
            commitments=self.driven,
            path=path,
            times=times,
        )


def measured(pose: np.ndarray, uncertainty, draws) -> np.ndarray:
    """A pose as it is known, off by what is declared."""
    most = [*uncertainty.shifts(2), float(uncertainty.heading or 0.0)]
    return pose + np.array(most) * draws.uniform(-1, 1, 3)


def judged(case: Case, path: np.ndarray) -> float:
    """[m] least distance of the car along poses (n, 3) to the outlines; 0 where it touches one."""
    share = np.arange(BETWEEN) / BETWEEN
    between = path[:-1, None] + share[:, None] * np.diff(path, axis=0)[:, None]
    poses = np.concatenate([between.reshape(-1, 3), path[-1:]])
    bodies = shapely.polygons(c.corners(*poses.T)[:, 1:])
    found = [float(shapely.distance(bodies, shape).min()) for shape in case.shapes]
    return min(found, default=float("inf"))
