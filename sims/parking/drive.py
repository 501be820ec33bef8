"""A case driven: a way is searched for, each of its manoeuvres is proved from the pose that the one
before led to, at rest or while the car rolls, the last one into the goal, and driven by the black
box.
"""

import time
from dataclasses import dataclass, field
from functools import cache
from itertools import product
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np
import shapely

import parc_jax as pj
from parc_jax.common.keys import as_key, generator
from parc_jax.drive.loop.candidates import listed_candidates
from parc_jax.learning.network.predict import trajectories
from sims.parking import car as c
from sims.parking.cases import NEAR, Case
from sims.parking.guide import BUDGET, Guide
from sims.parking.kinematics import (
    LONGEST,
    MOST,
    compose,
    ends,
    offset_from,
    reach_exactly,
    rolls,
    standing,
    steering,
)
from sims.rectangle import rectangle

MODEL = Path(__file__).with_name("model.npz")
NEAREST = 0.01  # [m] from its target that a manoeuvre may end
GOAL = (0.1, np.radians(2.0))  # [m] along and across, [rad]: how far from the goal is in it
AROUND, SPREAD = 384, (0.12, 0.12, 0.12)  # candidates around the way's own, and their spread
WIDER = 3.0  # times as wide spread where no manoeuvre leads there exactly
PER_RADIAN = 2.5  # [m] that a wrong heading counts as
ROOMY = 0.9  # share of the goal that the tube of the last manoeuvre may take
STEERED = 0.75  # share of the steering that it may ask for: what is left corrects where it begins
LINKS = 80  # manoeuvres of a case
# [m, m, rad] beside where it should lead that a manoeuvre of a way may, if more follow
MISSES = np.array([0.06, 0.06, 0.03])
NO_LESS = 0.21  # [m] that a manoeuvre goes on beyond where a car that rolls could stop
LITTLE = 0.02  # share of its wheels' turn, at least, for which a car at rest stands
# the end of a way is shuffled when it has so many manoeuvres, of which none is longer [m]
SHUFFLED, STROKE = 6, 0.3
# ways, as k has them, and shares of the steering of strokes to shuffle by: AROUND of them
STROKES, LOCKS = np.linspace(0.05, 0.36, 24), np.array([-1.0, -0.8, 0.8, 1.0])
STRAIGHT = np.radians(0.4)  # of heading that is not turned back while the car moves sideways
IN_THE_SLOT = 2.0  # [m] beside the goal, as of `wrong`: nearer, strokes are what is tried last
# of the width of its tube a manoeuvre of a first way is clear, and of others when one fails
CLEAR = (1.0, 0.6, 0.3)
BETWEEN = 4  # poses of the judge from record to record
LEFT = c.LEAVE + 1  # intervals, that of the standing car included, after which a car may roll on


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


class Moving(NamedTuple):
    """Where and how the car goes on. pose (3,); wheels: [rad] of its steering; speed [m/s] and push
    [m/s^2] of the motor, 0 at rest; stop: poses and moments of the rest of what is under way, and
    the steering there.
    """

    pose: np.ndarray
    wheels: float = 0.0
    speed: float = 0.0
    push: float = 0.0
    stop: tuple[np.ndarray, np.ndarray, float] | None = None


def model() -> pj.types.TrajectoryModel:
    """The model that comes along; `python -m sims.parking.learn` made it."""
    return pj.load(MODEL, system="parking")


@cache
def loop_of(path: Path = MODEL, start: float = 0.0, heading: float = 0.0) -> pj.drive.Loop:
    """The loop of a model, made once. start, heading: [m], [rad] by which poses may be wrong."""
    known = pj.load(path, system="parking")
    return loop_with(known, pj.Uncertainty(start=start, heading=heading))


def loop_with(model, uncertainty: pj.Uncertainty) -> pj.drive.Loop:
    """A loop of a model and poses that are wrong by so much."""
    return pj.drive.Loop(
        model,
        rectangle(),
        leave=float(LEFT),
        uncertainty=uncertainty,
        candidates=np.zeros((1, 3)),
        effort=pj.drive.Effort(judged=AROUND, looks=1 << 14, room=0.02, deadline=1e4),
    )


@cache
def black_box():
    """The states of a run of the car, compiled once for all cases."""
    return jax.jit(c.system().states)


def goal_of(case: Case, pose: np.ndarray, within=GOAL) -> pj.types.HPolytope:
    """The goal of a case in the world, over all points and the heading, seen from a pose (3,)."""
    cos, sin = np.cos(case.goal[2]), np.sin(case.goal[2])
    rows = np.array([[cos, sin], [-sin, cos]])
    rows = np.concatenate([rows, -rows])
    place = pj.hpolytope(rows, rows @ case.goal[:2] + within[0])
    here = np.arctan2(np.sin(pose[2]), np.cos(pose[2]))
    turned = here + offset_from(pose, case.goal)[2]
    heading = pj.box([turned - within[1]], [turned + within[1]])
    return pj.problem.goal_of_points(c.POINTS, {c.POINTS[0]: place}, heading)


def guide_of(
    case: Case,
    model,
    within=GOAL,
    shift: float = 0.0,
    heading: float = 0.0,
    rolling: bool = True,
) -> Guide:
    """The guide of a model in a case. within, shift, heading: as of `ends_surely`; rolling: as of
    Guide. Raises InputError where the goal is out of reach.
    """
    # a goal that is wider than GOAL leaves a choice of where in it to end
    spare = np.maximum(np.subtract(within, GOAL), 0.0)[[0, 0, 1]]
    offsets = np.unique(spare * list(product((0, -1, 1), repeat=3)), axis=0)
    guide = Guide(
        case,
        width=lambda k, begins=0.0: tube_of(model, k, begins)[0],
        sure=lambda k, aim, begins=0.0: ends_surely(
            model, k, within, offset_from(case.goal, aim), shift, heading, begins
        ),
        aims=compose(case.goal, offsets),
        rolling=rolling,
        mend=lambda way, pose, wheels: mended(
            way, Moving(pose, wheels), model, lambda *at: aimed(model, guide, *at)
        ),
    )
    guide.require_reach()
    return guide


def drive(case: Case, loop: pj.drive.Loop, key, within=GOAL) -> Parked:
    """Park. key: of the black box and of the measured poses. within: [m] along and across, [rad],
    how far from the goal the car may rest.
    """
    begin = time.process_time()
    run = black_box()
    draws, loop_key = generator(jax.random.fold_in(as_key(key), 0)), as_key(key)
    loop.restart()
    around, spare = pieces_of(case), loop_with(loop.model, loop.uncertainty)
    now, at = Moving(case.start), 0.0
    new, path, times = [], [now.pose[None]], [np.zeros(1)]
    driven, why, way, i = 0.0, "", None, 0
    proved, best, thought = False, IN_THE_SLOT, 0.0
    shares = iter(CLEAR)
    shift = float(np.linalg.norm(loop.uncertainty.shifts(2)))
    heading = float(loop.uncertainty.heading or 0.0)
    guide = guide_of(case, loop.model, within, shift, heading)

    def tried(way, pose, wheels):
        return rehearsed(spare, around, case, within, way, Moving(pose, wheels))

    while len(new) < LINKS:
        known = measured(now.pose, loop.uncertainty, draws)  # all that a driver has
        if way is None or i == len(way.k):
            share = next(shares, None)
            if share is not None:
                guide.share = share
                way, i = guide.search(known, now.wheels, tried), 0
                if way is None:
                    why = f"no way was found within {BUDGET - guide.left:,} of {BUDGET:,} poses"
                    continue
            elif wrong(case, known) < best:  # nearer than where that was the last resort before
                way, i, best = None, 0, wrong(case, known)
            else:
                break
        left = () if way is None else way.k[i:]
        short = len(left) >= SHUFFLED and (np.abs(left[:, 0]) <= STROKE).all()
        shuffles = way is None or (short and not now.speed)
        last = len(left) == 1
        goal = goal_of(case, known, within) if last or shuffles else None
        gear = -np.sign(new[-1].k[2]) if new else 1.0
        seen = now._replace(pose=known)
        if shuffles:
            step, last = shuffle(loop, around, seen, gear, case, within, goal, at)
        else:
            asked = time.process_time()
            step = link(loop, around, seen, way, i, goal, at)
            if now.speed:
                thought = max(thought, time.process_time() - asked)
            if (
                last
                and not now.speed
                and not step.new
                and abs(way.k[i, 0]) <= c.way_of(STROKES[-1])
            ):
                # a short stroke corrects little; strokes to and fro bring it there
                step, last = shuffle(loop, around, seen, gear, case, within, goal, at)
                shuffles = True
        if not step.new:
            if way is None:
                break
            why, way = step.reason, None
            if now.speed:  # the rest of the manoeuvre under way, to its stop
                path.append(now.stop[0])
                times.append(now.stop[1])
                now, driven = Moving(path[-1][-1], now.stop[2]), float(times[-1][-1])
                at += loop.model.time.t_f - LEFT
            continue
        k = step.committed.k
        new.append(step.committed)
        states = np.asarray(run(jax.random.fold_in(loop_key, len(new)), k, push=now.push), float)
        poses, moments = compose(now.pose, states[:, :3]), driven + c.moments(k)
        # with a push that no run of the law begins with it is not left, but goes on to its stop
        usual = abs(states[LEFT * c.EVERY, 5] - c.PUSH) <= c.Law().pushes
        rolls = not shuffles and bool(way.left[i]) and usual
        n = (LEFT if rolls else c.SHARES + 2) * c.EVERY
        path.append(poses[1 : n + 1])
        times.append(moments[1 : n + 1])
        wheels = float(np.clip(states[n, 4], -c.TURN, c.TURN))
        now = Moving(poses[n], wheels)
        if rolls:
            stop = poses[n + 1 :], moments[n + 1 :], float(states[-1, 4])
            now = now._replace(speed=float(states[n, 3]), push=float(states[n, 5]), stop=stop)
        driven, at = float(moments[n]), at + n / c.EVERY
        i, why, shares = i + (not shuffles), "", iter(CLEAR)
        if last:
            proved = True
            break
    path, times = np.concatenate(path), np.concatenate(times)
    off = offset_from(case.goal, now.pose)
    ways = np.array([one.k[2] for one in new])
    points = c.corners(*path.T)
    return Parked(
        reached=bool((np.abs(off) <= [within[0], *within]).all()),
        proved=proved,
        why=why or ("" if proved else f"not in the goal after {LINKS} manoeuvres"),
        clearance=judged(case, path),
        gears=int((np.diff(np.sign(ways)) != 0).sum()) if len(ways) else 0,
        rolled=int((np.diff(np.array([float(one.begin) for one in new])) == LEFT).sum()),
        seconds=driven,
        off=off,
        planned=time.process_time() - begin,
        thought=thought,
        left=bool(new) and pj.drive.left_tube(new, points, path[:, 2]),
        commitments=new,
        path=path,
        times=times,
    )


def pieces_of(case: Case) -> list:
    """Convex pieces that cover the outlines of a case, each with the outline that it is of."""
    return [
        (piece, shape)
        for one, shape in zip(case.outlines, case.shapes, strict=True)
        for piece in pj.problem.convex_pieces(one)
    ]


def link(loop, around, now: Moving, way, i: int, goal, at):
    """One step of the loop: the manoeuvre number i of a way, from where the car is to where that
    leads, and into a goal if that is not None.
    """
    k, target = np.asarray(way.k[i : i + 1], float), way.poses[i + 1]
    aim = offset_from(now.pose, target)
    least = (c.stopping(now.speed) + NO_LESS) * bool(now.speed)
    draw = np.random.default_rng(0).normal(size=(AROUND - 1, 3)) * SPREAD
    draw *= np.random.default_rng(1).uniform(0, 1, (AROUND - 1, 1)) ** 2
    most = np.array([LONGEST, MOST, MOST])
    starts = starts_for(k, now)
    for start in starts:
        predict = predicted(loop.model, now.wheels, start, bool(way.left[i]))
        exact, there = reach_exactly(aim[None], k, predict)
        if not there[0] and start != starts[-1]:
            continue
        # a target that none leads to exactly may be reached nearly by what was planned, or far off
        near = np.concatenate([exact, (exact + draw if there[0] else k + WIDER * draw)])
        near = np.clip(near, -most, most)
        near[:, 0] = np.sign(k[0, 0]) * np.maximum(np.abs(near[:, 0]), least)

        def prefer(seen, predict=predict) -> np.ndarray:
            end = compose(now.pose, predict(told(seen.k))[:, -1])
            off = np.linalg.norm(end[:, :2] - target[:2], axis=1)
            turned = (end[:, 2] - target[2] + np.pi) % (2 * np.pi) - np.pi
            return np.maximum(off - NEAREST, 0.0) + PER_RADIAN * np.abs(turned)

        step = choose(loop, around, now, start, near, prefer, goal, at)
        if step.new:
            break
    return step


def starts_for(k: np.ndarray, now: Moving) -> list[float]:
    """What k may have as the start of a manoeuvre like k (1, 3), the quickest first."""
    if now.speed:
        return [float(c.start_of(now.speed))]
    share = standing(steering(k)[0][0] - now.wheels, k[0, 0])
    shares = (max(share, LITTLE), 0.5 * (1.0 + share), 1.0)
    return list(dict.fromkeys(float(c.starts_at(one)) for one in shares))


def shuffle(loop, around, now: Moving, gear, case, within, goal, at):
    """One step of the loop to and fro in a slot: into the goal where a stroke may lead there, else
    the one that turns the car and moves it sideways most towards it, in a gear (1, -1) or, where
    none is proved, in the other. Returns whether it is into the goal, too.

    A way of dozens of strokes is not followed: from where one of them ends most of the next do not
    lead back to it.
    """
    told, first, last = (one.ravel() for one in np.meshgrid(STROKES, LOCKS, LOCKS))

    def prefer(seen) -> np.ndarray:
        return wrong(case, np.column_stack([seen.path[:, -1], seen.heading]))

    for sign in (gear, -gear):
        k = np.column_stack([sign * c.way_of(told), MOST * first, MOST * last])
        off = np.abs(offset_from(case.goal, compose(now.pose, ends(k)[:, 0])))
        final = tube_of(loop.model, k)[1]
        room = within[0] - np.hypot(final[:, 0], final[:, 1])
        if ((off[:, :2].max(axis=1) < room) & (off[:, 2] < within[1] - final[:, -1])).any():
            step = choose(loop, around, now, c.AT_REST, k, prefer, goal, at)
            if step.new:
                return step, True
        step = choose(loop, around, now, c.AT_REST, k, prefer, None, at)
        if step.new:
            break
    return step, False


def wrong(case: Case, pose: np.ndarray) -> np.ndarray:
    """[m] by which poses (..., 3) are beside the goal, a wrong heading included."""
    off = np.abs(offset_from(case.goal, pose))
    return off[..., 1] + PER_RADIAN * np.maximum(off[..., 2] - STRAIGHT, 0.0)


def choose(loop, around, now: Moving, start, k, prefer, goal, at):
    """One step of the loop: that of manoeuvres k (b, 3), of which k has the start, that is proved
    and preferred.
    """
    loop.candidates = listed_candidates(loop.model, loop.given, asked(k, now.speed))
    here = shapely.Point(now.pose[:2])
    obstacles = [piece for piece, shape in around if shape.distance(here) < NEAR]
    return loop.step(now.pose, [now.wheels, start], obstacles, prefer, at=at, goal=goal)


def tube_of(model, k: np.ndarray, begins: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Of manoeuvres k (b, 3) begun at a speed [m/s] the tube's width (b,) [m], at its widest, and
    (b, 11) at rest.
    """
    start = float(c.start_of(begins)) if begins else c.AT_REST
    return tube_at(model, np.column_stack([np.tile([0.0, start], (len(k), 1)), asked(k, begins)]))


def tube_at(model, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As `tube_of`, of what the model has (b, 5)."""
    bins = model.tube.bins_of(k)
    during, final = model.tube.interval[bins], model.tube.final[bins]
    # on an edge between bins any of them may hold
    return during.max(axis=tuple(range(1, during.ndim))), final.max(
        axis=tuple(range(1, final.ndim - 1))
    )


def ends_surely(
    model,
    k: np.ndarray,
    within=GOAL,
    off=(0.0, 0.0, 0.0),
    shift: float = 0.0,
    heading: float = 0.0,
    begins: float = 0.0,
) -> np.ndarray:
    """(b,) whether manoeuvres k (b, 3), begun at a speed [m/s], that are aimed off (3,) from the
    goal leave room in it: for their tube, for poses that are wrong by shift [m], heading [rad], and
    to correct. within: [m], [rad] from its middle to its sides.
    """
    final = tube_of(model, k, begins)[1]
    place = np.hypot(final[:, 0], final[:, 1]) + shift + heading * np.abs(k[:, 0])
    steered = np.abs(k[:, 1:]).max(axis=1)
    turned = final[:, -1] + heading
    room, turn = within[0] - np.abs(off[:2]).max(), within[1] - abs(off[2])
    return (place < ROOMY * room) & (turned < ROOMY * turn) & (steered < STEERED)


def asked(k: np.ndarray, begins: float = 0.0) -> np.ndarray:
    """Manoeuvres (b, 3) begun at a speed [m/s] as the model has them: what of their way is beyond
    that to stop in, not in metres.
    """
    stops = c.stopping(begins)
    beyond = np.maximum(np.abs(k[:, 0]) - stops, 0.0) / (1.0 - stops / c.WAY)
    return np.column_stack([c.told_of(np.copysign(beyond, k[:, 0])), k[:, 1:]])


def told(k: np.ndarray) -> np.ndarray:
    """Manoeuvres (b, 3) of what the model has (b, 5): all of their way, in metres."""
    stops = c.stopping(c.rolls_at(k[:, 1], k[:, 2]))
    way = c.way_of(k[:, 2]) * (1.0 - stops / c.WAY) + np.copysign(stops, k[:, 2])
    return np.column_stack([way, k[:, 3:]])


def predicted(model, wheels: float, start: float = c.AT_REST, left: bool = False):
    """As `ends` of the guide, by the network, with the steering before [rad] and what k has as its
    start; where the car rolls on, if it is left there.
    """
    along = ways_of(model, wheels, start)
    return lambda k: along(k)[:, [LEFT if left else -1]]


def ways_of(model, wheels: float, start: float):
    """Of manoeuvres k (b, 3) the poses (b, 19, 3) by the network at the edges of the intervals."""
    begins = float(c.rolls_at(start))

    def along(k: np.ndarray) -> np.ndarray:
        given = np.tile([wheels, start], (len(k), 1))
        knots = trajectories(model.net, model.layout, np.column_stack([given, asked(k, begins)]))[0]
        axle, front, rear = np.moveaxis(knots.reshape(*knots.shape[:2], -1, 2)[:, :, :3], 2, 0)
        ahead = front - rear
        return np.concatenate([axle, np.arctan2(ahead[..., 1], ahead[..., 0])[..., None]], axis=-1)

    return along


def mended(way, now: Moving, model, tried):
    """A way as the car can drive it, from where it is, and how many of its manoeuvres it may not.
    One that would begin while the car rolls, and is not as tried, begins at rest. tried: of a way,
    a number and where the car is, the manoeuvre (1, 3) and what k has as its start; or None.
    """
    seen, fails, i = [now], [], 0
    while i < len(way.k):
        now, left = seen[i], bool(way.left[i])
        found = tried(way, i, now)
        if found is None and now.speed:
            way, i = way.unleft(i - 1), i - 1
            del seen[i + 1 :], fails[i:]
            continue
        fails.append(found is None)
        k = way.k[i : i + 1] if found is None else found[0]
        after = way.poses[i + 1]
        if found is not None:
            after = compose(now.pose, predicted(model, now.wheels, found[1], left)(k)[0, 0])
        first, last = (float(x[0]) for x in steering(k))
        wheels = first + (last - first) * float(way.upto[i])
        seen.append(Moving(after, wheels, float(rolls(k, now.speed)[1][0]) if left else 0.0))
        i += 1
    return way, sum(fails)


def aimed(model, guide: Guide, way, i: int, now: Moving):
    """What `mended` tries: a manoeuvre that leads about where it should, and is clear."""
    aim, left = offset_from(now.pose, way.poses[i + 1]), bool(way.left[i])
    for start in starts_for(way.k[i : i + 1], now):
        predict = predicted(model, now.wheels, start, left)
        k, there = reach_exactly(aim[None], way.k[i : i + 1], predict)
        if there[0]:
            break
    poses = compose(now.pose, ways_of(model, now.wheels, start)(k)[0])
    miss = np.abs(offset_from(way.poses[i + 1], poses[LEFT if left else -1]))
    near = there[0] or (i < len(way.k) - 1 and (miss < MISSES).all())
    all_of_k = np.column_stack([[[now.wheels, start]], asked(k, now.speed)])
    clear = guide.clears(poses, tube_at(model, all_of_k)[0][0])
    enough = not now.speed or abs(k[0, 0]) >= c.stopping(now.speed) + NO_LESS
    return (k, start) if near and clear and enough else None


def rehearsed(spare, around, case: Case, within, way, now: Moving):
    """As `mended`, by a spare loop: what is tried is proved from where it would begin. A way along
    which the car rests between all of its manoeuvres is left as it is: another can be found then.
    """
    if not way.left.any():
        return way, 0

    def tried(way, i: int, now: Moving):
        spare.restart()
        goal = goal_of(case, now.pose, within) if i == len(way.k) - 1 else None
        step = link(spare, around, now, way, i, goal, 0.0)
        return (told(step.committed.k[None]), float(step.committed.k[1])) if step.new else None

    return mended(way, now, spare.model, tried)


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
