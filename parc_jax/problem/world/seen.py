"""The region that a lidar scan proves free under bounded errors. [T41, T44]"""

from types import ModuleType

import numpy as np
import numpy.typing as npt
from jaxtyping import Float

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.world.free_space import Beams, FreeSpace, shrunk
from parc_jax.problem.world.outlines import package, require_near

CALL = "seen_from"
SAME = 1e-6  # [rad] beams closer than this at the seam of a full turn are one


def seen_from(
    pose: npt.ArrayLike,
    angles: npt.ArrayLike,
    ranges: npt.ArrayLike,
    *,
    max_range: float,
    noise: float,
    width: float,
    angle_error: float = 0.0,
    uncertainty: tuple[float, float] = (0.0, 0.0),
    tolerance: float = 0.005,
) -> FreeSpace:
    """The region that one scan proves free; added to an older region, it refutes parts of that.
    Raises InputError.

    pose: (x, y, heading) [m, rad] of the sensor, in a fixed frame.
    angles: (n,) [rad] of the beams against its heading, increasing, over a full turn at most.
    ranges: (n,) [m] finite; max_range or more for a beam without a return, free up to there; 0 for
        a failed or blocked beam.
    noise: [m] bound of |range - truth|. angle_error: [rad] bound for each beam.
    uncertainty: ([m], [rad]) bounds of the error of the pose; the region shrinks by as much.
    tolerance: [m] by which the region may shrink to save corners.

    Assumed: the world stands still, and so does the sensor while its beams sweep, but for
    `uncertainty`; errors satisfy their bounds; all that a body may touch stands in the lidar's
    plane; and no object is narrower than `width` [m]: each is a union of discs of this diameter and
    squares of this side, however turned, so corners are not sharper than a square's. Between two
    beams with the gap g the nearer range R then holds, less how far a corner can reach out between
    them: R (cos g/2 - sin g/2), as far as they are closer to each other than width / √2. [T41b] A
    closed circle of beams is closed.

    Algorithm: a polygon with a corner a beam; the uncertainty of heading and beams by the least of
    all gaps that a direction may lie in, the uncertainty of place by `shrunk`. [T41c]
    """
    shapely = package("shapely", CALL)
    pose = as_float64(f"{CALL} pose (x, y, heading)", pose, (3,))
    require_near(f"{CALL} pose", pose[:2])
    angles = as_float64(f"{CALL} angles", angles, (None,))
    ranges = _finite(ranges, angles.shape)
    moved, turned = as_float64(f"{CALL} uncertainty ([m], [rad])", uncertainty, (2,))
    _check(angles, ranges, moved, turned)
    limits = {"noise": noise, "angle_error": angle_error, "tolerance": tolerance}
    for name, value in limits.items():
        if not (np.isfinite(value) and value >= 0):
            raise InputError(f"{CALL}: expected {name} >= 0; got {value!r:.40}.")
    for name, value in {"max_range": max_range, "width": width}.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{CALL}: expected {name} > 0 m; got {value!r:.40}.")
    sure = np.maximum(np.minimum(ranges, max_range) - noise, 0.0)
    ends = np.where((0 < ranges) & (ranges < max_range), ranges, np.inf)
    _, ends, _ = _closed(angles, ends)
    angles, sure, closed = _closed(angles, sure)
    more = _off(angles, angle_error + turned)
    reach = _between(angles, sure, angle_error, more, width, closed)
    star = _star(shapely, pose, angles, reach, closed)
    off = noise + moved + (angle_error + turned) * np.where(np.isfinite(ends), ends, 0.0)
    place, directions = pose[:2], pose[2] + angles
    beams = Beams(place, directions, reach, ends, off, moved, more, closed)
    return FreeSpace(shrunk(star, moved + TOLERANCES.outline, tolerance), width, beams=beams)


def _off(angles: Float[np.ndarray, " n"], by: float) -> int:
    """The bound of the error of a direction [rad], in beams."""
    return int(min(np.ceil(by / np.diff(angles).min() - 1e-9), len(angles) - 1))


def _closed(angles: Float[np.ndarray, " n"], sure: Float[np.ndarray, " n"]):
    """Beams with the first one repeated after a full turn, if that gap is like the others."""
    rest = angles[0] + 2 * np.pi - angles[-1]
    if rest > 1.5 * np.diff(angles).max():
        return angles, sure, False
    if rest < SAME:
        first = min(sure[0], sure[-1])
        angles, sure = angles[:-1], np.append(first, sure[1:-1])
    return np.append(angles, angles[0] + 2 * np.pi), np.append(sure, sure[0]), True


def _between(
    angles: Float[np.ndarray, " n"],
    sure: Float[np.ndarray, " n"],
    angle_error: float,
    more: int,
    width: float,
    closed: bool,
):
    """(n,) [m] range up to which both gaps beside a beam are free. [T41b]"""
    gaps = np.diff(angles)
    half = gaps / 2 + angle_error
    near = np.minimum(sure[:-1], sure[1:])
    near = np.minimum(near, width / (np.sqrt(8) * np.sin(np.minimum(half, np.pi / 2))))
    near = near * np.maximum(np.cos(half) - np.sin(half), 0.0)
    # a direction may truly lie in so many gaps more; beyond the ends of a scan nothing is known
    wide = np.pad(near, more + 1, mode="wrap" if closed else "constant")
    if not closed:
        wide[more], wide[-more - 1] = near[0], near[-1]
    return np.lib.stride_tricks.sliding_window_view(wide, 2 * more + 2).min(axis=1)


def _star(
    shapely: ModuleType,
    pose: np.ndarray,
    angles: Float[np.ndarray, " n"],
    reach: Float[np.ndarray, " n"],
    closed: bool,
):
    """The polygons between beams that reach anywhere."""
    directions = pose[2] + angles
    ends = pose[:2] + reach[:, None] * np.stack([np.cos(directions), np.sin(directions)], axis=1)
    if closed and (reach > 0).all():
        return shapely.Polygon(ends[:-1])
    runs = np.split(np.arange(len(reach)), np.flatnonzero(reach == 0))
    runs = [run[reach[run] > 0] for run in runs]
    fans = [np.concatenate([pose[None, :2], ends[run]]) for run in runs if len(run) > 1]
    return shapely.union_all([shapely.Polygon(fan) for fan in fans])


def _finite(ranges: npt.ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    lost = ~np.isfinite(np.asarray(ranges, np.float64))
    if lost.any():
        raise InputError(
            f"{CALL} ranges: expected finite numbers; got {lost.sum()} that are not. A beam that "
            "came back from nowhere reads max_range, one that failed reads 0."
        )
    return as_float64(f"{CALL} ranges", ranges, shape)


def _check(angles: np.ndarray, ranges: np.ndarray, moved: float, turned: float) -> None:
    if len(angles) < 2 or not (np.diff(angles) > 0).all() or np.ptp(angles) > 2 * np.pi + SAME:
        raise InputError(
            f"{CALL}: expected two or more increasing angles, over a full turn at most [rad]; got "
            f"{len(angles)} over {np.ptp(angles) if len(angles) else 0:g}. Are they degrees, or a "
            "lidar that turns clockwise?"
        )
    if (ranges < 0).any():
        raise InputError(f"{CALL}: expected ranges >= 0 m; got {ranges.min():g}.")
    if moved < 0 or turned < 0:
        raise InputError(
            f"{CALL}: expected an uncertainty of lengths >= 0; got ({moved:g}, {turned:g})."
        )
