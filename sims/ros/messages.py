"""Messages of ROS 2 and MCAP files of them, made without ROS."""

import io
from typing import Any

import numpy as np

from parc_jax.bags.recording import package
from parc_jax.problem.world.grid_map import GridMap

MARKER, MARKERS = "visualization_msgs/msg/Marker", "visualization_msgs/msg/MarkerArray"
PATH, GRID = "nav_msgs/msg/Path", "nav_msgs/msg/OccupancyGrid"
TRANSFORMS, TEXT = "tf2_msgs/msg/TFMessage", "std_msgs/msg/String"
DELETE_ALL = 3  # action of a marker
FREE, NOT_FREE = 0, 100
NAME, BASE = 2, 1  # kinds of fields, as rosbags numbers them
ROBOT = "base_link"
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
