"""What is known of a scan whose sensor moved while it was taken."""

from typing import NamedTuple

import numpy as np


class Swept(NamedTuple):
    """pose (3,): of the robot in the middle of a sweep, x, y [m], heading [rad]. moved [m], turned
    [rad]: by which the sensor was elsewhere at any of its beams, at most. between: the same from
    one beam to the next.
    """

    pose: np.ndarray
    moved: float
    turned: float
    between: tuple[float, float]


def swept(times, poses, end: float, beam: float, arm: float, acceleration, off) -> Swept:
    """The sweep of a sensor from time 0 to `end` [s], on a straight way between the poses (n, 3) of
    the robot, headings not wrapped, at times (n,) [s]; before the first and after the last of them
    it stands.

    beam: [s] from one beam to the next. arm: [m] from the robot's pose to the sensor. acceleration:
    [m/s^2], [rad/s^2] of the robot, at most. off: [m], [rad] by which the way of the sensor from
    one of these poses to the next may be another one, at most.
    """
    times, poses = np.asarray(times), np.asarray(poses)
    during = times[(times > 0) & (times < end)]
    # the middle comes second: its pose stands for the scan, the others bound the motion
    at = np.concatenate([[0.0, end / 2], during, [end]])
    way = np.stack([np.interp(at, times, one) for one in poses.T], axis=1)

    def motion(one: np.ndarray, other: np.ndarray) -> np.ndarray:
        turned = np.abs(one[:, 2] - other[:, 2])
        moved = np.linalg.norm(one[:, :2] - other[:, :2], axis=1) + turned * arm
        return np.stack([moved, turned], axis=1)

    # poses that meet the sweep, and how fast the sensor goes from one to the next at most
    meets = (times[:-1] < end) & (times[1:] > 0)
    took = np.diff(times)[meets]
    rates = (motion(poses[1:][meets], poses[:-1][meets]) + np.asarray(off)) / took[:, None]
    # what accelerates by a strays from a straight way of gap [s] by a gap^2 / 8 at most, and from
    # its speed by a gap / 2
    gap = took.max(initial=0.0)
    most = np.asarray(acceleration) @ np.array([[1.0, 0.0], [arm, 1.0]])
    # motion from one beam to the next at the fastest rate of the sweep
    between = (rates.max(axis=0, initial=0.0) + most * gap / 2) * beam
    moved, turned = motion(way, way[1:2]).max(axis=0) + most * gap**2 / 8
    return Swept(way[1], float(moved), float(turned), tuple(between.tolist()))
