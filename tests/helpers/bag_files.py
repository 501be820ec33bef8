"""Bags of a robot that drives, written by rosbags: the same drive in every kind of file."""

import math

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

KINDS = ("ros1", "sqlite3", "mcap")
TF = "tf2_msgs/msg/TFMessage"
S = 10**9  # [ns]


def drive(commands, rng=None, rate=50.0, every=1.0, pose=(3.0, -1.0, 0.7), begin=1_700_000_000.0):
    """Times (m,) [s], poses (m, 3), body speeds (m, 2) of a unicycle that takes each command (speed
    [m/s], turn [rad/s]) for `every` seconds, and the times at which they are sent. It rests for
    half a second before the first, and half a second after the last under a command to stop.
    """
    dt = 1 / rate
    sent = begin + 0.5 + every * np.arange(len(commands) + 1)
    n = round((every * len(commands) + 1.0) * rate)
    times = begin + dt * np.arange(n + 1)
    all_of = np.concatenate([np.zeros((1, 2)), commands, np.zeros((1, 2))])
    poses, speeds, here = [], [], np.array(pose, float)
    for t in times:
        v, w = all_of[np.searchsorted(sent, t + 1e-9)]
        if rng is not None:
            v = v * (1 + 0.02 * rng.standard_normal())
        poses.append(here.copy())
        speeds.append((v, w))
        middle = here[2] + w * dt / 2
        here = here + dt * np.array([v * math.cos(middle), v * math.sin(middle), w])
    return times, np.array(poses), np.array(speeds), sent


def ns(seconds) -> int:
    return round(float(seconds) * 1e6) * 1000


class Messages:
    """Messages of one kind of ROS, as rosbags makes them."""

    def __init__(self, ros1: bool):
        self.ros1 = ros1
        self.store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        if ros1:  # which rosbags does not know there
            self.store.register(
                get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TF)
            )
        self.types = self.store.types

    def make(self, kind: str, **fields):
        return self.types[kind](**fields)

    def header(self, at: int, frame: str):
        stamp = self.make("builtin_interfaces/msg/Time", sec=at // S, nanosec=at % S)
        more = {"seq": 0} if self.ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **more)

    def vector(self, x=0.0, y=0.0, z=0.0, kind="Vector3"):
        return self.make(f"geometry_msgs/msg/{kind}", x=float(x), y=float(y), z=float(z))

    def turn(self, yaw, unit=1.0, roll=0.0):
        z, w = unit * math.sin(yaw / 2), unit * math.cos(yaw / 2)
        c, s = math.cos(roll / 2), math.sin(roll / 2)
        return self.make("geometry_msgs/msg/Quaternion", x=w * s, y=z * s, z=z * c, w=w * c)

    def twist(self, v, w):
        return self.make("geometry_msgs/msg/Twist", linear=self.vector(v), angular=self.vector(z=w))

    def pose(self, x, y, *turn):
        place = self.vector(x, y, kind="Point")
        return self.make("geometry_msgs/msg/Pose", position=place, orientation=self.turn(*turn))

    def odometry(self, at, pose, speed, frames, unit=1.0, roll=0.0):
        none = np.zeros(36)
        with_cov = self.make(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=self.pose(*pose, unit, roll),
            covariance=none,
        )
        twist = self.make(
            "geometry_msgs/msg/TwistWithCovariance", twist=self.twist(*speed), covariance=none
        )
        return self.make(
            "nav_msgs/msg/Odometry",
            header=self.header(at, frames[0]),
            child_frame_id=frames[1],
            pose=with_cov,
            twist=twist,
        )

    def transforms(self, at, pose, frames):
        transform = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.vector(*pose[:2]),
            rotation=self.turn(pose[2]),
        )
        one = self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(at, frames[0]),
            child_frame_id=frames[1],
            transform=transform,
        )
        return self.make(TF, transforms=[one])


def write(
    path,
    kind,
    driven,
    commands,
    *,
    frames=("odom", "base_link"),
    stamps=None,
    unit=1.0,
    rolls=(),
    heads=False,
    modes=None,
    tf=None,
):
    """A bag of a drive: /odom, /tf, /cmd_vel. stamps: of /odom [s], where not its times. rolls:
    [rad] of the first poses of /odom. heads: do commands have headers? modes: (frame, name, effort)
    of each, which are of joints then. tf: the messages of /tf that are heard at a time [s] and a
    pose, in place of the one that is in time.
    """
    times, poses, speeds, sent = driven
    ros1 = kind == "ros1"
    says = Messages(ros1)
    stamps = times if stamps is None else stamps
    lines = []
    rolls = [*rolls, *np.zeros(len(times) - len(rolls))]
    for t, stamp, pose, speed, roll in zip(times, stamps, poses, speeds, rolls, strict=True):
        odometry = says.odometry(ns(stamp), pose, speed, frames, unit, roll)
        lines.append((ns(t), "/odom", "nav_msgs/msg/Odometry", odometry))
        moved = [says.transforms(ns(t), pose, frames)] if tf is None else tf(says, t, pose)
        lines += [(ns(t) + i, "/tf", TF, message) for i, message in enumerate(moved)]
    stops = [(0.0, 0.0)] * (len(sent) - len(commands))  # one, or none where it was not sent yet
    for i, (t, (v, w)) in enumerate(zip(sent, [*commands, *stops], strict=True)):
        name, message = "geometry_msgs/msg/Twist", says.twist(v, w)
        if heads:
            name, header = f"{name}Stamped", says.header(ns(t), "base_link")
            message = says.make(name, header=header, twist=message)
        if modes is not None:
            name, (frame, mode, effort) = "sensor_msgs/msg/JointState", modes[i]
            place, none = np.array([v, w]), np.zeros(0)
            own = {"name": [mode], "position": place, "velocity": none, "effort": np.array(effort)}
            message = says.make(name, header=says.header(ns(t), frame), **own)
        lines.append((ns(t), "/cmd_vel", name, message))
    lines.sort(key=lambda line: line[0])
    put = says.store.serialize_ros1 if ros1 else says.store.serialize_cdr
    if ros1:
        bag = Writer1(path)
    else:
        plugin = StoragePlugin.SQLITE3 if kind == "sqlite3" else StoragePlugin.MCAP
        bag = Writer2(path, version=9, storage_plugin=plugin)
    with bag:
        kinds = dict((topic, name) for _, topic, name, _ in lines)
        open_ = {
            topic: bag.add_connection(topic, name, typestore=says.store)
            for topic, name in kinds.items()
        }
        for at, topic, name, message in lines:
            bag.write(open_[topic], at, bytes(put(message, name)))
    return path
