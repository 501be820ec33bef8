"""Bags on disk, of any recorder: .bag, .mcap, .db3, or a folder."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from parc_jax.common import on_use
from parc_jax.common.errors import InputError
from parc_jax.ros.bags.fields import stamp_of

SUFFIXES = (".bag", ".mcap", ".db3")
METADATA = "metadata.yaml"  # makes a folder a bag of ROS 2
SHOWN = 12  # topics that a message names


class Heard(NamedTuple):
    """One message of a topic. recorded: [ns] when the recorder got it. stamp: [ns] of its header,
    None where it has none.
    """

    recorded: int
    stamp: int | None
    message: Any


def package(name: str, call: str):
    """A package of the extra `bags`. Raises InputError where it is not installed."""
    return on_use.package(name, call, "bags")


def is_bag(path) -> bool:
    """Is there one recording at this path, by its name or its metadata?"""
    path = Path(path)
    return (path / METADATA).exists() if path.is_dir() else path.suffix in SUFFIXES


def recordings_in(path) -> list[Path]:
    """One recording, or all in a folder, in the order of their names. Raises InputError."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such file.")
    if is_bag(path):
        return [path]
    found = [inside for inside in sorted(path.iterdir()) if is_bag(inside)] if path.is_dir() else []
    if not found:
        raise InputError(
            f"{path}: expected a bag ({', '.join(SUFFIXES)}, or a folder with {METADATA}), or a "
            "folder of bags; there is none."
        )
    return found


def heard(path: Path, topics: Sequence[str]) -> dict[str, list[Heard]]:
    """All messages of these topics, in the order in which they were recorded. Raises InputError
    for a topic that is not there, and for a bag that is truncated or damaged.
    """
    reader = package("rosbags.highlevel", "bags").AnyReader
    system = package("rosbags.typesys", "bags")
    # for bags without definitions of their types
    plain = system.get_typestore(system.Stores.ROS2_HUMBLE)
    out: dict[str, list[Heard]] = {topic: [] for topic in topics}
    try:
        with reader([path], default_typestore=plain) as bag:
            _require_topics(path, topics, {c.topic: c.msgtype for c in bag.connections})
            wanted = [c for c in bag.connections if c.topic in out]
            for connection, recorded, data in bag.messages(connections=wanted):
                message = bag.deserialize(data, connection.msgtype)
                out[connection.topic].append(Heard(recorded, stamp_of(message), message))
    except InputError:
        raise
    except Exception as error:  # a damaged file may raise anything
        raise InputError(
            f"{path}: expected a complete bag; it is truncated or damaged ({type(error).__name__}: "
            f"{error!s:.80}). Try `mcap recover`, `ros2 bag reindex` or `rosbag reindex`."
        ) from None
    for topic, messages in out.items():
        count = sum(c.msgcount for c in wanted if c.topic == topic)
        if not messages or len(messages) != count:
            raise InputError(
                f"{path}: expected {count or 'some'} messages of {topic}, as its index says; read "
                f"{len(messages)}."
            )
    return out


def _require_topics(path: Path, topics: Sequence[str], there: dict[str, str]) -> None:
    for topic in topics:
        if topic not in there:
            listed = [f"{name} ({kind})" for name, kind in sorted(there.items())]
            more = f", and {len(listed) - SHOWN} more" if len(listed) > SHOWN else ""
            raise InputError(
                f"{path}: expected a topic {topic}; it has {', '.join(listed[:SHOWN]) or 'none'}"
                f"{more}."
            )
