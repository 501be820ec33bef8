"""One manoeuvre chosen and proved, from where the car is: the next one of a way (`link`), or a
stroke to and fro in a slot (`shuffle`).
"""

from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

import parc_jax as pj
from parc_jax.drive.loop.candidates import listed_candidates
from sims.parking import car as c
from sims.parking.cases import GOAL, NEAR, Case
from sims.parking.kinematics import (
    LONGEST,
    MOST,
    compose,
    ends,
    offset_from,
    reach_exactly,
    standing,
    steering,
)
from sims.parking.predict import MODEL, asked, predicted, told, tube_of
from sims.parking.slot import PER_RADIAN, Slot, apart, strokes, wrong
from sims.parking.way import Way
from sims.rectangle import rectangle

NEAREST = 0.01  # [m] from its target that a manoeuvre may end
AROUND, SPREAD = 384, (0.12, 0.12, 0.12)  # candidates around the way's own, and their spread
WIDER = 3.0  # times as wide spread where no manoeuvre leads there exactly
NO_LESS = 0.21  # [m] that a manoeuvre goes on beyond where a car that rolls could stop
LITTLE = 0.02  # share of its wheels' turn, at least, for which a car at rest stands
TRIED = 5  # such shares from a chosen one on, to all of it, until one leads where it should
SIGNS = (1.0, -1.0)  # of gears
STRAYS = 0.03  # [m] beside where a stroke was found to lead that one may, as of `apart`


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
        leave=float(c.ROLLS_ON),
        uncertainty=uncertainty,
        candidates=np.zeros((1, 3)),
        effort=pj.drive.Effort(judged=AROUND, looks=1 << 14, room=0.02, deadline=1e4),
    )


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


def link(loop, around, now: Moving, way: Way, i: int, goal, at):
    """One step of the loop: the manoeuvre number i of a way, from where the car is to where that
    leads, and into a goal if that is not None. around: of a case the pieces; at: on the loop's
    clock.
    """
    k, target = np.asarray(way.k[i : i + 1], float), way.poses[i + 1]
    aim = offset_from(now.pose, target)
    least = (c.stopping(now.speed) + NO_LESS) * bool(now.speed)
    draw = np.random.default_rng(0).normal(size=(AROUND - 1, 3)) * SPREAD
    draw *= np.random.default_rng(1).uniform(0, 1, (AROUND - 1, 1)) ** 2
    most = np.array([LONGEST, MOST, MOST])
    stands = None if way.stands is None else float(way.stands[i])
    # a goal may take what leads beside its middle, and so what stands for less
    starts = starts_for(k, now, stands if goal is None else 0.0)
    for start in starts:
        predict = predicted(loop.model, now.wheels, start, bool(way.rolls_on[i]))
        exact, there = reach_exactly(aim[None], k, predict)
        if not there[0] and start != starts[-1] and goal is None:
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


def starts_for(k: np.ndarray, now: Moving, stands: float | None = None) -> list[float]:
    """What k may have as the start of a manoeuvre like k (1, 3), the quickest first. stands: share
    of the turn of its wheels that was chosen for it.
    """
    if now.speed:
        return [float(c.start_of(now.speed))]
    share = standing(steering(k)[0][0] - now.wheels, k[0, 0])
    shares = (max(share, LITTLE), 0.5 * (1.0 + share), 1.0)
    if stands is not None:
        shares = np.linspace(max(stands, LITTLE), 1.0, TRIED)
    return list(dict.fromkeys(float(c.starts_at(one)) for one in shares))


def shuffle(loop, around, now: Moving, gear, slot: Slot, case: Case, within, goal, at):
    """One step of the loop to and fro in a slot: into the goal where a stroke may lead there, else
    the one that turns the car and moves it sideways most towards it, in a gear (1, -1) or, where
    none is proved, in the other. Where such ones, one after another, seem not to lead into the
    goal, it is that of the strokes into it that were found. Returns whether it is into the goal,
    too.
    """

    def prefer(seen) -> np.ndarray:
        return wrong(case, np.column_stack([seen.path[:, -1], seen.heading]))

    for sign in (gear, -gear):
        k = strokes(sign)
        off = np.abs(offset_from(case.goal, compose(now.pose, ends(k)[:, 0])))
        final = tube_of(loop.model, k)[1]
        room = within[0] - np.hypot(final[:, 0], final[:, 1])
        if ((off[:, :2].max(axis=1) < room) & (off[:, 2] < within[1] - final[:, -1])).any():
            step = choose(loop, around, now, c.AT_REST, k, prefer, goal, at)
            if step.new:
                slot.left()
                return step, True
    # the second from where the car is, not from where it should be
    for _ in range(0 if slot.alone(now.pose, gear) else 2):
        after = slot.after(now.pose)
        if after is None:
            break
        off = {sign: apart(compose(now.pose, ends(strokes(sign))[:, 0]), after) for sign in SIGNS}
        sign = min(SIGNS, key=lambda one: off[one].min())
        near = strokes(sign)[off[sign] < STRAYS]
        if len(near):
            k = np.resize(near, (AROUND, 3))
            step = choose(loop, around, now, c.AT_REST, k, partial(beside, after), None, at)
            if step.new:
                slot.driven()
                return step, False
        slot.left()
    for sign in (gear, -gear):
        step = choose(loop, around, now, c.AT_REST, strokes(sign), prefer, None, at)
        if step.new:
            break
    return step, False


def beside(pose: np.ndarray, seen) -> np.ndarray:
    """[m] that manoeuvres which the loop sees end beside a pose (3,)."""
    return apart(np.column_stack([seen.path[:, -1], seen.heading]), pose)


def choose(loop, around, now: Moving, start, k, prefer, goal, at):
    """One step of the loop: that of manoeuvres k (b, 3), of which k has the start, that is proved
    and preferred.
    """
    loop.candidates = listed_candidates(loop.model, loop.given, asked(k, now.speed))
    here = shapely.Point(now.pose[:2])
    obstacles = [piece for piece, shape in around if shape.distance(here) < NEAR]
    return loop.step(now.pose, [now.wheels, start], obstacles, prefer, at=at, goal=goal)
