"""The free space that a pilot remembers, of scans in a frame that drifts."""

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np

from parc_jax.app.plot.shapes import placed
from parc_jax.bags.recording import frames_of, stamp_of
from parc_jax.common.errors import InputError
from parc_jax.common.premises import MEASURED, Premises, agree, premises
from parc_jax.problem.world.free_space import FreeSpace, free_place
from sims.driving import Driving
from sims.ros.measured import seen_in, swept_in
from sims.ros.outline import Outline
from sims.sweep import swept

WAITING = 256  # scans that are stored, until poses locate them
STILL = 0.01  # [m], [rad] that are no motion: less than a manoeuvre's, for which drift is told
OF_SCANNER = ("angle_min", "angle_increment", "range_min", "range_max")  # equal in all scans


class Memory:
    """What poses and scans tell of free space.

    seen: the space that is free; None before the first pose, and without a sensor. said: what the
    last scan refutes of it. stamp, first, pose: [ns] of the last pose, of the first one, and the
    last one. added, scanned: [ns] of the last scan that was added, and that came. unused: [ns] of
    the last one that could not be used. begun, before: [ns] of where the last two manoeuvres of
    the episode began. since: [ns] of the first pose after all was forgotten, None if it never was.
    """

    def __init__(self, driving: Driving, outline: Outline):
        self.driving, self.outline = driving, outline
        self.seen: FreeSpace | None = None
        self.said = ""
        self.stamp = self.first = self.pose = None
        self.scanned = self.added = self.unused = None
        self.begun = self.before = self.since = None
        self._rested: np.ndarray | None = None  # pose, while nothing is under way
        self._began_at = np.zeros(2)
        self._again = False  # restarted, and no pose since
        self._frame: str | None = None  # of the scanner
        self._scanner: Premises | None = None
        self._scans: deque[Any] = deque(maxlen=WAITING)  # for a pose after their last beam
        self._track: deque[tuple[int, np.ndarray]] = deque()
        self._forgot = 0  # times since the first pose

    @property
    def off(self) -> float:
        """[m] by which a corner of the body may be off where its pose is measured."""
        d = self.driving
        return float(np.sqrt(2) * d.uncertainty_start + d.uncertainty_heading * self.outline.far)

    @property
    def stale(self) -> str:
        """Why nothing may begin by the scans that were added, or an empty text."""
        if self.driving.sensor is None:
            return ""
        if self.stamp is None:
            return "no pose was heard yet"
        # before the first one somebody looked around, for as long
        looked = self.first if self.since is None else self.since
        used = looked if self.added is None else max(looked, self.added + 1)
        if self.unused is not None and self.unused >= used:
            return "the last scan could not be used, and nothing else tells who has come"
        since = looked if self.added is None else self.added
        old = (self.stamp - since) / 1e9
        if old <= self.driving.stale:
            return ""
        return f"no scan of the last {self.driving.stale!r} s could be added; it is {old!r} s ago"

    @property
    def remembered(self) -> FreeSpace | None:
        """The space that is free wherever the frame has drifted since the last manoeuvre began."""
        d = self.driving
        if self.seen is None or not (d.drift or d.drift_heading):
            return self.seen
        return self.seen.drifted(self.pose[:2], d.drift, d.drift_heading)

    def drifts_since(self, at: int) -> list[np.ndarray] | None:
        """Places (2,) [m] of the robot at each drift of the frame since a time [ns], the last one
        last; None for more than are known. It drifts once from where a manoeuvre began to now, and
        once more before, of what was told before that.
        """
        if not (self.driving.drift or self.driving.drift_heading):
            return []
        here = self.pose[:2]
        if self.begun is None or at >= self.begun:
            return [here]
        return [self._began_at, here] if self.before is None or at >= self.before else None

    def hear(self, scan: Any) -> None:
        """A scan with a stamp that was checked; it is added at the first pose after its last beam.
        Raises InputError; nothing begins after one of this scanner then, until another is added.
        """
        at = stamp_of(scan)
        if at is None or (self.scanned is not None and at <= self.scanned):
            raise InputError(
                f"scan: expected stamps that increase; got {at!r} ns after {self.scanned!r} ns. "
                "An older scan says nothing of who came since."
            )
        frame = str(frames_of(scan)[0])
        try:
            scanner = self._scanner_of(scan, frame)
        except Exception:
            if self._frame in (None, frame):
                self._miss(at)
            raise
        self._frame, self._scanner, self.scanned = frame, scanner, at
        self._scans.append(deepcopy(scan))  # it waits: its ranges may be a buffer of the driver

    def _scanner_of(self, scan: Any, frame: str) -> Premises:
        """What all scans have in common. Raises InputError for one that cannot be used."""
        names = {"frame of the scan": frame}
        names |= {name: float(getattr(scan, name)).hex() for name in OF_SCANNER}
        scanner = premises((name, MEASURED, value) for name, value in names.items())
        agree("scan: all are of the sensor whose place was told", self._scanner or scanner, scanner)
        lasts = swept_in(scan) / 1e9
        if lasts > self.driving.stale:  # by its end it is too old, and all others wait for it
            raise InputError(
                f"scan: expected a sweep within `stale`, {self.driving.stale!r} s; its "
                f"time_increment, {scan.time_increment!r} s, makes it {lasts!r} s."
            )
        try:
            np.asarray(scan.ranges, np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"scan: expected ranges that are numbers; got others: {error}."
            ) from None
        return scanner

    def _miss(self, at: int) -> None:
        """A scan of a time [ns] cannot be used."""
        self.unused = at if self.unused is None else max(at, self.unused)

    def drop(self) -> None:
        """Drop the scans that wait, and that others were refused."""
        self._scans.clear()
        self.scanned = self.unused = None

    @contextmanager
    def kept(self) -> Iterator[None]:
        """What raises within changes nothing."""
        before = vars(self) | {"_scans": self._scans.copy(), "_track": self._track.copy()}
        try:
            yield
        except Exception:
            vars(self).update(before)
            raise

    def restart(self) -> None:
        """Nothing is under way, and the frame may be another one: what was seen is forgotten. As at
        the start, a person has looked around the robot.
        """
        self.begun = self.before = self.added = self.unused = self.seen = self._rested = None
        self._track.clear()  # so scans from before are older than all poses
        self._again = True

    def begin(self) -> None:
        """A manoeuvre begins at the last pose."""
        self.before, self.begun, self._began_at = self.begun, self.stamp, self.pose[:2]
        self.seen = self.remembered

    def look(self, at: int, pose: np.ndarray) -> None:
        """Add the free space of the scans that wait, once there are poses before the first beam and
        after the last, and that under the body. at: [ns] of a pose (x, y, heading).
        """
        d, self.said = self.driving, ""
        self.first = at if self.first is None else self.first
        self.stamp, self.pose = at, pose
        moved = self._moved_by_others(pose)
        if moved:
            self.said = (
                "the robot moves by more than uncertainty_start, uncertainty_heading and drift "
                "allow, and no manoeuvre is under way, so its frame may drift by more than was "
                "told: what was seen, and `margin` that was looked at, is forgotten; "
            )
            self._track.clear()
        if moved or self._again:
            self.since, self._again = at, False
        self._rested = pose if moved or self._rested is None else self._rested
        self._track.append((at, pose))
        # what no scan that can still be used needs
        least = min([at - int(2e9 * d.stale), *(_swept(scan)[0] for scan in self._scans)])
        while len(self._track) > 1 and self._track[1][0] <= least:
            self._track.popleft()
        if d.sensor is None:
            return
        # the robot may be anywhere within the uncertainty of its pose
        corners = self.outline.inner_at(pose)
        if self.seen is None or moved:  # nobody looks around a robot that moves
            self.seen = free_place(corners, (0.0 if moved else d.margin) - self.off)
            self._forgot = max(self._forgot, self._halves(at))  # what is known is of now
        while self._scans and _swept(self._scans[0])[1] <= at:
            scan, before = self._scans.popleft(), self.added
            try:
                self._add(scan)
            except Exception as error:  # the pose is looked for in its tube all the same
                self.said += f"a scan is not used: {error} "
            if self.added == before:
                self._miss(_swept(scan)[0])
        self._forget(at)
        self.seen = self.seen.add(free_place(corners, -self.off))

    def _moved_by_others(self, pose: np.ndarray) -> bool:
        """Whether it moved since it rested, while nothing is under way, by more than the errors of
        both poses and the drift of a manoeuvre.
        """
        d = self.driving
        if self.begun is not None or self._rested is None or not (d.drift or d.drift_heading):
            return False
        off = pose - self._rested
        turned = abs(np.remainder(off[2] + np.pi, 2 * np.pi) - np.pi)
        far = 2 * np.sqrt(2) * d.uncertainty_start + max(d.drift, STILL)  # errors: along each axis
        around = 2 * d.uncertainty_heading + max(d.drift_heading, STILL)
        return bool(np.linalg.norm(off[:2]) > far or turned > around)

    def _forget(self, now: int) -> None:
        """What is older than its age leaves, by a time [ns]: half an age is one part of memory."""
        if not self.driving.age:
            return
        halves = self._halves(now)
        for _ in range(min(halves - self._forgot, 2)):
            self.seen = self.seen.forget()
        self._forgot = max(halves, self._forgot)

    def _halves(self, now: int) -> int:
        """Half ages since the first pose."""
        return int((now - self.first) / 1e9 / self.driving.age * 2) if self.driving.age else 0

    def _add(self, scan: Any) -> None:
        """Add the free space of a scan. The sensor is placed where it was in the middle of the
        sweep, on a straight way between poses; its motion from there, and what it may have strayed
        from that way, is uncertainty.
        """
        d, (begin, end) = self.driving, _swept(scan)
        stamps, poses = (np.array(part) for part in zip(*self._track, strict=True))
        if begin < stamps[0]:
            late = float(stamps[0] - begin) / 1e9
            self.said += f"a scan was {late!r} s older than all poses, and is not used; "
            return
        # it would be remembered for longer than its age, or its frame has drifted twice since
        aged = self.first + int(self._forgot * d.age / 2 * 1e9) if self._forgot else begin
        half = int(d.age / 2 * 1e9)
        if begin < aged - half or (self.before is not None and begin < self.before):
            late = (self.stamp - begin) / 1e9
            self.said += f"a scan was {late!r} s old, which is too old, and is not used; "
            return
        poses[:, 2] = np.unwrap(poses[:, 2])
        x, y, yaw = d.sensor
        arm, most = float(np.hypot(x, y)), (d.acceleration, d.acceleration_turning)
        times, lasts = (stamps - begin) / 1e9, (end - begin) / 1e9
        # uncertainty is along each axis, so a place may be off by its diagonal
        known = np.sqrt(2) * d.uncertainty_start + d.uncertainty_heading * arm
        way_off = 2 * known, 2 * d.uncertainty_heading  # both poses of a way
        one = swept(times, poses, lasts, float(scan.time_increment), arm, most, way_off)
        there = one.pose
        eye = np.append(placed(np.array([x, y]), there[:2], there[2]), there[2] + yaw)
        uncertainty = (known + one.moved, d.uncertainty_heading + one.turned)
        limits = {"noise": d.noise, "width": d.width, "between": one.between}
        self._forget(begin)
        seen = seen_in(scan, eye, uncertainty=uncertainty, **limits)
        if self.begun is not None and begin < self.begun and (d.drift or d.drift_heading):
            seen = seen.drifted(self._began_at, d.drift, d.drift_heading)  # until then
        now = self.seen.add(seen)
        if begin < aged:  # it leaves with those of its half, which the next half forgets
            now = replace(now, newer=self.seen.newer)
        self.seen = now.within(self.pose, 2 * d.reach)
        self.added, self.said = begin, self.said + now.said


def _swept(scan: Any) -> tuple[int, int]:
    """[ns] of its first beam and of its last."""
    at = stamp_of(scan)
    return at, at + swept_in(scan)
