"""Drives one robot by one model, from messages: without ROS, so that it can be tried anywhere."""

import functools
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from parc_jax.answer.answer import Answer
from parc_jax.bags.recording import TILT, pose_in, stamp_of
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import rounded_up
from parc_jax.drive.loop.candidates import Outlook, even_candidates, given_axes
from parc_jax.drive.loop.commitment import Commitment, Step
from parc_jax.drive.loop.loop import Effort, Loop
from parc_jax.learning.model import TrajectoryModel
from parc_jax.planner import Planner
from parc_jax.problem.problem import GoalOfPoints, goal_of_points, reach_avoid
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.problem.world.free_space import FreeSpace
from parc_jax.problem.world.grid_map import GridMap
from parc_jax.problem.world.outlines import Footprint
from parc_jax.safe_set.settings import Settings
from sims.driving import Driving
from sims.guide import along_ways
from sims.ros import measured
from sims.ros.measured import Movers, among, require_frame
from sims.ros.memory import Memory
from sims.ros.outline import ROUNDED, outline_of, require_outline
from sims.ros.readings import Readings
from sims.ros.stated import assumed, stated

SOME = 64  # candidates for which the model's outline at the start is looked at
ANYTHING = 1e3  # [units of q] bound of goal states that are free
Prefer = Callable[[Outlook, np.ndarray], np.ndarray]


class Pilot:
    """Takes measurements as messages of ROS, of any library, and decides on manoeuvres. An invalid
    message raises InputError and changes nothing: the manoeuvre under way continues to its rest.
    After a scan that was refused for what it holds none begins until one is used.

    model: its manoeuvres end at rest. robot: outline with the model's points, or radius [m] for a
    model of one point. prefer: maps an Outlook and the goal (x, y) to costs (b,); by default the
    distance to the goal from the place of rest, on a map through free cells (`along_ways`), without
    one straight. clock: [s], as of `Loop`; it is read where a pose is heard.
    """

    def __init__(
        self,
        model: TrajectoryModel,
        robot: Footprint | float,
        driving: Driving | None = None,
        prefer: Prefer | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ):
        self.driving = d = Driving() if driving is None else driving
        self.model = model
        self.outline = outline_of(model, robot)
        self._some_k = even_candidates(model, given_axes(model, None), SOME)
        middle = (model.domain.lo + model.domain.hi) / 2
        require_outline(self.outline, model, self._at_k(middle[list(given_axes(model, None))]))
        heading = 0.0 if model.rotation is None else d.uncertainty_heading
        uncertainty = Uncertainty(start=d.uncertainty_start, heading=heading)
        self.prefer = along_ways(self) if prefer is None else prefer
        limits = {"looks": d.effort_looks, "deadline": d.deadline, "room": d.room}
        effort = Effort(judged=Effort.candidates, **limits)
        self._clock = clock
        known = {"uncertainty": uncertainty, "effort": effort, "clock": clock}
        self.loop = Loop(model, self.outline.body, leave=d.leave, **known)
        self.readings = Readings(model, d)
        self.planner = Planner(model)
        self.driven: list[Commitment] = []
        self.map: GridMap | None = None
        self._mapped = 0  # [ns] stamp of the map
        self._begun_on: GridMap | None = None  # by which the manoeuvre under way was proved
        self.movers: Movers | None = None
        self.goal: np.ndarray | None = None
        self.memory = Memory(d, self.outline)
        self.given = None
        self._planned = ""  # whose pose the start of the last plan is

    def hear_map(self, message: Any) -> None:
        """A nav_msgs/OccupancyGrid: the static map, not a costmap."""
        require_frame(message, self.driving.frame, "map")
        at = stamp_of(message) or 0
        if at < self._mapped:
            raise InputError(
                f"map: expected stamps that do not fall; got {at} ns after {self._mapped} ns. An "
                "older map does not have what came since."
            )
        self.map, self._mapped = measured.map_in(message), at

    def restart(self) -> None:
        """Another episode, of a robot at rest where it touches nothing: after a tube was left. What
        was seen, and who was told to move, is forgotten; as at the start, a person has looked
        `margin` around the robot. Raises InputError while a manoeuvre is under way.
        """
        begun, stamp = self.memory.begun, self.memory.stamp
        left = -np.inf if begun is None else self.model.time.t_f - (stamp - begun) / 1e9
        if left > 0:
            raise InputError(
                "restart: expected a robot at rest; at its last pose the manoeuvre under way went "
                f"on for {left!r} s. Restart at a pose after it."
            )
        self.loop.restart()
        self.memory.restart()
        self.driven = []

    def hear_goal(self, message: Any) -> None:
        """A geometry_msgs/PoseStamped."""
        require_frame(message, self.driving.frame, "goal")
        goal = np.array(pose_in(message, "goal"))
        if not np.isfinite(goal).all():
            raise InputError(
                f"goal: expected a finite pose, tilted by at most {TILT:g} degrees; got "
                f"{goal.tolist()!r:.80}."
            )
        self.goal = goal

    def hear_scan(self, message: Any) -> None:
        """A sensor_msgs/LaserScan; it is added at the first pose after its last beam."""
        if self.driving.sensor is None:
            raise InputError("scan: expected a pilot that knows where its sensor is; set sensor.")
        self._require_clock(stamp_of(message), "scan")
        self.memory.hear(message)

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
        last = self.memory.stamp
        ahead = -np.inf if at is None or last is None else (at - last) / 1e9
        if ahead > self.driving.stale:
            raise InputError(
                f"{name}: expected a stamp of the clock of poses, no more than "
                f"{self.driving.stale!r} s after the last of them; got {ahead!r} s."
            )

    def hear_pose(self, message: Any) -> Step | None:
        """An Odometry, or any pose with a header, in the frame of all. Returns the step that it
        leads to; None where there is nothing to decide.
        """
        heard = self._clock()
        require_frame(message, self.driving.frame, "pose")
        stamp, pose = stamp_of(message), np.array(pose_in(message, "pose"))
        given = self.readings.given(message)
        if stamp is None or not np.isfinite(pose).all():
            raise InputError(
                f"pose: expected a finite one with a stamp, tilted by at most {TILT:g} degrees; "
                f"got {pose.tolist()!r:.80}."
            )
        last = self.memory.stamp
        if last is not None and stamp <= last:
            raise InputError(
                f"pose: expected stamps that increase; got {stamp / 1e9:.9f} s after "
                f"{last / 1e9:.9f} s. After a clock was set back, as that of a simulation, make a "
                "new Pilot: what this one knows is of times ahead."
            )
        others = self.memory.scanned, self.memory.unused, self.movers and self.movers.stamp
        other_clock = (
            last is None and max(at or 0 for at in others) - stamp > 1e9 * self.driving.stale
        )
        with self.memory.kept():
            if other_clock:
                self.memory.drop()  # what came before was compared with no clock yet
            self.memory.look(stamp, pose)
            self.readings.follow(message)
        self.movers = None if other_clock else self.movers
        self.given = given
        return self._step(heard)

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
        whose = self.readings.frame_of(start, "start")
        here, there = (np.array(pose_in(m, "plan")) for m in (start, goal))
        if not (np.isfinite(here).all() and np.isfinite(there).all() and tolerance > 0):
            raise InputError(
                f"plan: expected finite poses, tilted by at most {TILT:g} degrees, and a tolerance "
                f"> 0 m; got {here.tolist()!r:.80}, {there.tolist()!r:.80} and {tolerance!r:.40}."
            )
        under_way = self.loop.under_way
        if under_way is not None and under_way.seen_outside:
            raise InputError(
                "plan: expected poses to which the manoeuvre under way may have led; one was "
                "beyond its tube, so nobody knows where the robot is. At rest, call `restart` "
                "first."
            )
        at_rest = {axis: 0.0 for axis in self.loop.given}
        ways = self.memory.stale or self._ways(here, list(at_rest.values()))
        if isinstance(ways, str):
            raise InputError(f"plan: expected a start with a way; {ways}.")
        uncertainty = replace(self.loop.uncertainty, given=at_rest)
        where = box(there[:2] - tolerance, there[:2] + tolerance)
        uncertain = None if uncertainty.is_nothing else uncertainty
        ends, body = _goal(self.model, where), self.outline.body
        problem = reach_avoid(ends, ways, body, uncertainty=uncertain)
        settings = Settings(samples=8, target=0.2)
        answer = self.planner.solve(problem, jax.random.key(0), settings, at=self._at(here))
        self._planned = whose
        return answer

    @property
    def pose(self) -> np.ndarray | None:
        """The last pose, x, y [m], heading [rad]."""
        return self.memory.pose

    @property
    def seen(self) -> FreeSpace | None:
        """The space that scans have seen free, as far as it is remembered."""
        return self.memory.seen

    @property
    def said(self) -> str:
        """What the last pose changed of it, to be told; mostly empty."""
        return self.memory.said

    @property
    def drift(self) -> float:
        """[m] by which any point of the robot may have drifted since the last manoeuvre began."""
        return float(self.driving.drift + self.driving.drift_heading * self.outline.far)

    @property
    def assumed(self) -> str:
        """The same in one clause."""
        return assumed(self, self.premises)

    @property
    def assumed_of_plan(self) -> str:
        """The premises of the last plan in one clause; asked at rest, where nothing is measured."""
        told = self.premises | self.readings.whose(self._planned)
        if self.readings.named:
            rests = ", ".join(f"{name} = 0" for name in self.readings.named)
            told["measured at the start"] = f"nothing; {rests}, since it is asked at rest"
        return assumed(self, told, straight=False)

    @property
    def premises(self) -> dict[str, str]:
        """Premises of manoeuvres beside model and tube: by name, in words with their numbers."""
        told = self.driving.premises
        if self.driving.sensor is not None:
            told["what stands"] += "; a map only guides: what stands on it alone is no obstacle"
        return told | self.readings.premises

    def statement(self, step: Step) -> str:
        """The guarantee of a step, and its premises."""
        return stated(self, step)

    def _step(self, heard: float) -> Step | None:
        """heard: [s] of the clock, when the message of the pose came."""
        d, memory = self.driving, self.memory
        if self.goal is None:
            return None
        pose, at = memory.pose, memory.stamp
        seen = self._at(pose), (at - memory.first) / 1e9, self.drift
        arrived = np.linalg.norm(pose[:2] - self.goal[:2]) <= d.arrived
        soon = None if memory.begun is None else memory.begun + round(d.leave * 1e9)
        if arrived or (soon is not None and at < soon):
            step = self.loop.go_on("", None, *seen, self.given)  # nothing is to begin, or not yet
            return step if step.left else None
        scene = memory.stale or self.readings.turned(pose[2]) or self._ways(pose, self.given)
        gone = self._gone()
        if not isinstance(scene, str):
            scene = self._with_movers(scene, seen[1])
        if isinstance(scene, str):
            return self.loop.go_on(scene, gone, *seen, self.given)
        obstacles, spans = scene
        liked = functools.partial(self.prefer, goal=self.goal[:2])
        asked = {"at": seen[1], "drift": seen[2], "spans": spans, "gone": gone, "measured": heard}
        step = self.loop.step(seen[0], self.given, obstacles, liked, **asked)
        if step.new:
            memory.begin()
            self._begun_on = self.map
            self.driven.append(step.committed)
        return step

    def _gone(self):
        """The area that is not free any more, or None: of what was seen; of a map that is another
        one by now all that was free around the manoeuvre under way when it began.
        """
        if self.driving.sensor is not None:
            free = self.memory.remembered
            return None if free is None else free.gone
        last = self.loop.under_way
        if last is None or self._begun_on in (None, self.map):
            return None
        around = last.asked.pose.place[:2], self.driving.reach
        was = self._begun_on.free_space(*around).region
        try:
            return was.difference(self.map.free_space(*around).region)
        except InputError:  # it began beside the new map
            return was

    def _with_movers(self, ways: Sequence[HPolytope], now: float):
        """Obstacles and their spans, or a sentence why there are none. now: [s] of the clock."""
        if not self.driving.mover_radius:
            return ways, None
        since = self.memory.since
        if self.movers is None or (since is not None and self.movers.stamp < since):
            return "nobody has said yet where those are who move"
        pose, at = self.memory.pose, self.memory.stamp
        old = (at - self.movers.stamp) / 1e9  # who came since is in no message
        if old > self.driving.stale:
            return f"where those are who move was last said {old!r} s ago"
        drifts = self.memory.drifts_since(self.movers.stamp)
        if drifts is None:
            return "where those are who move was said before the last two manoeuvres began"
        asked = self.driving, self.model.time, now, drifts
        return among(self.movers, ways, pose, at, *asked)

    def _ways(self, pose: np.ndarray, given: Sequence[float]):
        """Obstacles around a pose with values of the given parameters, or a sentence why there are
        none.
        """
        d, model = self.driving, self.model
        if model.rotation is None and model.n_points > 1:
            off = self.outline.beside(model, self._at_k(given), float(pose[2]))
            # the robot's true heading may be that of the runs
            if off > ROUNDED + d.uncertainty_heading * self.outline.far:
                return (
                    f"a point of the body, turned by {float(pose[2])!r} rad, lies "
                    f"{rounded_up(off, 3)} m beyond the tube around where the model, which has no "
                    "rotation, has it at the start; turn it back, or learn a model with one"
                )
        if d.sensor is None and self.map is None:
            return "there is no map yet"
        try:
            on_map = d.sensor is None
            free = self.map.free_space(pose[:2], d.reach) if on_map else self.memory.remembered
            if free is None:
                return "nothing was seen yet"
            near = free.near(pose[:2], d.reach)
            if not near.holds(self.outline.at(pose), self.memory.off):
                hint = (
                    "; where no scan sees beside it, bring it to rest, look `margin` around it, "
                    f"which is {d.margin!r} m, and `restart`"
                )
                return (
                    "the body, in its uncertainty, does not lie in what is known to be free"
                    f"{'' if on_map else hint}"
                )
            return near.obstacles()
        except InputError as error:
            return str(error).rstrip(".")

    def _at_k(self, given: ArrayLike) -> np.ndarray:
        """(b, n_k) some candidates with values of the given parameters, taken into K."""
        k, axes, domain = self._some_k.copy(), list(given_axes(self.model, None)), self.model.domain
        k[:, axes] = np.clip(given, domain.lo[axes], domain.hi[axes])
        return k

    def _at(self, pose: np.ndarray) -> np.ndarray:
        return pose if self.model.rotation is not None else pose[:2]


def _goal(model: TrajectoryModel, where: Box) -> GoalOfPoints:
    """The first reference point in a box, wherever the others end."""
    first = model.points[0]
    anywhere = box([-ANYTHING] * model.n_q, [ANYTHING] * model.n_q) if model.n_q else None
    return goal_of_points(tuple(model.points), {first: where}, anywhere)
