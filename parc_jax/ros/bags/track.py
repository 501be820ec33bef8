"""Where a robot was, over one recording: poses on one clock, in one frame."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.ros.bags.fields import frames_of, pose_in, stamp_of, value_at
from parc_jax.ros.bags.recording import Heard

CLOCKS = ("header", "recorder")


class Track(NamedTuple):
    """times (m,) [ns], increasing. pose (m, 3): x, y, heading [m, rad], the heading without jumps.
    more (m, j): further numbers of the same messages. frames: that poses are told in, and whose
    they are.
    """

    times: np.ndarray
    pose: np.ndarray
    more: np.ndarray
    frames: tuple[str, str]


def track(
    topic: str, messages: Sequence[Heard], clock: str, frames: tuple[str, str] | None, more=()
) -> Track:
    """The track in the messages of a topic. frames: the edge of a topic of transforms that is
    meant. more: paths of further numbers. Raises InputError for stamps that go back, frames that
    change, and what is no pose.
    """
    told = _poses(topic, messages, frames)
    seen = {frames_of(one.message) for one in told}
    if len(seen) > 1:
        raise InputError(f"{topic}: expected poses in one frame; got {_said(seen)}.")
    own = seen.pop()
    if frames is not None and own != frames:
        raise InputError(f"{topic}: expected {_said([frames])}; it has {_said([own])}.")
    times = times_of(topic, told, clock)
    pose = np.array([pose_in(one.message, topic) for one in told])
    rest = np.array([[value_at(one.message, path, topic) for path in more] for one in told])
    rest = rest.reshape(len(told), len(more))
    again = np.append(False, (np.diff(times) == 0) & (pose[1:] == pose[:-1]).all(axis=1))
    times, pose, rest = times[~again], pose[~again], rest[~again]
    _require_forward(topic, times)
    finite = np.isfinite(pose[:, 2])
    pose[finite, 2] = np.unwrap(pose[finite, 2])
    return Track(times, pose, rest, own)


def times_of(topic: str, messages: Sequence[Heard], clock: str) -> np.ndarray:
    """(m,) [ns] on a clock; without a header the recorder's. Raises InputError."""
    if clock not in CLOCKS:
        raise InputError(f"clock: expected one of {', '.join(CLOCKS)}; got {clock!r:.40}.")
    by_header = clock == "header"
    return np.array(
        [h.stamp if by_header and h.stamp is not None else h.recorded for h in messages], np.int64
    )


def _poses(topic: str, messages: Sequence[Heard], frames) -> list[Heard]:
    """The messages that have a pose each: of transforms those of the edge that is meant."""
    if not hasattr(messages[0].message, "transforms"):
        return list(messages)
    parts = [
        one._replace(stamp=stamp_of(part), message=part)
        for one in messages
        for part in one.message.transforms
    ]
    edges = {frames_of(part.message) for part in parts}
    if frames is None or frames not in edges:
        raise InputError(
            f"{topic}: expected one of its transforms as frames (parent, child), which are not "
            f"composed: {_said(edges)}; got {'none' if frames is None else _said([frames])}."
        )
    return [part for part in parts if frames_of(part.message) == frames]


def _require_forward(topic: str, times: np.ndarray) -> None:
    back = np.flatnonzero(np.diff(times) <= 0)
    if len(back):
        i = int(back[0])
        raise InputError(
            f"{topic}: expected stamps that increase; message {i + 1} has "
            f"{times[i + 1] / 1e9:.9f} s after {times[i] / 1e9:.9f} s. Do two nodes publish it? "
            'Where nobody fills the headers in, take clock="recorder".'
        )


def _said(edges) -> str:
    return ", ".join(sorted(f"{a or '(none)'} -> {b or '(none)'}" for a, b in edges))
