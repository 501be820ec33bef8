"""The node of ROS 2 around a pilot: topics in, topics out.

python -m sims.ros.node --ros-args -p model:=model.npz -p radius:=0.2 -p leave:=0.4
"""

import dataclasses
import os
import sys
from array import array
from pathlib import Path as File

import numpy as np

from parc_jax.app.cli.places import require_place
from parc_jax.bags.recording import stamp_of
from parc_jax.common.errors import InputError, ParcError
from parc_jax.common.status import Status
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.drive.loop.episode_file import save_episode
from parc_jax.learning.model import TrajectoryModel, load
from parc_jax.problem.world.outlines import read_footprint
from sims.driving import Driving
from sims.pilot import Pilot
from sims.ros.way import drawn_of, model_of, predicted, way_of

try:
    from geometry_msgs.msg import PoseArray, PoseStamped, PoseWithCovarianceStamped
    from nav_msgs.msg import OccupancyGrid, Odometry, Path
    from nav_msgs.srv import GetPlan
    from rcl_interfaces.msg import ParameterDescriptor
    from rclpy.executors import ExternalShutdownException
    from rclpy.node import Node
    from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
    from sensor_msgs.msg import LaserScan
    from std_msgs.msg import Empty, Float64MultiArray, MultiArrayDimension, String
except ImportError as error:
    ABSENT = (
        f"sims.ros: expected ROS 2; its package {error.name} is not here. Source your "
        "distribution, or on Python 3.11 pip install 'parc_jax[ros]'."
    )
    if __name__ == "__main__":
        print(ABSENT, file=sys.stderr)
        sys.exit(2)
    raise InputError(ABSENT) from None

KINDS = {"Odometry": Odometry, "PoseWithCovarianceStamped": PoseWithCovarianceStamped}
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class PilotNode(Node):
    """Subscribes to map or scan, pose and goal; publishes manoeuvre, path and statement per step.

    Parameters, none of which changes while it runs: model, radius or footprint, episode (a file
    that is written at the end), pose_kind (Odometry or PoseWithCovarianceStamped), tolerance [m] of
    GetPlan, and the fields of `sims.driving.Driving`. Topics, to be remapped: map, scan, movers,
    odom, goal_pose, ~/restart (Empty: the robot rests, and a person has looked `margin` around it)
    in; ~/manoeuvre (Float64MultiArray: the parameters k, named in its layout), ~/path (Path,
    stamped at the knots), ~/statement (String) out. Service: ~/plan (nav_msgs/GetPlan).
    """

    def __init__(self, **options):
        super().__init__("pilot", **options)
        self.episode = self._parameter("episode", "")
        self._restarts = 0
        self.tolerance = self._parameter("tolerance", 0.2)
        model, kind = self._parameter("model", ""), self._parameter("pose_kind", "Odometry")
        robot, driving = self._robot(), self._driving()
        unknown = [x for x in self._parameter_overrides if not self.has_parameter(x)]
        if unknown:
            raise InputError(
                f"parameters: expected those of docs/ros.md; got {', '.join(sorted(unknown))}."
            )
        if not 0 < self.tolerance < np.inf:
            raise InputError(f"tolerance: expected above 0 m; got {self.tolerance!r}.")
        if kind not in KINDS:
            raise InputError(f"pose_kind: expected one of {', '.join(KINDS)}; got {kind!r:.40}.")
        require_place(File(self.episode) if self.episode else None)
        self.pilot = Pilot(load(model), robot, driving)
        self.manoeuvre = self.create_publisher(Float64MultiArray, "~/manoeuvre", 1)
        self.path = self.create_publisher(Path, "~/path", KEPT)
        self.statement = self.create_publisher(String, "~/statement", KEPT)
        self.create_subscription(OccupancyGrid, "map", self._heard(self.pilot.hear_map), KEPT)
        self.create_subscription(PoseStamped, "goal_pose", self._heard(self._on_goal), 1)
        if self.pilot.driving.sensor is not None:
            scan = self._heard(self.pilot.hear_scan)
            self.create_subscription(LaserScan, "scan", scan, qos_profile_sensor_data)
        if self.pilot.driving.mover_radius:
            movers = self._heard(self.pilot.hear_movers)
            self.create_subscription(PoseArray, "movers", movers, qos_profile_sensor_data)
        self.create_subscription(Empty, "~/restart", self._heard(self._on_restart), 1)
        self.create_subscription(KINDS[kind], "odom", self._heard(self._on_pose), 10)
        self.create_service(GetPlan, "~/plan", self._on_plan)

    def finish(self) -> None:
        """Write the episode, if there was one."""
        self._save(self.pilot.driven)

    def _save(self, driven) -> None:
        """Write an episode; after restarts its file has their number in its name."""
        pilot, (root, kind) = self.pilot, os.path.splitext(self.episode)
        if self.episode and driven:
            name = f"{root}_{self._restarts}{kind}" if self._restarts else self.episode
            save_episode(name, driven, drift=pilot.drift, assumed=pilot.premises)

    def _heard(self, listen):
        """A callback that reports a refused message and goes on."""

        def taken(message):
            try:
                listen(message)
            except InputError as error:
                self.get_logger().warning(str(error), throttle_duration_sec=1.0)
                self.statement.publish(String(data=f"Going on as before: {error}"))

        return taken

    def _on_goal(self, message) -> None:
        self.pilot.hear_goal(message)
        x, y, _ = self.pilot.goal
        self.statement.publish(String(data=f"The goal is ({x:g}, {y:g})."))

    def _on_pose(self, message) -> None:
        step = self.pilot.hear_pose(message)
        if self.pilot.said:
            self.statement.publish(String(data=f"Seen: {self.pilot.said}."))
        if step is None:
            return
        if step.new:
            one = step.committed
            self.manoeuvre.publish(_parameters(self.pilot.model, one))
            way = way_of(predicted(one.asked, one.asked.at, one.k), one.asked.pose)
            self.path.publish(_path(way, self.pilot.driving.frame, stamp_of(message)))
        shown = drawn_of(model_of(step.committed.asked)) if step.new else ""
        self.statement.publish(String(data=self.pilot.statement(step) + shown))
        if not self.episode:
            self.pilot.driven.clear()  # without a file they would only fill memory

    def _on_restart(self, _) -> None:
        before = self.pilot.driven
        self.pilot.restart()
        self._save(before)
        if before:  # the next episode has a file of its own
            self._restarts += 1
        self.statement.publish(String(data="Restarted: what was seen is forgotten."))

    def _on_plan(self, request, response):
        """An empty path where nothing was proved."""
        try:
            tolerance = request.tolerance or self.tolerance
            answer = self.pilot.plan(request.start, request.goal, tolerance)
        except ParcError as error:
            self.statement.publish(String(data=f"No plan: {error}"))
            return response
        said = f"{answer.details()}\nAssumed: {self.pilot.assumed_of_plan}."
        said += drawn_of(model_of(answer.scene.nominal))
        self.statement.publish(String(data=said))
        if answer.status is Status.PROVED and len(answer.samples):
            plan, n_p = answer.samples[0], answer.model.n_p
            asked = answer.scene.nominal
            way = way_of(predicted(asked, plan[:n_p], plan[n_p:]), asked.pose)
            response.plan = _path(way, self.pilot.driving.frame, stamp_of(request.start))
        return response

    def _parameter(self, name: str, default):
        """A value of the default's kind, whole numbers for others too; None for a list. It stays as
        it is. Raises InputError.
        """
        fixed = ParameterDescriptor(read_only=True, dynamic_typing=True)
        value = self.declare_parameter(name, default, fixed).value
        if isinstance(default, float) and type(value) is int:
            return float(value)
        kinds = (type(None), list, tuple, array) if default is None else type(default)
        if not isinstance(value, kinds) or type(value) is bool:
            kind = {str: "text", int: "a whole number", float: "a number"}.get(kinds, "a list")
            raise InputError(f"{name}: expected {kind}; got {value!r:.40}.")
        return value

    def _robot(self):
        outline, radius = self._parameter("footprint", ""), self._parameter("radius", 0.0)
        if outline and radius:
            raise InputError("footprint, radius: expected one of them; got both.")
        return read_footprint(outline) if outline else radius

    def _driving(self):
        """The fields of `Driving` as parameters; lists have no default."""
        given = {}
        for field in dataclasses.fields(Driving):
            listed = field.default is None or isinstance(field.default, tuple)
            value = self._parameter(field.name, None if listed else field.default)
            if value is not None:
                given[field.name] = tuple(value) if listed else value
        return Driving(**given)


def _path(way, frame: str, begin: int) -> Path:
    """begin: [ns]."""
    out = Path()
    out.header.frame_id = frame
    _stamp(out.header.stamp, begin)
    for time, place, heading in zip(*way, strict=True):
        pose = PoseStamped()
        pose.header.frame_id = frame
        _stamp(pose.header.stamp, begin + round(float(time) * 1e9))
        at, turn = pose.pose.position, pose.pose.orientation
        at.x, at.y, at.z = map(float, place)
        turn.z, turn.w = float(np.sin(heading / 2)), float(np.cos(heading / 2))
        out.poses.append(pose)
    return out


def _stamp(stamp, at: int) -> None:
    stamp.sec, stamp.nanosec = divmod(at, 10**9)


def _parameters(model: TrajectoryModel, one: Commitment) -> Float64MultiArray:
    out = Float64MultiArray(data=one.k.tolist())
    for label in model.labels.k:
        out.layout.dim.append(MultiArrayDimension(label=label, size=1, stride=1))
    return out


def main(arguments: list[str] | None = None) -> int:
    """Spin until stopped. Exit code 2 for invalid parameters."""
    import rclpy

    rclpy.init(args=sys.argv if arguments is None else arguments)
    try:
        node = PilotNode()
    except InputError as error:
        print(f"sims.ros: {error}", file=sys.stderr)
        rclpy.try_shutdown()
        return 2
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.finish()
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
