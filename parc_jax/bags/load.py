"""Runs from bags: windows of recordings, each from a command on and as long as the time grid. One
recording is one unit of the claim, however many runs were cut from it.
"""

import logging
from collections.abc import Mapping, Sequence
from itertools import chain, combinations, product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.bags.recording import (
    TILT,
    Heard,
    frames_of,
    heard,
    pose_in,
    recordings_in,
    stamp_of,
    told_in,
    value_at,
)
from parc_jax.common.arrays import at_least
from parc_jax.common.errors import InputError, check_kind, naming
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import counted, listed, rounded_up, some_of
from parc_jax.learning.labels import Labels
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.law import APART
from parc_jax.learning.runs.loaders import check_k_law, recorded
from parc_jax.learning.system import ONE_POINT, TURNS, TimeGrid
from parc_jax.problem.world.outlines import Footprint

LOG = logging.getLogger("parc_jax.bags")
SHORT = ("failed", "dropped")
CLOCKS = ("header", "recorder")
CLOCKS_APART = 1.0  # [s] median by which stamps of two topics may differ against the recorder,
MIXED_APART = 0.1  # [s] and where one of them has none, and is on the recorder's clock
PARTS_APART = 10.0  # [s] a recording that begins so soon after another's end is a part of it


class Track(NamedTuple):
    """Poses of one recording, on one clock. times (m,) [ns], increasing. stamps (m,) [ns]: of
    headers, 0 where there are none. pose (m, 3): x, y, heading [m, rad], as they were heard.
    more (m, j): further numbers of the messages. frames: of the poses, and of the robot.
    """

    times: np.ndarray
    stamps: np.ndarray
    pose: np.ndarray
    more: np.ndarray
    frames: tuple[str, str]


class Drive(NamedTuple):
    """What one drive told: its track, and commands (n, c) at times (n,) [ns]. clock: in words.
    apart: [s] the clocks of both, in the median. beside: what else its commands say, by paths.
    """

    name: str
    clock: str
    apart: float
    beside: dict[str, set[str]]
    where: Track
    times: np.ndarray
    commands: np.ndarray

    def then(self, part: "Drive") -> "Drive":
        """All of it, with a part that goes on with it; what both have stands once."""
        new = part.where.times > self.where.times[-1]
        tracks = self.where[:4], (x[new] for x in part.where[:4])
        times, stamps, pose, more = map(np.concatenate, zip(*tracks, strict=True))
        sent = (np.concatenate(both) for both in zip(self[5:], part[5:], strict=True))
        return Drive(*part[:4], Track(times, stamps, pose, more, self.where.frames), *sent)


class Windows(NamedTuple):
    """m runs of one recording. k (m, n_k): given parameters, then those of the command. pose (m,
    n_record + 1, 3): x, y, heading [m, rad] from where the run began; NaN where that is unknown.
    short, gaps (m,): the next command came, or the recording ended, before the end of the run;
    poses are too sparse in it.
    """

    k: np.ndarray
    pose: np.ndarray
    short: np.ndarray
    gaps: np.ndarray


def load_bags(
    path,
    time: TimeGrid,
    *,
    pose: str,
    command: str,
    k: Sequence[str],
    given: Sequence[str] = (),
    frames: tuple[str, str] | None = None,
    robot: Footprint | None = None,
    after: float = 0.0,
    domain: Box | None = None,
    k_law: str = "logged",
    short: str = "failed",
    bridge: float | None = None,
    clock: str = "header",
    apart: float = PARTS_APART,
    labels: Labels | Mapping[str, Sequence[str]] | None = None,
) -> RolloutBatch:
    """Runs of a planar robot from one bag, or from all in a folder: ROS 1 (.bag), ROS 2 (folder,
    .db3), MCAP. Every recording is a group; files of which one begins within `apart` [s] of
    another's end are one, as of a recorder that splits them. Raises InputError.

    pose: topic of poses: Odometry, PoseStamped, ..., or /tf with frames (parent, child), one edge
    of it. command: topic of commands; k: paths of the numbers in its messages that are k, such as
    ("linear.x", "angular.z"); the law says which others differed. given: paths of numbers in the
    last message of `pose` up to the begin of a run, `bridge` before it at most; they are the first
    parameters, and `given`. A run begins `after` seconds after each new command (or an equal one
    after a pause longer than a run), in the frame of its beginning: p [m], of all points of a
    robot, and q, the turn [rad], which turns with the heading.
    domain: K; commands outside of it, such as the one to stop, are no runs. k_law, labels: as of
    `load_rollouts`. short: a run cut short by the next command or the end of the recording has
    "failed" and is counted so, or is "dropped", which changes the law of the runs and is yours to
    judge. bridge: [s] between poses up to which the robot is taken to have gone straight, by
    default two record steps; a run with a wider gap has failed. clock: "header", the stamps of
    messages where they have any, or "recorder", the times of recording.
    """
    path = Path(path)
    _check(path, k, k_law, domain, short)
    check_kind("time", time, TimeGrid)
    k, given = tuple(k), tuple(given)
    bridge = at_least("bridge", 2 * time.dt_record if bridge is None else bridge)
    after, apart = at_least("after", after), at_least("apart", apart)
    parts = [_heard(one, pose, command, k, given, frames, clock) for one in recordings_in(path)]
    parts.sort(key=lambda part: (part.where.times[0], part.where.times[-1], part.name))
    recordings = {part.where.frames: part.name for part in parts}
    together: list[list[Drive]] = []  # drives of one recording each
    for part in parts:  # a recorder that splits its file makes no recordings, and begins no run
        off = [part.where.times[0] - max(one.where.times[-1] for one in some) for some in together]
        near = [some for some, x in zip(together, off, strict=True) if -1e9 <= x <= apart * 1e9]
        joined = sorted(chain(*near), key=lambda one: one.where.times[-1])
        if joined:
            LOG.info("%s goes on with %s", part.name, listed([one.name for one in joined]))
            part = joined.pop().then(part)
        together = [some for some in together if some not in near] + [[*joined, part]]
    if len(recordings) > 1:
        got = ", ".join(f"{_edges([edge])} in {name}" for edge, name in recordings.items())
        raise InputError(f"{path}: expected poses in one frame; got {got}.")
    _check_robots(together)
    cuts = [[windows(one, time, after, bridge) for one in some] for some in together]
    runs = Windows(*map(np.concatenate, zip(*chain(*cuts), strict=True)))
    valid, missed, left_out = _valid(path, runs, domain, len(given), short)
    names = [some[-1].name for some in together]
    # whatever else a command says may matter to the robot, too
    paths = sorted({x for part in parts for x in part.beside})
    differ = [x for x in paths if len(set().union(*(of.beside.get(x, {""}) for of in parts))) > 1]
    beside = f"; {some_of(differ)} differed too, and k does not tell it" if differ else ""
    groups = np.repeat(names, [sum(len(cut.k) for cut in some) for some in cuts])[valid]
    runs = Windows(*(part[valid] for part in runs))
    clocks, off = sorted({part.clock for part in parts}), max(part.apart for part in parts)
    return recorded(
        path,
        runs.k,
        runs.pose[..., None, :2] if robot is None else robot.at(runs.pose),
        runs.pose[:, -1, 2:],
        ONE_POINT if robot is None else robot.points,
        domain,
        k_law,
        {
            "pose": f"{pose}, {_edges(recordings)}",
            "command": f"{command}, {', '.join(k)}{beside}",
            "clock": " or ".join(clocks),
            "begin": f"{after:g} s after a command, new or resumed",
            "joined": f"to {apart:g} s",
            "records": f"straight up to {bridge:g} s",
            "cut short": short,
        }
        | ({"given": f"last {', '.join(given)}"} if given else {})
        | ({"clocks": f"up to {rounded_up(off)}{APART}"} if clocks != ["recorder"] else {})
        | ({} if robot is None else {"robot": f"corners from 0: {robot.places[1:].tolist()} m"}),
        left_out,
        missed,
        poses=np.concatenate([part.where.pose for part in parts]),
        time=time,
        groups=groups,
        rotation=(TURNS,),
        labels=labels,
        own={"k": (*given, *k), "q": ("heading [rad]",)},
        given=tuple(range(len(given))),
    )


def _heard(one: Path, pose, command, k, given, frames, clock) -> Drive:
    """What one file has of a drive. Raises InputError."""
    messages = heard(one, dict.fromkeys([pose, command]))
    with naming(one):
        edge = None if frames is None else tuple(frames)
        poses, orders = _poses(pose, messages[pose], edge), messages[command]
        where = track(pose, poses, clock, edge, given)
        times = times_of(command, orders, clock)
        values = np.array([[value_at(h.message, field, command) for field in k] for h in orders])
        if not np.isfinite(values).all():
            raise InputError(f"{command}: expected finite commands; got one that is not.")
        said = [told_in(h.message) for h in orders]
        paths = set().union(*said) - {*k}
        beside = {path: {one.get(path, "") for one in said} for path in paths}
        # one topic may be on the recorder's clock, for want of headers, the other far from it
        topics = ((pose, poses), (command, orders))
        bare = [topic for topic, some in topics if any(h.stamp is None for h in some)]
        apart, most = abs(_off(poses) - _off(orders)), MIXED_APART if bare else CLOCKS_APART
        if clock == "header" and apart > most:
            raise InputError(
                f"expected stamps within {most:g} s of one clock; those of {pose} and {command} "
                f'are {apart:.3g} s apart, against the recorder. Take clock="recorder", or record '
                "with one clock."
            )
    told = f", of {bare[0]} the recorder's" if bare else ""
    clock = "recorder" if len(bare) == len(topics) else clock + told * (clock == "header")
    return Drive(one.absolute().name, clock, apart, beside, where, times, values)


def _check_robots(together: Sequence[Sequence[Drive]]) -> None:
    """Refuse two recordings of one drive, which most of the poses of one tell. Raises InputError.
    Not seen: where each has poses of its own, or neither headers nor one time.
    """
    for one, other in chain(*(product(*both) for both in combinations(together, 2))):
        both = one.where, other.where  # whatever the clock of the runs: recorders have their own
        headed = all(x.stamps.any() for x in both)
        at = [x.stamps if headed else x.times // 10**9 for x in both]  # [s], heard later by some
        if max(x.min() for x in at) > min(x.max() for x in at):
            continue
        # robots may rest at one place of their frames for long
        moved = [np.append(False, (np.diff(x.pose[:, :2], axis=0) != 0).any(axis=1)) for x in both]
        rows = (np.c_[y, x.pose[:, :2]][some] for x, y, some in zip(both, at, moved, strict=True))
        mine, others = ({*map(tuple, x.tolist())} for x in rows)
        if 2 * (same := len(mine & others)) > min(len(mine), len(others)):
            raise InputError(
                f"{other.name}: expected recordings of different drives; {counted(same, 'pose')} "
                f"of it are those of {one.name}, as of two recorders of one robot. Leave one out."
            )


def _valid(path: Path, runs: Windows, domain: Box | None, n_given: int, short: str):
    """(m,) bool, the windows that are runs; how many miss K, in words; how many are no runs for
    other reasons. Raises InputError where no run is complete.
    """
    measured = np.isfinite(runs.k[:, :n_given]).all(axis=1)
    inside = measured.copy()
    if domain is not None:
        if domain.n != runs.k.shape[1]:
            raise InputError(
                f"{path}: expected a domain of {runs.k.shape[1]} parameters; got {domain.n}."
            )
        inside[measured] = domain.contains(runs.k[measured])
    valid = inside & ~runs.short if short == "dropped" else inside
    out, unknown = int((measured & ~inside).sum()), int((~measured).sum())
    failed = np.isnan(runs.pose[valid]).any(axis=(1, 2)).sum()
    counts = (
        f"{counted(len(runs.k), 'command')}: {unknown} without what is given, "
        f"{out} outside of K, {(inside & runs.short).sum()} cut short, "
        f"{(inside & runs.gaps).sum()} with gaps between poses, or tilted beyond {TILT:g} degrees"
    )
    LOG.info("%s: %s; %d runs, %d of them failed", path, counts, valid.sum(), failed)
    if failed == valid.sum():  # or there is none
        raise InputError(
            f"{path}: expected a complete run; got {counts}. Try a shorter t_f, wider bridge or K."
        )
    missed = f"{out:,} of {counted(len(runs.k), 'command')}" if out else ""
    dropped = int((inside & ~valid).sum())
    return valid, missed, {"dropped": dropped, "given but not measured": unknown}


def _off(messages: Sequence[Heard]) -> float:
    """[s] median of stamps less recorder."""
    off = [0 if h.stamp is None else h.stamp - h.recorded for h in messages]
    return float(np.median(off)) / 1e9


def _check(path: Path, k, k_law: str, domain, short: str) -> None:
    check_k_law(path, k_law, domain)
    if short not in SHORT:
        raise InputError(f"short: expected one of {', '.join(SHORT)}; got {short!r:.40}.")
    if isinstance(k, str) or not np.iterable(k) or not k:
        raise InputError(f"k: expected paths of numbers in a command, as a tuple; got {k!r:.40}.")


def track(
    topic: str, with_pose: Sequence[Heard], clock: str, frames: tuple[str, str] | None, more=()
) -> Track:
    """The track in messages of one pose each, all of `frames` where these are given. more: paths of
    further numbers. Raises InputError for stamps that fall, several frames, and no pose.
    """
    edges = {frames_of(one.message) for one in with_pose}
    if len(edges) > 1:
        raise InputError(f"{topic}: expected poses in one frame; got {_edges(edges)}.")
    (edge,) = edges
    if frames is not None and edge != frames:
        raise InputError(f"{topic}: expected {_edges([frames])}; it has {_edges([edge])}.")
    times = times_of(topic, with_pose, clock)
    pose = np.array([pose_in(one.message, topic) for one in with_pose])
    rest = np.array([[value_at(one.message, path, topic) for path in more] for one in with_pose])
    rest = rest.reshape(len(with_pose), len(more))
    same = np.isclose(pose[1:], pose[:-1], 0.0, 0.0, equal_nan=True)
    repeated = np.append(False, (np.diff(times) == 0) & same.all(axis=1))
    stamps = np.array([one.stamp or 0 for one in with_pose], np.int64)
    times, stamps, pose, rest = (x[~repeated] for x in (times, stamps, pose, rest))  # no error
    back = np.flatnonzero(np.diff(times) <= 0)
    if len(back):
        i = int(back[0])
        raise InputError(
            f"{topic}: expected stamps that increase; message {i + 1} has "
            f"{times[i + 1] / 1e9:.9f} s after {times[i] / 1e9:.9f} s. Do two nodes publish it? "
            'Where nobody fills the headers in, take clock="recorder".'
        )
    return Track(times, stamps, pose, rest, edge)


def times_of(topic: str, messages: Sequence[Heard], clock: str) -> np.ndarray:
    """(m,) [ns] on a clock; without a header the recorder's. Raises InputError."""
    if clock not in CLOCKS:
        raise InputError(f"clock: expected one of {', '.join(CLOCKS)}; got {clock!r:.40}.")
    stamps = [h.recorded if clock == "recorder" or h.stamp is None else h.stamp for h in messages]
    return np.array(stamps, np.int64)


def _poses(topic: str, messages: Sequence[Heard], frames) -> list[Heard]:
    """Messages of one pose each: of transforms those of one edge."""
    if not hasattr(messages[0].message, "transforms"):
        return list(messages)
    each = ((one, part) for one in messages for part in one.message.transforms)
    parts = [one._replace(stamp=stamp_of(part), message=part) for one, part in each]
    edges = {frames_of(part.message) for part in parts}
    if frames is None or frames not in edges:
        raise InputError(
            f"{topic}: expected one of its transforms as frames (parent, child), which are not "
            f"composed: {_edges(edges)}; got {'none' if frames is None else _edges([frames])}."
        )
    return [part for part in parts if frames_of(part.message) == frames]


def _edges(edges) -> str:
    return ", ".join(sorted(f"{a or '(none)'} -> {b or '(none)'}" for a, b in edges))


def windows(drive: Drive, grid: TimeGrid, after: float, bridge: float) -> Windows:
    """Runs that begin `after` seconds after each new command, where the values differ from those
    sent before, or repeat after a pause longer than the run. bridge: as of `load_bags`.
    """
    where = drive.where
    order = np.argsort(drive.times, kind="stable")  # those of several senders may arrive swapped
    times, commands = drive.times[order], drive.commands[order]
    new = np.append(True, (np.diff(commands, axis=0) != 0).any(axis=1))
    pause = np.append(True, np.diff(times) > (after + grid.t_f) * 1e9)
    first = np.flatnonzero(new | pause)
    begin = times[first] + round(after * 1e9)
    following = np.append(times[first][1:], np.iinfo(np.int64).max)
    at = begin[:, None] + np.int64(np.round(np.arange(grid.n_record + 1) * grid.dt_record * 1e9))
    upright, path = np.isfinite(where.pose[:, 2]), where.pose.copy()
    path[upright, 2] = np.unwrap(path[upright, 2])  # without jumps of the heading by a turn
    path[~upright] = np.nan
    pose = _interpolated(where.times, path, at, bridge)
    # wherever in a run the robot was tilted, also between two records of it
    tilted, until = where.times[~upright], np.minimum(at[:, -1], following)
    pose[np.searchsorted(tilted, begin) < np.searchsorted(tilted, until, "right")] = np.nan
    last = np.searchsorted(where.times, begin, "right") - 1  # as a robot has it: none from after
    old = (last < 0) | (begin - where.times[last] > bridge * 1e9)
    given = np.where(old[:, None], np.nan, where.more[last])
    ends = np.minimum(following, where.times[-1])
    gaps = (np.isnan(pose).any(axis=2) & (where.times[0] <= at) & (at <= ends[:, None])).any(axis=1)
    pose[at > following[:, None]] = np.nan  # poses behind the next command are of another run
    short = at[:, -1] > ends
    moved = pose - pose[:, :1]  # relative to the first of each run
    cosine, sine = np.cos(pose[:, :1, 2]), np.sin(pose[:, :1, 2])
    ahead = cosine * moved[..., 0] + sine * moved[..., 1]
    left = cosine * moved[..., 1] - sine * moved[..., 0]
    pose = np.stack([ahead, left, moved[..., 2]], axis=-1)
    return Windows(np.concatenate([given, commands[first]], axis=1), pose, short, gaps)


def _interpolated(
    times: np.ndarray, values: np.ndarray, at: np.ndarray, bridge: float
) -> np.ndarray:
    """(..., j) of values (m, j) at times (...) [ns]; NaN outside, and across gaps > bridge [s]."""
    right = np.minimum(np.searchsorted(times, at), len(times) - 1)
    # at a pose itself nothing is interpolated, whatever is beside it
    left = np.maximum(right - (times[right] > at), 0)
    wide = times[right] - times[left]
    share = ((at - times[left]) / np.maximum(wide, 1))[..., None]
    found = (1 - share) * values[left] + share * values[right]
    unknown = (at < times[0]) | (at > times[-1]) | (wide > bridge * 1e9)
    return np.where(unknown[..., None], np.nan, found)
