"""Bags on disk, of any recorder, and fields of messages by name alone: any library decodes them."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from parc_jax.common.errors import InputError, reading
from parc_jax.common.on_use import package
from parc_jax.common.spelling import some_of

SUFFIXES = (".bag", ".mcap", ".db3")
METADATA = "metadata.yaml"  # makes a folder a bag of ROS 2
# in it; an empty or zeroed one may be of any
OF_BAG = re.compile(r"rosbag2_bagfile_information|\A\s*\Z|\0")
PARTS = ("*.db3", "*_0.mcap")  # files of a bag of ROS 2 alone: its metadata are lost without a key
WHOLE = f"a complete bag, any {METADATA} by ROS (else try `mcap recover`, `ros2 bag reindex`)"
# known to be none; of any other ending, as .old or .1, it may be. The last: of `rosbag reindex`
EXPORTS = "csv|docx?|geojson|gpx|h5|hdf5|html?|json|kml|mat|np[yz]|parquet|pdf|pkl|tsv|xlsx?|xml"
PICTURES = "avi|bmp|eps|gif|jpe?g|mkv|mov|mp4|png|svg|tiff?|webm|webp"
NOTES = rf"(?!.*\.(txt|md|ya?ml|toml|log|py|ipynb|md5|sha\d+|{EXPORTS}|{PICTURES}|orig\.active)$)"
PACKED = "7z(ip)?|bz2|cab|gz|lz4|lzma|rar|tar|tbz2?|tgz|tlz|txz|tzst|xz|zipx?|zstd?"
UNREAD = re.compile(rf"\.((ros)?bag|mcap|db3|({PACKED})(?![a-z])){NOTES}", re.I)
UNIT = 1e-3  # a quaternion's length may be off by so much; farther off it is no rotation at all
TILT = 30.0  # [degrees] of a pose at most, as on a ramp; one that is tilted by more has no heading


class Heard(NamedTuple):
    """One message of a topic. [ns] recorded: by the recorder; stamp: of its header, or None."""

    recorded: int
    stamp: int | None
    message: Any


def is_bag(path: Path) -> bool:
    """Is there one recording at this path, by its name or its metadata?"""
    if not path.is_dir():
        return path.suffix in SUFFIXES
    told = path / METADATA
    known = told.is_file() and OF_BAG.search(told.read_text(errors="replace"))
    return bool(known) or (told.is_file() and any(any(path.glob(part)) for part in PARTS))


def recordings_in(path) -> list[Path]:
    """One recording, or all in a folder, by name. Raises InputError, also for one not read."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such file.")
    # what is hidden is no recording: macOS puts `._run.bag` beside a copy of run.bag
    with reading(path, "recordings that may be read"):
        inside = [path] if is_bag(path) else sorted(path.glob("[!.]*"))
        found = [one for one in inside if is_bag(one)]
    every, seen = [path], set()
    for one in every:  # which grows: by what is behind links, too, but by each folder once
        if one.is_dir() and (real := one.resolve()) not in seen:
            seen.add(real)
            every += sorted(one.glob("[!.]*"))
    named = {one for one in every[1:] if UNREAD.search(one.name) or not one.exists()}
    parts = (_parts(one) for one in found if one.is_dir())
    if left := [one.relative_to(path) for one in sorted(named.difference(found, *parts))]:
        raise InputError(
            f"{path}: expected bags, closed, unpacked and in no sub-folder; got {some_of(left)}. "
            "Try `rosbag reindex`, mend links; put bags, of failed runs too, beside the rest."
        )
    if not found:
        raise InputError(
            f"{path}: expected a bag ({', '.join(SUFFIXES)}, or a folder with {METADATA}), or a "
            "folder of bags; there is none."
        )
    return found


def _parts(bag: Path) -> list[Path]:
    """Files that the metadata of a bag, a folder, name. Raises InputError."""
    with reading(bag, WHOLE, Exception):  # a damaged file may raise anything
        told = package("ruamel.yaml", "bags", "bags").YAML(typ="safe").load(bag / METADATA)
        names = told["rosbag2_bagfile_information"]["relative_file_paths"]
        return [bag / Path(name).name for name in names]


def heard(path: Path, topics: Sequence[str]) -> dict[str, list[Heard]]:
    """All messages of these topics, in the order in which they were recorded. Raises InputError
    for a topic that is not there, and for a bag that is truncated or damaged.
    """
    reader = package("rosbags.highlevel", "bags").AnyReader
    system = package("rosbags.typesys", "bags")
    # for bags without definitions of their types
    plain = system.get_typestore(system.Stores.ROS2_HUMBLE)
    out: dict[str, list[Heard]] = {topic: [] for topic in topics}
    with reading(path, WHOLE, Exception), reader([path], default_typestore=plain) as bag:
        listed = sorted({f"{c.topic} ({c.msgtype})" for c in bag.connections})
        if missing := {*topics} - {c.topic for c in bag.connections}:
            has = some_of(listed or ["none"])
            raise InputError(f"{path}: expected a topic {min(missing)}; it has {has}.")
        wanted = [c for c in bag.connections if c.topic in out]
        for connection, recorded, data in bag.messages(connections=wanted):
            message = bag.deserialize(data, connection.msgtype)
            out[connection.topic].append(Heard(recorded, stamp_of(message), message))
    for topic, messages in out.items():
        count = sum(c.msgcount for c in wanted if c.topic == topic)
        if not messages or len(messages) != count:
            raise InputError(
                f"{path}: expected {count or 'some'} messages of {topic}, as its index says; read "
                f"{len(messages)}."
            )
    return out


def value_at(message, path: str, topic: str) -> float:
    """The number at a path: "twist.twist.linear.x", "axes.1" of an array. Raises InputError."""
    found = message
    for word in path.split("."):
        try:
            found = found[int(word)] if word.isdecimal() else getattr(found, word)
        except (AttributeError, IndexError, TypeError):
            raise InputError(
                f"{topic}: expected a number {path}; its messages have no {word!r} there, but "
                f"{', '.join(names_in(found)) or 'no fields'}."
            ) from None
    if isinstance(found, bool | int | float | np.number | np.bool_):
        return float(found)
    raise InputError(f"{topic}: expected a number at {path}; got {', '.join(names_in(found))}.")


def told_in(message, path: str = "") -> dict[str, str]:
    """Numbers and texts in a message as texts, by paths of `value_at`; of its header the frame."""
    if isinstance(message, bool | int | float | np.number | np.bool_ | str):
        return {path: repr(message if isinstance(message, str) else float(message))}
    names = [name for name in names_in(message) if path != "header" or name == "frame_id"]
    parts = {name: getattr(message, name) for name in names}
    if isinstance(message, list | tuple | np.ndarray):
        parts = {str(i): part for i, part in enumerate(message)}
    inside = (told_in(part, f"{path}.{name}".lstrip(".")) for name, part in parts.items())
    return {name: value for some in inside for name, value in some.items()}


def names_in(message) -> list[str]:
    """Names of the fields of a message."""
    fields = getattr(message, "__dataclass_fields__", None) or getattr(message, "__slots__", ())
    return [name.lstrip("_") for name in fields if not name.startswith("__")]


def stamp_of(message) -> int | None:
    """[ns] of the message's header, where it has one; of several transforms of the first."""
    parts = getattr(message, "transforms", None)
    message = parts[0] if parts else message
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return None if stamp is None else int(stamp.sec) * 10**9 + int(stamp.nanosec)


def frames_of(message) -> tuple[str, str]:
    """The frame of a pose and the frame that has it; empty where a message has none."""
    frame = getattr(getattr(message, "header", None), "frame_id", "")
    return frame.lstrip("/"), getattr(message, "child_frame_id", "").lstrip("/")


def pose_in(message, topic: str) -> tuple[float, float, float]:
    """(x, y, heading) [m, rad] of an Odometry, a Pose, a PoseStamped, one with covariance, a
    Transform, or a Pose2D; the heading is `yaw_of` the quaternion. Raises InputError.
    """
    while hasattr(message, "pose"):
        message = message.pose
    message = getattr(message, "transform", message)
    if hasattr(message, "theta"):
        return float(message.x), float(message.y), float(message.theta)
    place = getattr(message, "position", None) or getattr(message, "translation", None)
    turn = getattr(message, "orientation", None) or getattr(message, "rotation", None)
    if place is None or turn is None:
        raise InputError(
            f"{topic}: expected poses (Odometry, PoseStamped, TransformStamped, ...); its messages "
            f"have {', '.join(names_in(message))}."
        )
    return float(place.x), float(place.y), yaw_of(turn, topic)


def yaw_of(turn, topic: str) -> float:
    """[rad] of a unit quaternion; NaN of one tilted by more than TILT. Raises InputError."""
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    if not abs(math.hypot(x, y, z, w) - 1) <= UNIT:
        raise InputError(
            f"{topic}: expected unit quaternions; got ({x:g}, {y:g}, {z:g}, {w:g}). Left unfilled?"
        )
    if 1 - 2 * (x * x + y * y) < math.cos(math.radians(TILT)):
        return math.nan  # of a robot that lies on its side, or another frame, as of a camera
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
