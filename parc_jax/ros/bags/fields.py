"""Fields of a message of ROS, by their names alone: any library may have decoded it."""

import math

import numpy as np

from parc_jax.common.errors import InputError

UNIT = 1e-3  # a quaternion's length may be off by so much; farther off it is no rotation at all


def value_at(message, path: str, topic: str) -> float:
    """The number in a message at a path such as "twist.twist.linear.x", or "axes.1" in an array.
    Raises InputError.
    """
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
    Transform, or a Pose2D; the heading is the yaw of the quaternion. Raises InputError.
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
    """[rad] of a quaternion. Raises InputError unless its length is 1."""
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not abs(length - 1) <= UNIT:
        raise InputError(
            f"{topic}: expected unit quaternions; got ({x:g}, {y:g}, {z:g}, {w:g}). Was the "
            "orientation never filled in?"
        )
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
