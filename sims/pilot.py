"""Drives one robot by one model, from messages: without ROS, so that it can be tried anywhere."""

import functools
from collections import deque
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import replace
from typing import Any

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.plot.shapes import placed
from parc_jax.bags.recording import frames_of, pose_in, stamp_of, value_at
from parc_jax.common.errors import InputError
from parc_jax.common.premises import MEASURED, Premises, agree, premises
from parc_jax.common.sets.box import Box, box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import rounded_up
from parc_jax.drive.loop.candidates import Outlook, moved_last
from parc_jax.drive.loop.commitment import Commitment, Step
from parc_jax.drive.loop.loop import Effort, Loop
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.planner import Planner
from parc_jax.problem.problem import GoalOfPoints, goal_of_points, reach_avoid
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.problem.world.free_space import FreeSpace, free_place
from parc_jax.problem.world.grid_map import GridMap
from parc_jax.problem.world.outlines import Footprint
from parc_jax.safe_set.settings import Settings
from parc_jax.statement import about_said
from sims.driving import Driving
from sims.guide import along_ways
from sims.ros import measured
from sims.ros.measured import Movers, among, require_frame, swept_in
from sims.sweep import swept

ANYTHING = 1e3  # [units of q] bound of goal states that are free
SIDES = 64  # of the polygon around a disc, for free space at the start
TRACK = 256  # poses that are stored, to locate scans
OF_SCANNER = ("angle_min", "angle_increment", "range_min", "range_max")  # equal in all scans
Prefer = Callable[[Outlook, np.ndarray], np.ndarray]


class Pilot:
    """Takes measurements as messages of ROS, of any library, and decides on manoeuvres. An invalid
    message raises InputError and changes nothing: the manoeuvre under way continues to its rest.

    model: its manoeuvres end at rest. robot: outline with the model's points, or radius [m] for a
    model of one point. prefer: maps an Outlook and the goal (x, y) to costs (b,); by default the
    distance to the goal from the place of rest, on a map through free cells (`along_ways`), without
    one straight.
    """

    def __init__(
        self,
        model: TrajectoryModel,
        robot: Footprint | float,
        driving: Driving | None = None,
        prefer: Prefer | None = None,
    ):
        self.driving = d = Driving() if driving is None else driving
        self.model = model
        self.outline, self.inner, self.body = _outline(model, robot)
        heading = 0.0 if model.rotation is None else d.uncertainty_heading
        uncertainty = Uncertainty(start=d.uncertainty_start, heading=heading)
        self.prefer = along_ways(self) if prefer is None else prefer
        limits = {"looks": d.effort_looks, "deadline": d.deadline, "room": d.room}
        effort = Effort(judged=Effort.candidates, **limits)
        self.loop = Loop(model, self.body, leave=d.leave, uncertainty=uncertainty, effort=effort)
        if len(d.given) != len(self.loop.given):
            hint = " Learn one of a system that names in `given` what it measures at the start."
            raise InputError(
                f"given: expected {len(self.loop.given)} numbers in the messages of poses, one for "
                f"each given parameter of the model; got {len(d.given)}."
                f"{hint if not self.loop.given else ''}"
            )
        self.planner = Planner(model)
        self.driven: list[Commitment] = []
        self.map: GridMap | None = None
        self.seen: FreeSpace | None = None
        self.movers: Movers | None = None
        self.goal: np.ndarray | None = None
        self.said = ""  # the free space that the last scan refutes
        self.pose = self.given = None
        self._scanner: Premises | None = None
        self._tracked: Premises | None = None
        self._scans: deque[Any] = deque(maxlen=TRACK)  # that wait for a pose after their last beam
        self._scanned = self._added = None  # [ns] of the last scan that came, and that was added
        self._track: deque[tuple[int, np.ndarray]] = deque(maxlen=TRACK)
        # [ns] of the last pose, of the first one, and of where the last two manoeuvres began
        self._stamp = self._first = self._begun = self._before = None
        self._forgot = 0  # times since the first pose

    def hear_map(self, message: Any) -> None:
        """A nav_msgs/OccupancyGrid: the static map, not a costmap."""
        require_frame(message, self.driving.frame, "map")
        self.map = measured.map_in(message)

    def restart(self) -> None:
        """Another episode, of a robot at rest where it touches nothing: after a tube was left."""
        self.loop.restart()
        self.driven, self._begun, self._before = [], None, self._begun or self._before

    def hear_goal(self, message: Any) -> None:
        """A geometry_msgs/PoseStamped."""
        require_frame(message, self.driving.frame, "goal")
        goal = np.array(pose_in(message, "goal"))
        if not np.isfinite(goal).all():
            raise InputError(f"goal: expected a finite pose; got {goal.tolist()!r:.80}.")
        self.goal = goal

    def hear_scan(self, message: Any) -> None:
        """A sensor_msgs/LaserScan; it is added at the first pose after its last beam."""
        if self.driving.sensor is None:
            raise InputError("scan: expected a pilot that knows where its sensor is; set sensor.")
        swept_in(message)
        at = stamp_of(message)
        self._require_clock(at, "scan")
        if at is None or (self._scanned is not None and at <= self._scanned):
            raise InputError(
                f"scan: expected stamps that increase; got {at!r} ns after {self._scanned!r} ns. "
                "An older scan says nothing of who came since."
            )
        names = {"frame of the scan": str(frames_of(message)[0])}
        names |= {name: float(getattr(message, name)).hex() for name in OF_SCANNER}
        scanner = premises((name, MEASURED, value) for name, value in names.items())
        agree("scan: all are of the sensor whose place was told", self._scanner or scanner, scanner)
        self._scanner, self._scanned = scanner, at
        self._scans.append(deepcopy(message))  # it waits: its ranges may be a buffer of the driver

    def hear_movers(self, message: Any) -> None:
        """A geometry_msgs/PoseArray: places of all moving obstacles; all others stand still."""
        require_frame(message, self.driving.frame, "movers")
        if not self.driving.mover_radius:
            raise InputError("movers: expected a pilot that knows their size; set mover_radius.")
        movers = measured.movers_in(message)
        self._require_clock(movers.stamp, "movers")
        if self.movers is not None and movers.stamp < self.movers.stamp:
            raise InputError(
                f"movers: expected stamps that do not fall; got {movers.stamp} ns after "
                f"{self.movers.stamp} ns. An older message does not have who came since."
            )
        self.movers = movers

    def _require_clock(self, at: int | None, name: str) -> None:
        """Raises InputError for a stamp [ns] that lies ahead: it would be told as new by then."""
        ahead = -np.inf if at is None or self._stamp is None else (at - self._stamp) / 1e9
        if ahead > self.driving.stale:
            raise InputError(
                f"{name}: expected a stamp of the clock of poses, no more than "
                f"{self.driving.stale!r} s after the last of them; got {ahead!r} s."
            )

    def hear_pose(self, message: Any) -> Step | None:
        """An Odometry, or any pose with a header, in the frame of all. Returns the step that it
        leads to; None where there is nothing to decide.
        """
        require_frame(message, self.driving.frame, "pose")
        stamp, pose = stamp_of(message), np.array(pose_in(message, "pose"))
        given = [value_at(message, path, "pose") for path in self.driving.given]
        if stamp is None or not np.isfinite(pose).all():
            raise InputError(
                f"pose: expected a finite one with a stamp; got {pose.tolist()!r:.80}."
            )
        if self._stamp is not None and stamp <= self._stamp:
            raise InputError(
                f"pose: expected stamps that increase; got {stamp / 1e9:.9f} s after "
                f"{self._stamp / 1e9:.9f} s."
            )
        tracked = premises([("whose pose it is", MEASURED, frames_of(message)[1])])
        agree("pose: all are of one place on the robot", self._tracked or tracked, tracked)
        self._tracked = tracked
        heard = [self._scanned or 0, self.movers.stamp if self.movers else 0]
        if self._stamp is None and max(heard) - stamp > 1e9 * self.driving.stale:
            self._scans.clear()  # what came before was compared with no clock yet
            self.movers = self._scanned = None
        # the loop's clock begins at the first pose
        self._stamp = stamp
        self._first = stamp if self._first is None else self._first
        self.pose, self.given = pose, given
        self._track.append((stamp, pose))
        self._look()
        return self._step()

    def plan(self, start: Any, goal: Any, tolerance: float) -> Answer:
        """The safe set from a pose at rest to a goal, two geometry_msgs/PoseStamped: the end of the
        first reference point within the tolerance [m] of the goal along each axis, any heading.
        Takes seconds. Raises InputError, also where obstacles move or what is free has an age: its
        beginning is unknown.
        """
        if self.driving.mover_radius or self.driving.age:
            raise InputError(
                "plan: expected a place where nobody moves and what is free stays so (age = 0), "
                "since it is not known when the plan begins; give the goal to drive to instead."
            )
        for name, message in {"start": start, "goal": goal}.items():
            require_frame(message, self.driving.frame, name)
        here, there = (np.array(pose_in(m, "plan")) for m in (start, goal))
        if not (np.isfinite(here).all() and np.isfinite(there).all() and tolerance > 0):
            raise InputError("plan: expected finite poses, and a tolerance > 0 m.")
        ways = self._stale() or self._ways(here)
        if isinstance(ways, str):
            raise InputError(f"plan: expected a start with a way; {ways}.")
        at_rest = {axis: 0.0 for axis in self.loop.given}
        uncertainty = replace(self.loop.uncertainty, given=at_rest)
        where = box(there[:2] - tolerance, there[:2] + tolerance)
        uncertain = None if uncertainty.is_nothing else uncertainty
        problem = reach_avoid(_goal(self.model, where), ways, self.body, uncertainty=uncertain)
        settings = Settings(samples=8, target=0.2)
        return self.planner.solve(problem, jax.random.key(0), settings, at=self._at(here))

    @property
    def drift(self) -> float:
        """[m] by which any point of the robot may have drifted since the last manoeuvre began."""
        far = np.linalg.norm(self.outline, axis=1).max()
        return float(self.driving.drift + self.driving.drift_heading * far)

    @property
    def assumed(self) -> str:
        """The same in one clause."""
        told = [f"{name}: {value}" for name, value in self.premises.items()]
        if self.model.rotation is None:
            told.append("the heading of a pose is not asked: the model goes along the frame's axes")
        if self._added is not None:
            told.append(f"the last scan is {(self._stamp - self._added) / 1e9!r} s older")
        if self.movers is not None:
            age = (self._stamp - self.movers.stamp) / 1e9
            when = f"{age!r} s before" if age >= 0 else f"{-age!r} s after the pose"
            told.append(f"who moves was told {when}, and nobody has come since")
        return "; ".join(told)

    @property
    def premises(self) -> dict[str, str]:
        """Premises of manoeuvres beside model and tube: by name, in words with their numbers."""
        frame = "" if self._tracked is None else self._tracked["whose pose it is"]
        whose = f"of the frame {frame!r}" if frame else "of a frame that no message names"
        return self.driving.premises | {
            "whose pose it is": f"{whose}, which is the model's first reference point"
        }

    def statement(self, step: Step) -> str:
        """The guarantee of a step, and its premises."""
        now = step.committed
        if now is None:
            return f"Nothing is committed to: {step.reason}."
        begun = f"{now!r}".strip("<>")
        if not step.new:
            return f"Going on with {begun}, to its stop: {step.reason}."
        moves = self.driving.mover_radius > 0  # also where none can come so near in this one
        after = "; who moves may run into it there" if moves else ""
        last = moved_last(self.model, now.k[None])[0][0]
        body, n = "; ".join(now.shared["body"]), len(now.asked.problem.obstacles)
        told = [f"{name_of(self.model.labels.k[i])} = {float(now.k[i])!r}" for i in self.loop.given]
        known = [f"its measured start is exact: {', '.join(told)}"] if told else []
        if moves:
            most = about_said(now.asked.problem.rests_on)
            known.append(f"what moves is told of until {float(now.told_until)!r} s. {most}".strip())
        return (
            f"{begun}, a body ({body}) among {n} obstacles. Proved in float64 with a margin that "
            "covers rounding: for every run inside the tube and every pose inside the uncertainty "
            "nothing is touched. Assumed: that it rests at its end, where its prediction moves by "
            f"{rounded_up(last, 2)} m in the last {self.model.time.dt:g} s{after}; "
            f"{'; '.join([*known, self.assumed])}. (E) {now.asked.model.claim.details()}"
        )

    def _look(self) -> None:
        """Add the free space of the scans that wait, once there are poses before the first beam and
        after the last, and that under the body.
        """
        d, self.said = self.driving, ""
        if d.sensor is None:
            return
        # the robot may be anywhere within the uncertainty of its pose
        corners, off = placed(self.inner, self.pose[:2], self.pose[2]), self._off()
        if self.seen is None:
            self.seen = free_place(corners, d.margin - off)
        while self._scans and _swept(self._scans[0])[1] <= self._stamp:
            try:
                self._add(self._scans.popleft())
            except InputError as error:  # the pose is looked for in its tube all the same
                self.said += f"a scan is not used: {error} "
        self._forget(self._stamp)
        self.seen = self.seen.add(free_place(corners, -off))

    def _forget(self, now: int) -> None:
        """What is older than its age leaves, by a time [ns]: half an age is one part of memory."""
        if not self.driving.age:
            return
        halves = int((now - self._first) / 1e9 / self.driving.age * 2)
        for _ in range(min(halves - self._forgot, 2)):
            self.seen = self.seen.forget()
        self._forgot = max(halves, self._forgot)

    def _add(self, scan: Any) -> None:
        """Add the free space of a scan. The sensor is placed where it was in the middle of the
        sweep, on a straight way between poses; its motion from there, and what it may have strayed
        from that way, is uncertainty.
        """
        d, (begin, end) = self.driving, _swept(scan)
        stamps, poses = (np.array(part) for part in zip(*self._track, strict=True))
        if begin < stamps[0]:
            late = (stamps[0] - begin) / 1e9
            self.said += f"a scan was {late!r} s older than all poses, and is not used; "
            return
        # it would be remembered for longer than its age, or its frame has drifted twice since
        aged = self._first + int(self._forgot * d.age / 2 * 1e9) if self._forgot else begin
        if begin < aged or (self._before is not None and begin < self._before):
            late = (self._stamp - begin) / 1e9
            self.said += f"a scan was {late!r} s old, which is too old, and is not used; "
            return
        poses[:, 2] = np.unwrap(poses[:, 2])
        x, y, yaw = d.sensor
        arm, most = float(np.hypot(x, y)), (d.acceleration, d.acceleration_turning)
        times, lasts = (stamps - begin) / 1e9, (end - begin) / 1e9
        # uncertainty is along each axis, so a place may be off by its diagonal
        known = np.sqrt(2) * d.uncertainty_start + d.uncertainty_heading * arm
        way_off = 2 * known, 2 * d.uncertainty_heading  # both poses of a way
        one = swept(times, poses, lasts, float(scan.time_increment), arm, most, way_off)
        there = one.pose
        eye = np.append(placed(np.array([x, y]), there[:2], there[2]), there[2] + yaw)
        uncertainty = (known + one.moved, d.uncertainty_heading + one.turned)
        limits = {"noise": d.noise, "width": d.width, "between": one.between}
        self._forget(begin)
        seen = measured.seen_in(scan, eye, uncertainty=uncertainty, **limits)
        if self._begun is not None and begin < self._begun and (d.drift or d.drift_heading):
            seen = seen.drifted(self.pose[:2], d.drift, d.drift_heading)
        self.seen = self.seen.add(seen)
        self._added, self.said = begin, self.said + self.seen.said
        self.seen = self.seen.within(self.pose, 2 * d.reach)

    def _step(self) -> Step | None:
        d = self.driving
        if self.goal is None:
            return None
        seen = self._at(self.pose), (self._stamp - self._first) / 1e9, self.drift
        arrived = np.linalg.norm(self.pose[:2] - self.goal[:2]) <= d.arrived
        soon = None if self._begun is None else self._begun + round(d.leave * 1e9)
        if arrived or (soon is not None and self._stamp < soon):
            step = self.loop.go_on("", None, *seen)  # nothing is to begin, or not yet
            return step if step.left else None
        scene = self._stale() or self._ways(self.pose)
        gone = None if self.seen is None else self._remembered().gone
        if not isinstance(scene, str):
            scene = self._with_movers(scene, seen[1])
        if isinstance(scene, str):
            return self.loop.go_on(scene, gone, *seen)
        obstacles, spans = scene
        liked = functools.partial(self.prefer, goal=self.goal[:2])
        asked = {"at": seen[1], "drift": seen[2], "spans": spans, "gone": gone}
        step = self.loop.step(seen[0], self.given, obstacles, liked, **asked)
        if step.new:
            self._before, self._begun = self._begun or self._before, self._stamp
            self.driven.append(step.committed)
            self.seen = self._remembered()
        return step

    def _remembered(self) -> FreeSpace | None:
        """The space that is free wherever the frame has drifted since the last manoeuvre began."""
        d = self.driving
        if self.seen is None or not (d.drift or d.drift_heading):
            return self.seen
        return self.seen.drifted(self.pose[:2], d.drift, d.drift_heading)

    def _with_movers(self, ways: Sequence[HPolytope], now: float):
        """Obstacles and their spans, or a sentence why there are none. now: [s] of the clock."""
        if not self.driving.mover_radius:
            return ways, None
        if self.movers is None:
            return "nobody has said yet where those are who move"
        old = (self._stamp - self.movers.stamp) / 1e9  # who came since is in no message
        if old > self.driving.stale:
            return f"where those are who move was last said {old!r} s ago"
        return among(self.movers, ways, self.pose, self._stamp, self.driving, self.model.time, now)

    def _stale(self) -> str:
        """Why nothing may begin by the scans that were added, or an empty text."""
        if self.driving.sensor is None:
            return ""
        if self._stamp is None:
            return "no pose was heard yet"
        # before the first one somebody looked around, for as long
        since = self._first if self._added is None else self._added
        old = (self._stamp - since) / 1e9
        if old <= self.driving.stale:
            return ""
        return f"no scan of the last {self.driving.stale!r} s could be added; it is {old!r} s ago"

    def _ways(self, pose: np.ndarray):
        """Obstacles around a pose, or a sentence why there are none."""
        d = self.driving
        if d.sensor is None and self.map is None:
            return "there is no map yet"
        try:
            on_map = d.sensor is None
            free = self.map.free_space(pose[:2], d.reach) if on_map else self._remembered()
            if free is None:
                return "nothing was seen yet"
            near = free.near(pose[:2], d.reach)
            if not near.holds(self._corners(pose), self._off()):
                return "the body, in its uncertainty, does not lie in what is known to be free"
            return near.obstacles()
        except InputError as error:
            return str(error).rstrip(".")

    def _off(self) -> float:
        """[m] by which a corner of the body may be off where its pose is measured."""
        far, d = np.linalg.norm(self.outline, axis=1).max(), self.driving
        return float(np.sqrt(2) * d.uncertainty_start + d.uncertainty_heading * far)

    def _corners(self, pose: np.ndarray) -> np.ndarray:
        return placed(self.outline, pose[:2], pose[2])

    def _at(self, pose: np.ndarray) -> np.ndarray:
        return pose if self.model.rotation is not None else pose[:2]


def _swept(scan: Any) -> tuple[int, int]:
    """[ns] of its first beam and of its last."""
    at = stamp_of(scan)
    return at, at + swept_in(scan)


def _goal(model: TrajectoryModel, where: Box) -> GoalOfPoints:
    """The first reference point in a box, wherever the others end."""
    first = model.points[0]
    anywhere = box([-ANYTHING] * model.n_q, [ANYTHING] * model.n_q) if model.n_q else None
    return goal_of_points(tuple(model.points), {first: where}, anywhere)


def _outline(model: TrajectoryModel, robot: Footprint | float):
    """Corners (n, 2) [m] in the robot's frame that hold it, those that it holds, and the body.
    Raises InputError.
    """
    if model.n_p != 2:
        raise InputError(f"pilot: expected a robot in the plane; got one in {model.n_p}-D.")
    if isinstance(robot, Footprint):
        if tuple(model.points) != robot.points:
            raise InputError(
                f"pilot: expected a model of the points {', '.join(robot.points)}; it has "
                f"{', '.join(model.points)}."
            )
        return robot.places[1:], robot.places[1:], robot.body
    if model.n_points != 1 or not (np.ndim(robot) == 0 and np.isfinite(robot) and robot > 0):
        raise InputError(
            "pilot: expected a footprint, or of a model with one point a radius > 0 m; got "
            f"{robot!r:.40}."
        )
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    inner = robot * (1 - 1e-9) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # circumscribed: the polygon holds the disc, whatever its corners are rounded to
    return inner / np.cos(np.pi / SIDES) * (1 + 3e-9), inner, float(robot)
