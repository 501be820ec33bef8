"""The region that a lidar scan proves free under bounded errors. [T41, T44]"""

import numpy as np
import numpy.typing as npt
from jaxtyping import Bool, Float

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.world.free_space import Beams, FreeSpace, shrunk
from parc_jax.problem.world.outlines import package, require_near, require_turn

CALL = "seen_from"
FAR = 2  # times max_range: a reading beyond it is no noise
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

    pose: (x, y, heading) [m, rad] of the sensor, in a fixed frame; of ten turns at most.
    angles: (n,) [rad] of the beams against its heading, increasing, over a full turn at most.
    ranges: (n,) [m] finite; max_range, up to noise more, or one number beyond: no return, free up
        to max_range; 0: failed or blocked.
    noise: [m] bound of |range - truth|. angle_error: [rad] bound for each beam.
    uncertainty: ([m], [rad]) bounds of the error of the pose; the region shrinks by as much.
    tolerance: [m] by which the region may shrink to save corners.

    Assumed: the world stands still, and so does the sensor while its beams sweep, but for
    `uncertainty`; errors satisfy their bounds; all that a body may touch stands in the lidar's
    plane; and no object is narrower than `width` [m]: each is a union of discs of this diameter and
    squares of this side, however turned, so corners are not sharper than a square's. Between two
    beams with the gap g the nearer range R then holds, less how far a corner can reach out between
    them: R (cos g/2 - sin g/2), as far as they are closer to each other than width / √2. [T41b] So
    a beam that ends alone, before both beside it, is false. A closed circle of beams is closed.

    Algorithm: a polygon with a corner a beam; the uncertainty of heading and beams by the least of
    all gaps that a direction may lie in, the uncertainty of place by `shrunk`. [T41c]
    """
    pose = as_float64(f"{CALL} pose (x, y, heading)", pose, (3,))
    require_near(f"{CALL} pose", pose[:2])
    require_turn(f"{CALL} heading", pose[2], 10)  # of odometry that counts them
    angles = as_float64(f"{CALL} angles", angles, (None,))
    max_range, noise, width, angle_error, tolerance = as_float64(
        f"{CALL} max_range, noise, width, angle_error, tolerance",
        [max_range, noise, width, angle_error, tolerance],
        (5,),
    )
    told = np.asarray(ranges)
    if told.dtype.kind == "f" and (lost := ~np.isfinite(told)).any():
        raise InputError(
            f"{CALL} ranges: expected finite numbers; got {lost.sum()} that are not. A beam that "
            "came back from nowhere reads max_range, one that failed reads 0."
        )
    ranges = as_float64(f"{CALL} ranges", ranges, angles.shape)
    moved, turned = as_float64(f"{CALL} uncertainty ([m], [rad])", uncertainty, (2,))
    if len(angles) < 2 or not (np.diff(angles) > 0).all() or np.ptp(angles) > 2 * np.pi + SAME:
        raise InputError(
            f"{CALL}: expected two or more increasing angles, over a full turn at most [rad]; got "
            f"{len(angles)} over {np.ptp(angles) if len(angles) else 0:g}. Are they degrees, or a "
            "lidar that turns clockwise?"
        )
    least = {"ranges >= 0 m": ranges.min(), "noise >= 0": noise, "angle_error >= 0": angle_error}
    least |= {"tolerance >= 0": tolerance, "uncertainty >= 0": min(moved, turned)}
    least |= {"max_range > 0 m": max_range, "width > 0 m": width}
    for condition, value in least.items():
        if not (value > 0 or (value == 0 and ">=" in condition)):
            raise InputError(f"{CALL}: expected {condition}; got {value:g}.")
    if len(far := np.unique(ranges[ranges > max_range + noise])) > 1:
        # what is cut to max_range says free: never of numbers that may be of another unit
        few = (ranges[ranges > 0] >= far[0]).mean() < 0.5 or far[-1] < FAR * max_range
        raise InputError(
            f"{CALL} ranges: expected at most one number above max_range, {max_range:g} m, for no "
            f"return; got {len(far)}, {far[0]:g} to {far[-1]:g}. "
            + ("If in m: np.minimum(ranges, max_range)." if few else "Are they millimetres?")
        )
    sure = np.maximum(np.minimum(ranges, max_range) - noise, 0.0)
    ends = np.where((0 < ranges) & (ranges < max_range), ranges, np.inf)
    angles, (sure, ends), closed = _closed(angles, np.stack([sure, ends]))
    # the bound of the error of a direction, in beams
    more = int(min(np.ceil((angle_error + turned) / np.diff(angles).min() - 1e-9), len(angles) - 1))
    told = (sure > 0) | np.isfinite(ends)
    reach = _between(angles, sure, told, angle_error, more, width, closed)
    ends = np.where(ends + noise < reach, np.inf, ends)  # false: nothing stands there
    star = _star(pose, angles, reach, closed)
    off = (angle_error + turned) * np.where(np.isfinite(ends), ends, 0.0)
    off += noise + moved + TOLERANCES.outline  # never nothing: what has no size is in no region
    beams = Beams(pose[:2], pose[2] + angles, reach, ends, off, moved, more, closed)
    told = {"noise": noise, "angle_error": angle_error, "place": moved, "heading": turned}
    told["max_range"] = max_range
    region = shrunk(star, moved + TOLERANCES.outline, tolerance)
    return FreeSpace(region, width, beams=beams, bounds={x: (y,) for x, y in told.items()})


def _closed(angles: Float[np.ndarray, " n"], ranges: Float[np.ndarray, "2 n"]):
    """Beams with the first one repeated after a full turn, if that gap is like the others."""
    rest = angles[0] + 2 * np.pi - angles[-1]
    if rest > 1.5 * np.diff(angles).max():
        return angles, ranges, False
    if rest < SAME:
        first = np.minimum(ranges[:, :1], ranges[:, -1:])
        angles, ranges = angles[:-1], np.concatenate([first, ranges[:, 1:-1]], axis=1)
    ranges = np.concatenate([ranges, ranges[:, :1]], axis=1)
    return np.append(angles, angles[0] + 2 * np.pi), ranges, True


def _between(
    angles: Float[np.ndarray, " n"],
    sure: Float[np.ndarray, " n"],
    told: Bool[np.ndarray, " n"],
    angle_error: float,
    more: int,
    width: float,
    closed: bool,
):
    """(n,) [m] range up to which both gaps beside a beam are free. [T41b]"""
    gaps = np.diff(angles)

    def free(gaps: np.ndarray, apart: int) -> np.ndarray:
        half = gaps / 2 + angle_error
        near = np.minimum(sure[:-apart], sure[apart:])
        near = np.minimum(near, width / (np.sqrt(8) * np.sin(np.minimum(half, np.pi / 2))))
        return near * np.maximum(np.cos(half) - np.sin(half), 0.0)

    near = free(gaps, 1)
    if len(gaps) > 1 and 2 * angle_error < gaps.min():  # beams are in order
        # nothing of this width ends one beam and neither of those beside it
        over = free(gaps[:-1] + gaps[1:], 2) * told[1:-1]  # one that failed frees nothing
        near = np.maximum(near, np.maximum(np.append(over, 0.0), np.insert(over, 0, 0.0)))
    # a direction may truly lie in so many gaps more; beyond the ends of a scan nothing is known
    wide = np.pad(near, more + 1, mode="wrap" if closed else "constant")
    if not closed:
        wide[more], wide[-more - 1] = near[0], near[-1]
    return np.lib.stride_tricks.sliding_window_view(wide, 2 * more + 2).min(axis=1)


def _star(
    pose: np.ndarray, angles: Float[np.ndarray, " n"], reach: Float[np.ndarray, " n"], closed: bool
):
    """The polygons between beams that reach anywhere."""
    shapely, directions = package("shapely", CALL), pose[2] + angles
    ends = pose[:2] + reach[:, None] * np.stack([np.cos(directions), np.sin(directions)], axis=1)
    if closed and (reach > 0).all():
        return shapely.Polygon(ends[:-1])
    runs = np.split(np.arange(len(reach)), np.flatnonzero(reach == 0))
    runs = [run[reach[run] > 0] for run in runs]
    fans = [np.concatenate([pose[None, :2], ends[run]]) for run in runs if len(run) > 1]
    return shapely.union_all([shapely.Polygon(fan) for fan in fans])
