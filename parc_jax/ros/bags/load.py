"""Runs from bags: one recording is one unit of the claim, however many runs were cut from it."""

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import counted
from parc_jax.learning.labels import Labels
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.law import words_of
from parc_jax.learning.runs.loaders import check_k_law, recorded
from parc_jax.learning.system import ONE_POINT, TURNS, TimeGrid
from parc_jax.problem.world.outlines import Footprint
from parc_jax.ros.bags.fields import value_at
from parc_jax.ros.bags.recording import Heard, heard, recordings_in
from parc_jax.ros.bags.track import times_of, track
from parc_jax.ros.bags.windows import Windows, windows

LOG = logging.getLogger("parc_jax.ros.bags")
SHORT = ("failed", "dropped")
CLOCKS_APART = 1.0  # [s] median by which stamps and recorder may differ before they are two clocks


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
    labels: Labels | Mapping[str, Sequence[str]] | None = None,
) -> RolloutBatch:
    """Runs of a planar robot from one bag, or from all in a folder: ROS 1 (.bag), ROS 2 (folder,
    .db3), MCAP. Every recording is a group. Raises InputError.

    pose: topic of poses: Odometry, PoseStamped, ..., or /tf with frames (parent, child), one edge
    of it. command: topic of commands, and k: paths of the numbers in its messages that are k, such
    as ("linear.x", "angular.z"). given: paths of numbers in the messages of `pose`, measured when a
    run begins; they are the first parameters, and `given`. A run begins `after` seconds after each
    new command (or the same one after a pause longer than a run), and is told from where it
    begins: p [m], of all points of a robot, and q, the turn [rad], which turns with the heading.
    domain: K; commands outside of it, such as the one to stop, are no runs. k_law: as of
    `load_rollouts`. short: a run that was cut short by the next command or the end of the recording
    has "failed", and is counted so, or is "dropped", which changes the law of the runs, and is
    yours to judge. bridge: [s] between poses up to which the robot is taken to have gone straight,
    by default two record steps; a run with a wider gap has failed. clock: "header", the stamps of
    messages where they have any, or "recorder", when they were recorded. labels: as of
    `load_rollouts`.
    """
    path = Path(path)
    _check(path, k, k_law, domain, short, after)
    k, given = tuple(k), tuple(given)
    bridge = 2 * time.dt_record if bridge is None else bridge
    found, names, seen = [], [], {}
    for one in recordings_in(path):
        cut, own = _cut(one, time, pose, command, k, given, frames, after, bridge, clock)
        seen.setdefault(own, one.name)
        found.append(cut)
        names += [one.name] * len(cut.k)
    if len(seen) > 1:
        told = [f"{a or '(none)'} -> {b or '(none)'} in {name}" for (a, b), name in seen.items()]
        raise InputError(f"{path}: expected poses in one frame; got {', '.join(told)}.")
    runs = Windows(*map(np.concatenate, zip(*found, strict=True)))
    kept = _kept(path, runs, domain, len(given), short)
    groups = np.array(names)[kept]
    runs = Windows(*(part[kept] for part in runs))
    return recorded(
        path,
        runs.k,
        runs.pose[..., None, :2] if robot is None else robot.at(runs.pose),
        runs.pose[:, -1, 2:],
        ONE_POINT if robot is None else robot.points,
        domain,
        k_law,
        time=time,
        groups=groups,
        rotation=(TURNS,),
        labels={"k": (*given, *k), "q": ("heading [rad]",)} | words_of(labels),
        given=tuple(range(len(given))),
    )


def _cut(one: Path, time, pose, command, k, given, frames, after, bridge, clock):
    """Windows of one recording, and its frames. Raises InputError."""
    said = heard(one, dict.fromkeys([pose, command]))
    orders = said[command]
    try:
        where = track(pose, said[pose], clock, None if frames is None else tuple(frames), given)
        times = times_of(command, orders, clock)
        values = np.array([[value_at(h.message, field, command) for field in k] for h in orders])
        if not np.isfinite(values).all():
            raise InputError(f"{command}: expected finite commands; got one that is not.")
        _require_one_clock(pose, said[pose], command, orders, clock)
    except InputError as error:
        raise InputError(f"{one}: {error}") from None
    order = np.argsort(times, kind="stable")
    return windows(where, times[order], values[order], time, after, bridge), where.frames


def _kept(path: Path, runs: Windows, domain: Box | None, n_given: int, short: str) -> np.ndarray:
    """(m,) which windows are runs. Raises InputError where none is, or none came to its end."""
    ours = np.isfinite(runs.k[:, :n_given]).all(axis=1)
    inside = ours.copy()
    if domain is not None:
        if domain.n != runs.k.shape[1]:
            raise InputError(
                f"{path}: expected a domain of {runs.k.shape[1]} parameters, given ones first; got "
                f"{domain.n}."
            )
        inside[ours] = domain.contains(runs.k[ours])
    kept = inside & ~runs.short if short == "dropped" else inside
    failed = np.isnan(runs.pose[kept]).any(axis=(1, 2)).sum()
    said = (
        f"{counted(len(runs.k), 'command')}: {(~ours).sum()} without what is given, "
        f"{(ours & ~inside).sum()} outside of K, {(inside & runs.short).sum()} cut short, "
        f"{(inside & runs.gaps).sum()} with gaps between poses"
    )
    LOG.info("%s: %s; %d runs, %d of them failed", path, said, kept.sum(), failed)
    if not kept.any() or failed == kept.sum():
        raise InputError(
            f"{path}: expected a run that comes to its end; got {said}. Try a shorter t_f, or a "
            "wider bridge or domain."
        )
    return kept


def _require_one_clock(
    pose: str, poses: Sequence[Heard], command: str, orders: Sequence[Heard], clock: str
) -> None:
    """Raises InputError where one topic is on the recorder's clock, for want of headers, and the
    other on a clock that is far from it.
    """
    off = {pose: _off(poses), command: _off(orders)}
    apart = abs(off[pose] - off[command])
    if clock == "header" and apart > CLOCKS_APART:
        raise InputError(
            f"expected stamps of one clock; those of {pose} and {command} are {apart:.3g} s apart, "
            'against the recorder. Take clock="recorder", or record with one clock.'
        )


def _off(messages: Sequence[Heard]) -> float:
    """[s] median of stamps less recorder."""
    own = [0 if h.stamp is None else h.stamp - h.recorded for h in messages]
    return float(np.median(own)) / 1e9


def _check(path: Path, k, k_law: str, domain, short: str, after: float) -> None:
    check_k_law(path, k_law, domain)
    if short not in SHORT:
        raise InputError(f"short: expected one of {', '.join(SHORT)}; got {short!r:.40}.")
    if isinstance(k, str) or not k:
        raise InputError(f"k: expected paths of numbers in a command, as a tuple; got {k!r:.40}.")
    if not (np.isfinite(after) and after >= 0):
        raise InputError(f"after: expected 0 s or more after the command; got {after!r:.40}.")
