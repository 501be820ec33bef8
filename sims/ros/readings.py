"""How a pilot reads a pose and what is measured with it: as the model's runs had them."""

import itertools
import math
import re
from collections.abc import Sequence
from typing import Any

from parc_jax.bags.recording import frames_of, value_at
from parc_jax.common.errors import InputError
from parc_jax.common.premises import MEASURED, Premises, agree, premises
from parc_jax.drive.loop.candidates import given_axes
from parc_jax.learning.labels import AXES, axes_in, name_of, unit_of, words_in
from parc_jax.learning.model import TrajectoryModel
from sims.driving import Driving
from sims.ros.outline import ROUNDED

OF_BODY = re.compile(r"twist\.(?!.*\.z$).*")  # along or around axes that turn with the heading
NO_FRAME = "(none)"  # as laws of bags have it
# what messages of ROS have at these ends of a path, by its REP 103
UNITS = {
    re.compile(rf"(.+\.)?{place}\.[xyz]"): unit
    for place, unit in (
        (r"twist\.linear", "m/s"),
        (r"twist\.angular", "rad/s"),
        (r"angular_velocity", "rad/s"),
        (r"linear_acceleration", "m/s2"),
        (r"pose\.position", "m"),
        (r"transform\.translation", "m"),
    )
}
SPELLED = {
    "m": {*"m meter meters metre metres".split()},
    "m/s": {*"m/s mps m/sec m.s^-1 m.s-1 m.s⁻¹ meter/s meters/s metre/s metres/s".split()},
    "rad/s": {*"rad/s rad/sec rad.s^-1 rad.s-1 rad.s⁻¹ radian/s radians/s 1/s s^-1 s⁻¹".split()},
    "m/s2": {*"m/s2 m/s² m/s^2 m/sec2 m/s/s m.s^-2 m.s-2 m.s⁻²".split()},
}
PLAIN = re.compile(r"k\d+")  # of a parameter that nobody named
# ends of paths that are no coordinate, speed or angle: parts of quaternions, stamps, covariances
OTHER = re.compile(r"(.+\.)?((orientation|rotation)\.[xyzw]|(header|stamp)\..+|\w*covariance\..+)")
# speeds along axes of the body by their names, and as derivatives
SPEEDS = {
    re.compile(r"(?:v|vel)?(?:lon|long|longitudinal|forward|surge)"): "vx",
    re.compile(r"(?:v|vel)?(?:lat|lateral|left|sway)"): "vy",
    re.compile(r"d?([xyz])(?:d|dt|dot)|d([xyz])"): r"v\1\2",
}
# the axis at the end of a word: vx, v0y, velx, vxb, and not by, Hz
OF_AXIS = re.compile(
    r"([aclprtuvw]|pos|acc|vel|velocity|speed|lin|linear|ang|angular|)\d?([xyz])\d?b?"
)


class Readings:
    """Reads given parameters, and compares messages with what is known of the model's runs.

    named: of the given parameters. Raises InputError for paths that are more or fewer, or others
    than the law of the runs, or their names, tell, and for a unit that ROS does not have there.
    """

    def __init__(self, model: TrajectoryModel, driving: Driving):
        law, self._paths = model.claim.law.cut, driving.given
        self._labels = [model.labels.k[axis] for axis in given_axes(model, None)]
        self.named = [name_of(label) for label in self._labels]
        n, got = len(self.named), len(self._paths)
        if n != got:
            hint = " Learn one of a system that names in `given` what it measures at the start."
            raise InputError(
                f"given: expected {n} numbers in the messages of poses, one for each given "
                f"parameter of the model; got {got}.{'' if n else hint}"
            )
        if "given" in law:
            learned = law["given"].removeprefix("last ").split(", ")
            alike = len(learned) == n and all(map(_ends_as, learned, self._paths))
            self._require(alike, learned)
        self._require(not _exchanged(self.named, self._paths), self.named)
        for label, path in zip(self._labels, self._paths, strict=True):
            _require_unit(label, path)
        frame = law["pose"].rpartition(" -> ")[2] if "pose" in law else NO_FRAME
        self._learned = "" if frame == NO_FRAME else frame
        self._uncertain = driving.uncertainty_heading
        self.takes_twist = model.rotation is None and any(map(OF_BODY.fullmatch, self._paths))
        self._tracked: Premises | None = None

    def given(self, message: Any) -> list[float]:
        """Values of the given parameters in the message of a pose. Raises InputError, also where
        the name of one is another place in the message.
        """
        for name, path in zip(self.named, self._paths, strict=True):
            self._require(name == path or not _is_in(message, name), self.named)
        return [value_at(message, path, "pose") for path in self._paths]

    def follow(self, message: Any) -> None:
        """Remember whose pose it is. Raises InputError for others than that of the model's runs, or
        of the message before.
        """
        frame = self.frame_of(message, "pose")
        tracked = premises([("whose pose it is", MEASURED, frame)])
        agree("pose: all are of one place on the robot", self._tracked or tracked, tracked)
        self._tracked = tracked

    def frame_of(self, message: Any, name: str) -> str:
        """Whose pose it is, if it says so. Raises InputError for others than that of the runs."""
        frame = frames_of(message)[1]
        if self._learned and frame and frame != self._learned:
            raise InputError(
                f"{name}: expected that of {self._learned!r}, as in the model's runs, which is its "
                f"first reference point; got that of {frame!r}. Publish the pose of that frame, or "
                "learn from poses of this one."
            )
        return frame

    def turned(self, heading: float) -> str:
        """Why nothing may begin at a heading [rad] where a twist is given, or an empty text: what
        is given is exact, and along the frame's axes a twist is so at a heading of 0 alone.
        """
        off = abs(math.remainder(heading, 2 * math.pi)) + self._uncertain
        if not self.takes_twist or off <= ROUNDED:
            return ""
        return (
            f"the twist of a pose is of a body that may be turned by {off!r} rad, "
            "uncertainty_heading included, and the model, which has no rotation, takes it along "
            "the frame's axes, as exact; turn it back, or learn a model with one"
        )

    @property
    def premises(self) -> dict[str, str]:
        """What manoeuvres rest on of it: by name, in words."""
        told = self.whose("" if self._tracked is None else self._tracked["whose pose it is"])
        if self.named:
            each = zip(self._labels, self._paths, strict=True)
            told["measured at the start"] = (
                f"{', '.join(f'{label} is {path}' for label, path in each)} of the message of the "
                "pose, as in the model's runs"
            )
        if self.takes_twist:
            told["measured at the start"] += (
                "; a twist, which is of the body, is taken along the frame's axes, where the "
                f"heading is 0 within ±{ROUNDED!r} rad, its uncertainty included"
            )
        return told

    def whose(self, frame: str) -> dict[str, str]:
        """The premise whose pose it is: of this frame, empty where no message names one."""
        whose = f"of the frame {frame!r}" if frame else "of a frame that no message names"
        first, runs = "the model's first reference point", self._learned
        known = f", {first}, as in its runs"
        unknown = f"; that it is {first} is assumed: its runs are of "
        unknown += f"{runs!r}" if runs else "a frame that no law names"
        return {"whose pose it is": whose + (known if frame and frame == runs else unknown)}

    def _require(self, holds: bool, own: Sequence[str]) -> None:
        if not holds:
            raise InputError(
                f"given: expected {', '.join(own)}, in this order, which the model was learned "
                f"with; got {', '.join(self._paths)}. Give the paths of these, publish poses in "
                "messages that have them, or learn with `given` of messages as they are."
            )


def _ends_as(one: str, other: str) -> bool:
    """Whether two paths are one, or one is the end of the other: a message inside of a message."""
    paths = one.split("."), other.split(".")
    return one == other or 1 < min(map(len, paths)) == _alike(*paths)


def _exchanged(named: Sequence[str], paths: Sequence[str]) -> bool:
    """Whether a name ends more as the path of another parameter does than as its own, or tells
    another axis, or a turn for a way.
    """
    return any(
        _alike(words_in(name), words_in(path))
        < max(_alike(words_in(name), words_in(x)) for x in paths)
        or any(tell(name) and tell(path) and not tell(name) & tell(path) for tell in (_axes, _kind))
        for name, path in zip(named, paths, strict=True)
    )


def _alike(one: Sequence[str], other: Sequence[str]) -> int:
    """How many words both have in common at their ends."""
    pairs = zip(one[::-1], other[::-1], strict=False)
    return sum(1 for _ in itertools.takewhile(lambda pair: pair[0] == pair[1], pairs))


def _axes(name: str) -> set[str]:
    """Axes that a name tells, of a place or a speed."""
    told = (OF_AXIS.fullmatch(_spelled(x)) for x in words_in(name))
    return axes_in(name) | {found[2] for found in told if found}


def _spelled(word: str) -> str:
    """A speed along an axis as `vx`, `east` as x; other words as they are."""
    found = ((alike.fullmatch(word), short) for alike, short in SPEEDS.items())
    return next((one.expand(short) for one, short in found if one), AXES.get(word, word))


def _kind(name: str) -> set[str]:
    return {"linear", "angular"} & {*words_in(name)}


def _require_unit(label: str, path: str) -> None:
    """Raises InputError for a label without the unit that ROS has at a path, where that is known;
    one that nobody gave, or that is the path, is what the runs had there.
    """
    name, same = name_of(label), _ends_as(name_of(label), path)
    if OTHER.fullmatch(path) and not same:
        raise InputError(
            f"given: expected a place, a speed or an angle as it is in a message; got {path}, a "
            f"part of a quaternion, a stamp or a covariance, for {label!r}. Give the path of "
            f"{name}, or learn with `given` of this one, by its name."
        )
    unit = next((unit for ends, unit in UNITS.items() if ends.fullmatch(path)), None)
    own = re.sub(r"[ ·*]+", ".", re.sub(r" */ *", "/", unit_of(label).strip()))
    plain = same or PLAIN.fullmatch(name)
    if unit and not (own in SPELLED[unit] if own else plain):
        raise InputError(
            f"given: expected {name} in [{unit}], which {path} has in messages of ROS; got "
            f"{label!r}. If it is in this unit, name its unit, as '{name} [{unit}]'; else give "
            "the path of a number in its own, or learn it in this one."
        )


def _is_in(message: Any, name: str) -> bool:
    """Whether a name is the path of a number in a message."""
    try:
        value_at(message, name, "pose")
    except InputError:
        return False
    return "." in name
