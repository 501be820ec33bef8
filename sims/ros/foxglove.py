"""An answer or an episode for Foxglove: an MCAP file of ROS 2 messages, written without ROS.

python -m sims.ros.foxglove answer.json answer.mcap --sample 3 --map hall.yaml
"""

import json
import sys
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
import tyro

from parc_jax.answer.answer import Answer
from parc_jax.answer.path import nominal_path
from parc_jax.app.cli.check import is_episode
from parc_jax.app.cli.places import require_place
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot.shapes import (
    corners_of,
    in_world,
    linked,
    obstacle_triangles,
    reached,
    triangles,
    tube_triangles,
)
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.drive.loop.episode_file import (
    Episode,
    Manoeuvre,
    episode_of,
    episode_part,
    load_episode,
)
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.files import write_atomic
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import Problem
from parc_jax.problem.world.grid_map import GridMap, load_map
from parc_jax.safe_set.verdict.pointwise import verdicts
from sims.ros.messages import PATH, Line, Messages, mcap
from sims.ros.way import drawn_of, way_of

LINES, TRIANGLES = 5, 11  # kinds of markers: LINE_LIST, TRIANGLE_LIST
THIN = 0.01  # [m] width of lines
LAST = 2**31  # [s] seconds of a stamp are an int32
DARK, GREEN = (0.25, 0.25, 0.25, 1.0), (0.0, 0.62, 0.45, 0.35)
BLUE, LIGHT = (0.0, 0.45, 0.7, 1.0), (0.34, 0.71, 0.91, 0.35)


def write_mcap(
    path,
    source: Answer | Sequence[Commitment] | str | Path,
    *,
    plan=0,
    grid: GridMap | None = None,
    frame: str = "map",
    begin: float = 0.0,
) -> Path:
    """Write an answer, or an episode, as MCAP with messages of ROS 2; it appears complete or not at
    all.

    source: an answer or its file; commitments of a loop, or a file of `save_episode`. Files and
    episodes are checked in exact arithmetic first. plan: of an answer, to execute: the index of a
    sample, or (p0, k), which must be safe; None for none. grid: a map, on /map; cells that are not
    free are written as occupied. frame: of the world. begin: [s] stamp at the loop's time 0, or of
    the answer. Raises InputError.

    Topics: /plan (Path: places of the first reference point at the knots), /tf (base_link),
    /body, /tube (the set that the body may reach inside the tube), /obstacles, /goal, /plans (all
    samples) (MarkerArray), /map (OccupancyGrid), /statement (String). A robot of one point has no
    heading there but that of its start.
    """
    path = Path(path)
    if path.suffix != ".mcap":
        raise InputError(f"write_mcap: expected a file that ends in .mcap; got {path.name}.")
    _require_stamps(begin, begin)
    source, says, start = _read(source), Messages(frame), round(begin * 1e9)
    if isinstance(source, Answer):
        lines = _answered(says, source, plan, start)
    else:
        lines = _episode(says, source, start)
    if grid is not None:
        lines.append(says.grid(start, grid))
    return write_atomic(path, mcap(says, lines))


def _require_stamps(first: float, last: float) -> None:
    """Raises InputError for seconds that stamps of ROS have no room for."""
    if not 0 <= first <= last < LAST:
        raise InputError(
            f"write_mcap: expected stamps from 0 to below {LAST:,} s, the loop's clock from begin "
            f"on; got {first:g} to {last:g} s."
        )


def _read(source) -> Answer | Episode:
    """The answer or episode to write. Raises InputError."""
    if isinstance(source, Answer):
        return source
    if not isinstance(source, str | Path):
        return episode_of(json.loads(json.dumps(episode_part(source))), "write_mcap")
    return load_episode(source) if is_episode(source) else load_answer(source)


def _answered(says: Messages, answer: Answer, plan, start: int) -> list[Line]:
    model, n_p, pose = answer.model, answer.model.n_p, answer.scene.nominal.pose
    lines = [says.statement(start, answer.details() + drawn_of(model))]
    places = [nominal_path(model, s[:n_p], s[n_p:]).places[:, 0] for s in answer.samples]
    if places:
        way = in_world(np.stack(places), pose)
        pieces = np.stack([way[:, :-1], way[:, 1:]], axis=2)
        lines.append(says.markers(start, "plans", LINES, pieces, BLUE, THIN))
    chosen = _plan(answer, plan)
    if chosen is None:
        near = np.concatenate([np.zeros((1, n_p)), *places])
        return lines + _scene(says, answer.problem, model, pose, near, start, None)
    begun = Manoeuvre(Fraction(0), pose, answer.problem, chosen[:n_p], chosen[n_p:])
    return lines + _manoeuvre(says, model, begun, start, None)


def _plan(answer: Answer, plan) -> np.ndarray | None:
    """(n_p + n_k,) or None for nothing to drive. Raises InputError."""
    if plan is None or (np.ndim(plan) == 0 and not len(answer.samples)):
        return None
    if np.ndim(plan) == 0:
        last = len(answer.samples) - 1
        if not 0 <= plan <= last:
            raise InputError(
                f"plan: expected the number of a sample, 0 to {last}; got {plan!r:.40}."
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
    # each manoeuvre is shown until it was left for the next one, the last one to its end
    lines = [says.statement(start, driven.statement + drawn_of(driven.model))]
    ends = [one.begin for one in driven.manoeuvres[1:]]
    for one, left in zip(driven.manoeuvres, [*ends, None], strict=True):
        stamp = start + round(one.begin * 10**9)
        until = None if left is None else start + round(left * 10**9)
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
    path = nominal_path(model, one.p0, one.k)
    parts = numbered(one.problem.body, model.points)
    seconds, places, turned = way_of(path, one.pose)
    times = start + np.round(seconds * 1e9).astype(np.int64)
    _require_stamps(start / 1e9, float(times[-1]) / 1e9)
    swept = in_world(tube_triangles(parts, path.places, path.tube), one.pose)
    lines = _scene(says, one.problem, model, one.pose, path.places, start, until, whole)
    lines += [
        (start, "/plan", PATH, says.path(times, places, turned)),
        says.markers(start, "tube", TRIANGLES, swept, LIGHT),
    ]
    for t, at in enumerate(times.tolist()):
        if until is None or at < until:
            body = in_world(reached(parts, path.places[t][:, None]), one.pose)
            lines.append(says.markers(at, "body", TRIANGLES, body, BLUE))
            lines.append(says.transform(at, places[t], turned[t]))
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
        goal = in_world(_goal_triangles(problem, model.n_p), pose)
        lines.append(says.markers(start, "goal", TRIANGLES, goal, GREEN))
    before = None
    for t in range(model.time.n_steps):
        at = start + round(t * model.time.dt * 1e9)
        there = [span is None or span[0] <= t <= span[1] for span in problem.all_spans]
        if there != before and (until is None or at < until):
            standing = [o for o, here in zip(problem.obstacles, there, strict=True) if here]
            points = in_world(obstacle_triangles(standing, near), pose)
            lines.append(says.markers(at, "obstacles", TRIANGLES, points, DARK))
        before = there
    return lines


def _goal_triangles(problem: Problem, n_p: int) -> np.ndarray:
    """(t, 3, n_p) where the first reference point is to end; none where that is not bounded."""
    try:
        part, at = linked(problem.goal, range(n_p))
        return triangles(corners_of(part)[:, at])
    except InputError:
        return np.zeros((0, 3, n_p))


def main(
    source: tyro.conf.Positional[Path],
    out: tyro.conf.Positional[Path],
    sample: int = 0,
    map: Path | None = None,
    frame_id: str = "map",
) -> int:
    """Write an answer or an episode for Foxglove; exit code 2 for invalid input.

    Args:
        source: An answer file of `parc-jax solve` or `run`, or an episode of
            `pj.drive.save_episode`; it is checked anew.
        out: The MCAP file to write: path, tf, body, tube, obstacles, goal, statement.
        sample: Number of the sample that is driven there, from 0.
        map: A map_server YAML file, which is written there too.
        frame_id: Name of the world frame there.
    """
    try:
        require_place(out)
        grid = None if map is None else load_map(map)
        written = write_mcap(out, source, plan=sample, grid=grid, frame=frame_id)
    except InputError as error:
        print(f"sims.ros.foxglove: {error}", file=sys.stderr)
        return 2
    print(f"{written}: {len(written.read_bytes()):,} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(tyro.cli(main))
