"""An answer or an episode as an MCAP file of ROS 2 messages, written without ROS."""

import io
import json
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.path import NominalPath, nominal_path
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot.shapes import (
    body_triangles,
    goal_triangles,
    headings,
    in_world,
    obstacle_triangles,
    tube_triangles,
)
from parc_jax.bags.recording import package
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.drive.loop.episode_file import (
    Episode,
    Manoeuvre,
    episode_of,
    episode_part,
    is_episode,
    load_episode,
)
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.files import write_atomic
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import Problem
from parc_jax.problem.world.grid_map import GridMap
from parc_jax.safe_set.verdict.pointwise import verdicts

MARKER, MARKERS = "visualization_msgs/msg/Marker", "visualization_msgs/msg/MarkerArray"
PATH, GRID = "nav_msgs/msg/Path", "nav_msgs/msg/OccupancyGrid"
TRANSFORMS, TEXT = "tf2_msgs/msg/TFMessage", "std_msgs/msg/String"
LINES, TRIANGLES = 5, 11  # kinds of markers: LINE_LIST, TRIANGLE_LIST
DELETE_ALL = 3  # action of a marker
FREE, NOT_FREE = 0, 100
NAME, BASE = 2, 1  # kinds of fields, as rosbags numbers them
ROBOT = "base_link"
THIN = 0.01  # [m] width of lines
DARK, GREEN = (0.25, 0.25, 0.25, 1.0), (0.0, 0.62, 0.45, 0.35)
BLUE, LIGHT = (0.0, 0.45, 0.7, 1.0), (0.34, 0.71, 0.91, 0.35)
Line = tuple[int, str, str, Any]  # time [ns], topic, kind, message


class Messages:
    """Makes messages of ROS 2 Humble, in one frame, and lines (time [ns], topic, kind, message)."""

    def __init__(self, frame: str):
        system = package("rosbags.typesys", "write_mcap")
        self.store = system.get_typestore(system.Stores.ROS2_HUMBLE)
        self.frame = frame

    def make(self, kind: str, **fields) -> Any:
        """A message; other fields are zero or empty."""
        blank = {
            name: _blank(self, field)
            for name, field in self.store.fielddefs[kind][1]
            if name not in fields
        }
        return self.store.types[kind](**blank, **fields)

    def headed(self, at: int):
        """at: [ns]."""
        sec, nanosec = divmod(at, 10**9)
        stamp = self.make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=self.frame)

    def pose(self, place: np.ndarray, heading: float):
        """place (3,) [m]."""
        position, turn = self.vector("Point", place), self.turn(heading)
        return self.make("geometry_msgs/msg/Pose", position=position, orientation=turn)

    def vector(self, kind: str, values):
        x, y, z = map(float, values)
        return self.make(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)

    def turn(self, heading: float):
        z, w = float(np.sin(heading / 2)), float(np.cos(heading / 2))
        return self.make("geometry_msgs/msg/Quaternion", z=z, w=w)

    def path(self, times: np.ndarray, places: np.ndarray, headings: np.ndarray):
        """times (n,) [ns], places (n, 3) [m]."""
        kind = "geometry_msgs/msg/PoseStamped"
        poses = [
            self.make(kind, header=self.headed(int(at)), pose=self.pose(place, heading))
            for at, place, heading in zip(times, places, headings, strict=True)
        ]
        return self.make(PATH, header=self.headed(int(times[0])), poses=poses)

    def transform(self, at: int, place: np.ndarray, heading: float) -> Line:
        """The robot at a place (3,) [m]."""
        kind, header = "geometry_msgs/msg/Transform", self.headed(at)
        to = {"translation": self.vector("Vector3", place), "rotation": self.turn(heading)}
        about = {"child_frame_id": ROBOT, "transform": self.make(kind, **to)}
        one = self.make(f"{kind}Stamped", header=header, **about)
        return at, "/tf", TRANSFORMS, self.make(TRANSFORMS, transforms=[one])

    def markers(self, at: int, name: str, kind: int, points, colour, width=1.0) -> Line:
        """One marker of points (..., 3) that replaces those of its topic /name. colour: red, green,
        blue, alpha. width: [m] of lines.
        """
        points, header = np.reshape(points, (-1, 3)), self.headed(at)
        looks = {
            "scale": self.vector("Vector3", [width] * 3),
            "color": self.make("std_msgs/msg/ColorRGBA", **dict(zip("rgba", colour, strict=True))),
            "points": [self.vector("Point", point) for point in points],
        }
        pose = self.pose(np.zeros(3), 0.0)
        marker = self.make(MARKER, header=header, ns=name, type=kind, pose=pose, **looks)
        away = self.make(MARKER, header=header, ns=name, id=1, action=DELETE_ALL)
        shown = self.make(MARKERS, markers=[away, marker] if len(points) else [away])
        return at, f"/{name}", MARKERS, shown

    def grid(self, at: int, grid: GridMap) -> Line:
        """The cells of a map, free or not."""
        x, y, yaw = grid.origin
        height, width = grid.free.shape
        about = {"width": width, "height": height, "origin": self.pose(np.array([x, y, 0.0]), yaw)}
        info = self.make("nav_msgs/msg/MapMetaData", resolution=grid.resolution, **about)
        data = np.where(grid.free, FREE, NOT_FREE).astype(np.int8).ravel()
        return at, "/map", GRID, self.make(GRID, header=self.headed(at), info=info, data=data)

    def statement(self, at: int, words: str) -> Line:
        return at, "/statement", TEXT, self.make(TEXT, data=words)


def _blank(says: Messages, field) -> Any:
    """The zero of a field."""
    kind, about = field
    if kind == NAME:
        return says.make(about)
    if kind != BASE:
        of_base, inner = about[0]
        plain = of_base == BASE and inner[0] != "string"
        return np.zeros(0, inner[0] if inner[0] != "octet" else "uint8") if plain else []
    word = about[0]
    return "" if word == "string" else False if word == "bool" else 0.0 if "float" in word else 0


def mcap(says: Messages, lines: list[Line]) -> bytes:
    """An MCAP file of messages, in the order of their times."""
    writer_of = package("mcap.writer", "write_mcap")
    stream = io.BytesIO()
    writer = writer_of.Writer(stream)
    writer.start(profile="ros2", library="parc_jax")
    schemas: dict[str, int] = {}
    channels: dict[str, int] = {}
    for number, (at, topic, kind, message) in enumerate(sorted(lines, key=lambda line: line[0])):
        if kind not in schemas:
            text = says.store.generate_msgdef(kind, ros_version=2)[0].encode()
            schemas[kind] = writer.register_schema(kind, "ros2msg", text)
        if topic not in channels:
            channels[topic] = writer.register_channel(topic, "cdr", schemas[kind])
        data = bytes(says.store.serialize_cdr(message, kind))
        writer.add_message(channels[topic], at, data, at, number)
    writer.finish()
    return stream.getvalue()


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
    if not (np.isfinite(begin) and begin >= 0):
        raise InputError(f"write_mcap: expected begin >= 0 s; got {begin!r:.40}.")
    source, says, start = _read(source), Messages(frame), round(begin * 1e9)
    if isinstance(source, Answer):
        lines = _answered(says, source, plan, start)
    else:
        lines = _episode(says, source, start)
    if grid is not None:
        lines.append(says.grid(start, grid))
    return write_atomic(path, mcap(says, lines))


def _read(source) -> Answer | Episode:
    """The answer or episode to write. Raises InputError."""
    if isinstance(source, Answer):
        return source
    if not isinstance(source, str | Path):
        return episode_of(json.loads(json.dumps(episode_part(source))), "write_mcap")
    return load_episode(source) if is_episode(source) else load_answer(source)


def _answered(says: Messages, answer: Answer, plan, start: int) -> list[Line]:
    model, n_p, pose = answer.model, answer.model.n_p, answer.scene.nominal.pose
    lines = [says.statement(start, answer.details())]
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
    lines = [says.statement(start, driven.statement)]
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
    places, turned = in_world(path.places[:, 0], one.pose), headings(path.places, one.pose)
    swept = in_world(tube_triangles(parts, path.places, path.tube), one.pose)
    lines = _scene(says, one.problem, model, one.pose, path.places, start, until, whole)
    lines += [
        (start, "/plan", PATH, says.path(times, places, turned)),
        says.markers(start, "tube", TRIANGLES, swept, LIGHT),
    ]
    for t, at in enumerate(times.tolist()):
        if until is None or at < until:
            body = in_world(body_triangles(parts, path.places[t]), one.pose)
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
        goal = in_world(goal_triangles(problem, model.n_p), pose)
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
