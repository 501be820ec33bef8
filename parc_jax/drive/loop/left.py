"""Did a robot leave the tube of any manoeuvre, up to when it left the manoeuvre, and where may one
lead? [T38, T40]
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.learning.bound.measure import allowance, score_arrays
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import trajectories
from parc_jax.problem.body import Disc, parts_of
from parc_jax.problem.robust.pose import Pose

if TYPE_CHECKING:
    import shapely

AT_ONCE = 64  # manoeuvres looked at in one compiled call
ROUNDED = (
    1e-9  # [m] more than floats round places up to 1e5 m by: a pose this far outside is inside
)
WHOLE = 1e-6  # records: a manoeuvre that begins so near to one begins there


def left_tube(
    commitments: Sequence[Commitment], path: ArrayLike, heading: ArrayLike | None = None
) -> bool:
    """Did the robot leave a tube in an episode, at any record of what was driven of a manoeuvre? In
    uncertainty yes: a run that rounding might have put outside, or that is not finite, counts.

    commitments: of one loop, in their order. path: where it truly was at the clock's times 0, d,
    2 d, ..., d the time between records of the model: places of its reference points
    (n, points, n_p), of one point (n, n_p) [m]. heading (n,) [rad]: of a robot whose poses have
    one.
    The last manoeuvre counts up to the end of the path. What is left at the end are other goal
    states (q), which only `end` asks for. Raises InputError.
    """
    if not commitments:
        return False
    model = commitments[0].asked.query.model
    if any(one.asked.query.model is not model for one in commitments):
        raise InputError("left_tube: expected commitments of one loop; got some of another model.")
    turns = commitments[0].asked.pose.heading is not None
    path = _path(model, path)
    heading = np.zeros(len(path)) if heading is None else heading
    heading = as_float64("left_tube: heading", np.where(turns, heading, 0.0), (len(path),))
    begin = [_record(one, model.time.dt_record, len(path)) for one in commitments]
    k = np.stack([one.k for one in commitments])
    knots, q = trajectories(model.net, model.layout, k)
    p = _between(knots, model.time.stride)
    for i, (first, last) in enumerate(zip(begin, [*begin[1:], len(path) - 1], strict=True)):
        n = min(last - first, model.time.n_record) + 1
        p[i, :n] = _seen_from(path[first : first + n], heading[first])
    slack = allowance(model.net, model.domain, model.layout)
    score = []
    for i in range(0, len(k), AT_ONCE):
        some = np.minimum(np.arange(i, i + AT_ONCE), len(k) - 1)
        score.append(score_arrays(model.net, slack, model.tube, k[some], p[some], q[some])[0])
    return not bool((np.concatenate(score) <= 1.0).all())


def outside_tube(last: Commitment, pose: Pose, at: Fraction, k: np.ndarray) -> float:
    """[m] from where a measured pose puts the robot to where a manoeuvre may have led by a time of
    the clock: of its reference points the farthest. 0 for none. [T38]

    k (n_k,): any with what was measured with the pose; its start says where the other points are.
    What may be is a box around the tube, grown by the uncertainty of both poses and ROUNDED. A
    heading shows in the other points alone: of a robot of one point it is not looked at.
    """
    asked, begun = last.asked.query, last.asked.pose
    model, uncertainty = asked.model, asked.problem.uncertainty
    tube, n_p, steps = model.tube, model.n_p, model.time.n_steps
    (knots, starts), _ = trajectories(model.net, model.layout, np.stack([last.k, k]))
    passed = min(float((at - last.begin) / Fraction(model.time.dt)), float(steps))
    before = min(int(passed), steps - 1)
    way = knots[before] + (passed - before) * (knots[before + 1] - knots[before])
    heading = begun.heading or 0.0
    around = _turned(starts[0].reshape(-1, n_p), heading - (pose.heading or 0.0))
    there = _turned(pose.place - begun.place, heading) + around
    at_start = tube.interval[tube.bins_of(k[None])[0], 0].max(axis=0)
    at_start[:n_p] = 0.0  # of the first point, which is where the pose is
    allowed = tube.interval[tube.bins_of(last.k[None])[0], before].max(axis=0) + at_start
    allowed = allowed.reshape(-1, n_p) + ROUNDED
    if uncertainty is not None:
        far = np.linalg.norm(there, axis=1) + np.linalg.norm(around, axis=1)
        turned = float(uncertainty.heading or 0.0) * far[:, None]
        allowed = allowed + 2 * uncertainty.shifts(n_p).sum() + turned
    beyond = np.maximum(np.abs(there - way.reshape(-1, n_p)) - allowed, 0.0)
    return float(np.linalg.norm(beyond, axis=1).max())


def leads_to(last: Commitment, region: "shapely.Geometry") -> bool:
    """May any of the body be in a region of the plane during a manoeuvre? If unsure, yes: the hull
    of all its points in each interval, grown by all that tube, uncertainty and body allow.
    """
    if region.is_empty:
        return False
    from shapely import MultiPoint

    asked, begun = last.asked.query, last.asked.pose
    model, uncertainty = asked.model, asked.problem.uncertainty
    knots, _ = trajectories(model.net, model.layout, last.k[None])
    away = knots[0].reshape(-1, model.n_points, model.n_p)
    places = begun.place + _turned(away, -(begun.heading or 0.0))
    shapes = [part.shape for part in parts_of(asked.problem.body)]
    grown = max(
        one.radius if isinstance(one, Disc) else np.linalg.norm(one.vertices, axis=1).max()
        for one in shapes
    )
    if uncertainty is not None:
        far = np.linalg.norm(away, axis=-1).max()
        grown += uncertainty.shifts(model.n_p).sum() + float(uncertainty.heading or 0.0) * far
    widths = model.tube.interval[model.tube.bins_of(last.k[None])[0]].max(axis=0)
    for both, width in zip(pairwise(places), widths, strict=True):
        off = np.linalg.norm(width.reshape(model.n_points, -1), axis=1).max()
        if MultiPoint(np.concatenate(both)).convex_hull.distance(region) <= grown + off:
            return True
    return False


def _path(model: TrajectoryModel, path: ArrayLike) -> np.ndarray:
    """(n, points, n_p); what is not finite has left every tube. Raises InputError."""
    path = np.asarray(path, np.float64)
    shape = (model.n_points, model.n_p)
    if path.ndim < 2 or path.shape[1:] not in (shape, (model.n_p,) if shape[0] == 1 else shape):
        raise InputError(
            f"left_tube: expected places of {shape[0]} points in {shape[1]} axes at each record, "
            f"(n, {shape[0]}, {shape[1]}); got shape {path.shape}."
        )
    return path.reshape(len(path), *shape)


def _record(one: Commitment, step: float, n: int) -> int:
    """The record at which a manoeuvre began. Raises InputError."""
    number = float(one.begin) / step
    nearest = round(number)
    if abs(number - nearest) > WHOLE * max(1.0, abs(number)) or not 0 <= nearest < n:
        raise InputError(
            f"left_tube: expected manoeuvres that began at records of the path, every {step:g} s "
            f"from 0 to {step * (n - 1):g} s; number {one.number} began at {float(one.begin):g} s."
        )
    return nearest


def _between(knots: np.ndarray, stride: int) -> np.ndarray:
    """(n, n_record + 1, n_c) from knots (n, T + 1, n_c), straight in between."""
    share = (np.arange(stride) / stride)[:, None]
    a, b = knots[:, :-1, None], knots[:, 1:, None]
    within = (a * (1 - share) + b * share).reshape(len(knots), -1, knots.shape[-1])
    return np.concatenate([within, knots[:, -1:]], axis=1)


def _seen_from(path: np.ndarray, heading: float) -> np.ndarray:
    """(n, n_c) from the place of the first point at the start, with the heading there."""
    return _turned(path - path[0, 0], heading).reshape(len(path), -1)


def _turned(away: np.ndarray, heading: float) -> np.ndarray:
    """(..., n_p) from the world into a frame with this heading."""
    if not heading:
        return away
    cosine, sine = np.cos(heading), np.sin(heading)
    return away @ np.array([[cosine, -sine], [sine, cosine]])
