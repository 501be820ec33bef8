"""An answer or an episode as an MCAP file, for Foxglove and whatever else reads ROS 2."""

import json
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.path import NominalPath, nominal_path
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.files.episode_file import Episode, Manoeuvre, episode_of, is_episode, load_episode
from parc_jax.app.plot.triangles import (
    body_triangles,
    goal_triangles,
    headings,
    in_world,
    obstacle_triangles,
    tube_triangles,
)
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.drive.loop.log import episode_part
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.files import write_atomic
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import Problem
from parc_jax.problem.world.grid_map import GridMap
from parc_jax.ros.bags import messages as m
from parc_jax.ros.bags.messages import Messages, mcap
from parc_jax.safe_set.verdict.pointwise import verdicts

ROBOT = "base_link"
THIN = 0.01  # [m] width of lines
DARK, GREEN = (0.25, 0.25, 0.25, 1.0), (0.0, 0.62, 0.45, 0.35)
BLUE, LIGHT = (0.0, 0.45, 0.7, 1.0), (0.34, 0.71, 0.91, 0.35)
Line = tuple[int, str, str, object]


def write_mcap(
    path,
    what: Answer | Sequence[Commitment] | str | Path,
    *,
    plan=0,
    grid: GridMap | None = None,
    frame: str = "map",
    begin: float = 0.0,
) -> Path:
    """Write an answer, or an episode, as MCAP with messages of ROS 2; it appears complete or not at
    all.

    what: an answer or its file; commitments of a loop, or a file of `save_episode`. What is read or
    was driven is checked in exact arithmetic first. plan: which plan of an answer is driven: the
    number of a sample, or (p0, k), which must be safe; None for none. grid: a map, on /map; what is
    not free is written as occupied. frame: that the world is told in. begin: [s] stamp at the
    loop's time 0, or of the answer. Raises InputError.

    Topics: /plan (Path: places of the first reference point at the knots), /tf (base_link),
    /body, /tube (all that the body may reach inside the tube), /obstacles, /goal, /plans (all
    samples) (MarkerArray), /map (OccupancyGrid), /statement (String). A robot of one point has no
    heading there but that of its start.
    """
    path = Path(path)
    if path.suffix != ".mcap":
        raise InputError(f"write_mcap: expected a file that ends in .mcap; got {path.name}.")
    if not (np.isfinite(begin) and begin >= 0):
        raise InputError(f"write_mcap: expected begin >= 0 s; got {begin!r:.40}.")
    what = _read(what)
    says = Messages(frame)
    start = round(begin * 1e9)
    if isinstance(what, Answer):
        lines = _answered(says, what, plan, start)
    else:
        lines = _episode(says, what, start)
    if grid is not None:
        shown = says.grid(start, grid.free, grid.resolution, grid.origin)
        lines.append((start, "/map", m.GRID, shown))
    return write_atomic(path, mcap(says, lines))


def _read(what) -> Answer | Episode:
    """What is to be written. Raises InputError."""
    if isinstance(what, Answer):
        return what
    if not isinstance(what, str | Path):
        spelled = json.dumps(episode_part(what))
        return episode_of(json.loads(spelled), "write_mcap")
    return load_episode(what) if is_episode(what) else load_answer(what)


def _answered(says: Messages, answer: Answer, plan, start: int) -> list[Line]:
    model, n_p = answer.model, answer.model.n_p
    lines: list[Line] = [(start, "/statement", m.TEXT, says.text(answer.statement()))]
    places = [nominal_path(model, s[:n_p], s[n_p:]).places[:, 0] for s in answer.samples]
    if places:
        way = in_world(np.stack(places), answer.pose)
        pieces = np.stack([way[:, :-1], way[:, 1:]], axis=2).reshape(-1, 3)
        lines.append(says.markers(start, "plans", m.LINES, pieces, BLUE, THIN))
    chosen = _plan(answer, plan)
    if chosen is None:
        near = np.concatenate([np.zeros((1, n_p)), *places])
        return lines + _scene(says, answer.problem, model, answer.pose, near, start, None)
    begun = Manoeuvre(Fraction(0), answer.pose, answer.problem, chosen[:n_p], chosen[n_p:])
    return lines + _manoeuvre(says, model, begun, start, None)


def _plan(answer: Answer, plan) -> np.ndarray | None:
    """(n_p + n_k,) or None for nothing to drive. Raises InputError."""
    if plan is None or (np.ndim(plan) == 0 and not len(answer.samples)):
        return None
    if np.ndim(plan) == 0:
        if not 0 <= plan < len(answer.samples):
            raise InputError(
                f"plan: expected the number of a sample, 0 to {len(answer.samples) - 1}; got "
                f"{plan!r:.40}."
            )
        return answer.samples[int(plan)]
    chosen = np.asarray(plan, np.float64)
    n_p = answer.model.n_p
    n = n_p + answer.model.n_k
    fits = chosen.shape == (n,) and np.isfinite(chosen).all()
    if not fits or not verdicts(answer.scene, chosen[None, :n_p], chosen[None, n_p:]).safe[0]:
        raise InputError(
            f"plan: expected a safe plan (p0, k) of {n} numbers; got {chosen.tolist()!r:.80}."
        )
    return chosen


def _episode(says: Messages, driven: Episode, start: int) -> list[Line]:
    lines: list[Line] = [(start, "/statement", m.TEXT, says.text(driven.statement))]
    first = driven.manoeuvres[0].begin
    ends = [one.begin for one in driven.manoeuvres[1:]]
    for one, left in zip(driven.manoeuvres, [*ends, None], strict=True):
        stamp = start + round((one.begin - first) * 10**9)
        until = None if left is None else start + round((left - first) * 10**9)
        lines += _manoeuvre(says, driven.model, one, stamp, until, whole=False)
    return lines


def _manoeuvre(
    says: Messages,
    model: TrajectoryModel,
    one: Manoeuvre,
    start: int,
    until: int | None,
    whole: bool = True,
) -> list[Line]:
    """One plan from its start, until it was left [ns]. whole: it has a goal."""
    path: NominalPath = nominal_path(model, one.p0, one.k)
    parts = numbered(one.problem.body, model.points)
    times = start + np.round(path.times * 1e9).astype(np.int64)
    places = in_world(path.places[:, 0], one.pose)
    turned = headings(path.places, one.pose)
    swept = in_world(tube_triangles(parts, path.places, path.tube), one.pose).reshape(-1, 3)
    lines = _scene(says, one.problem, model, one.pose, path.places, start, until, whole)
    lines += [
        (start, "/plan", m.PATH, says.path(times, places, turned)),
        says.markers(start, "tube", m.TRIANGLES, swept, LIGHT),
    ]
    for t, at in enumerate(times):
        if until is None or at < until:
            at = int(at)
            body = in_world(body_triangles(parts, path.places[t]), one.pose).reshape(-1, 3)
            moved = says.transform(at, ROBOT, places[t], turned[t])
            shown = says.markers(at, "body", m.TRIANGLES, body, BLUE)
            lines += [shown, (at, "/tf", m.TRANSFORMS, moved)]
    return lines


def _scene(
    says: Messages,
    problem: Problem,
    model: TrajectoryModel,
    pose,
    near: np.ndarray,
    start: int,
    until: int | None,
    whole: bool = True,
) -> list[Line]:
    """Goal, and obstacles while they are there."""
    lines: list[Line] = []
    if whole:
        goal = in_world(goal_triangles(problem, model.n_p), pose).reshape(-1, 3)
        lines.append(says.markers(start, "goal", m.TRIANGLES, goal, GREEN))
    before = None
    for t in range(model.time.n_steps):
        at = start + round(t * model.time.dt * 1e9)
        there = [span is None or span[0] <= t <= span[1] for span in problem.all_spans]
        if there != before and (until is None or at < until):
            some = [o for o, here in zip(problem.obstacles, there, strict=True) if here]
            points = in_world(obstacle_triangles(some, near), pose).reshape(-1, 3)
            lines.append(says.markers(at, "obstacles", m.TRIANGLES, points, DARK))
        before = there
    return lines
