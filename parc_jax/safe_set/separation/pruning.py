"""Pruned pairs of an obstacle and a part: one direction separates them in every interval, for all
plans that reach the goal. [T11, T14, T19]

The reachable envelope is a box per knot around all predicted places. A plan that counts ends in the
goal, so its first point ends in the goal's box, and interval arithmetic over small boxes of K
bounds all other places against that end. Each bound is as wide as rounding may make it:
`Scene.slack` covers every sum of the network's outputs.

The direction is the normal of a row of the obstacle, whose offset bounds the support, so no corner
is needed. Pruned pairs are left out of a scene's arrays, and their directions go into every
certificate, where the checkers verify them as any other.
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from jaxtyping import Int

from parc_jax.common.arrays import once
from parc_jax.common.sets.hull import corners_of_many
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.model import TrajectoryModel, float_slack
from parc_jax.learning.network.predict import layer_from_the_end
from parc_jax.learning.network.rounding import UNIT, over_pieces
from parc_jax.problem.body import Part, numbered
from parc_jax.problem.problem import Problem, box_of_rows, goal_box, require_dimensions
from parc_jax.safe_set.separation.directions import Multiplier, Run, body_support
from parc_jax.safe_set.separation.inequality import excess
from parc_jax.safe_set.separation.pairs import corners, exists

BOXES = 1024  # about so many boxes of K, alike along all axes


def ways_of(model: TrajectoryModel) -> tuple[np.ndarray, np.ndarray]:
    """Bounds lo, hi (T + 1, n_c) [m] on the places of all points relative to the end of the first
    one, for all plans with k in K, up to the rounding of the network.
    """
    shape = (model.layout.n_steps + 1, model.n_c)
    W, b = (x[: shape[0] * shape[1]] for x in layer_from_the_end(model.net, model.layout))
    lo, hi = over_pieces(model.net, model.domain, BOXES, W, b)
    return lo.min(axis=0).reshape(shape), hi.max(axis=0).reshape(shape)


# [units in the last place] of the sizes of all terms: rounding of one inequality, of few operations
ROUNDING = 64


class Extent(NamedTuple):
    """The reachable envelope of points during intervals.

    lo, hi: (T, n_points, n_p) [m] around all predicted places at both knots, rounding included.
    error: (T, n_points, n_p) [m], half widths of boxes around the errors of any bin.
    """

    lo: np.ndarray
    hi: np.ndarray
    error: np.ndarray


class Apart(NamedTuple):
    """The pairs of a problem, obstacle by obstacle and part by part, and which of them are pruned.

    kept: (n,) numbers of the remaining pairs.
    row: (pairs,) of a pruned pair the row of the obstacle that separates it, -1 for the others.
    spans: (pairs, 2) first and last interval in which each exists.
    beyond: [m] a bound on the distance of all plans from the pruned pairs.
    """

    kept: np.ndarray
    row: np.ndarray
    spans: np.ndarray
    beyond: float

    def with_runs(self, own: Sequence[list[Run]]) -> list[list[Run]]:
        """The runs of all pairs, given those of the remaining ones."""
        out = [
            [Run(int(first), int(last) + 1, Multiplier((int(row),), (Fraction(1),)))]
            for row, (first, last) in zip(self.row, self.spans, strict=True)
        ]
        for pair, runs in zip(self.kept, own, strict=True):
            out[pair] = runs
        return out


def prune(problem: Problem, model: TrajectoryModel) -> Apart | None:
    """The pairs that one row separates from every plan that reaches; None where there are none.

    Raises InputError where the problem does not fit the model.
    """
    require_dimensions(problem, model)
    return apart(problem, model, *extent_in(problem, model))


def extent_in(problem: Problem, model: TrajectoryModel) -> tuple[Extent, float]:
    """The reachable envelope of points of plans that reach, and slack [m] of inequalities about it.

    Such a plan ends in the goal with any error that its bin allows, so it is predicted to end in
    the goal's box moved back by all of these errors.
    """
    tube, n_p = model.tube, model.n_p
    claimed = tube.claimed  # in the other bins nothing reaches
    goal_lo, goal_hi = (x[:n_p] for x in goal_box(problem.goal, model.layout))
    final = at(tube.final_errors, (claimed, None))
    axes = np.eye(n_p, tube.final.shape[1])
    most = final.support(axes).max(axis=0, initial=0.0)
    least = -final.support(-axes).max(axis=0, initial=0.0)
    starts = np.full(n_p, -np.inf), np.full(n_p, np.inf)  # anywhere
    if problem.start is not None:
        starts = box_of_rows(problem.start)
    sizes = np.abs([goal_lo, goal_hi, most, least, *starts])
    slack = float(float_slack(model, sizes[np.isfinite(sizes)].max()))
    lo, hi = (side.reshape(len(side), -1, n_p) for side in once(model, ways_of))
    end_lo = np.maximum(goal_lo - most, starts[0] - hi[0, 0])
    end_hi = np.minimum(goal_hi - least, starts[1] - lo[0, 0])
    lo, hi = lo + end_lo - 2 * slack, hi + end_hi + 2 * slack
    widest = tube.interval[claimed].max(axis=0, initial=0.0)
    lo, hi = np.minimum(lo[:-1], lo[1:]), np.maximum(hi[:-1], hi[1:])
    return Extent(lo, hi, widest.reshape(lo.shape)), slack


def apart(problem: Problem, model: TrajectoryModel, extent: Extent, slack: float) -> Apart | None:
    """Prune the pairs that one row separates; None where none is.

    extent: where the points can be.
    slack: [m] per unit of |w|_1, which every inequality pays.
    Raises InputError for an obstacle that exists too late, is empty or unbounded.
    """
    parts = numbered(problem.body, model.points)
    n, n_parts = len(problem.obstacles), len(parts)
    spans = spans_of(problem, model.time.n_steps)
    _check_obstacles(problem, spans, model.time.n_steps)
    room = np.full((n, n_parts), -np.inf)
    row = np.full((n, n_parts), -1)
    known = np.isfinite(extent.lo).all() and np.isfinite(extent.hi).all()
    for p, part in enumerate(parts if n and known else ()):
        lo, hi, error = own = Extent(*(x[:, list(part.points)] for x in extent))
        whole = Extent(lo.min(axis=0)[None], hi.max(axis=0)[None], error.max(axis=0)[None])
        room[:, p], row[:, p] = _settled(problem, np.arange(n), part, whole, slack, None)
        # far away from all times' box at once, or looked at interval by interval
        close = np.flatnonzero(room[:, p] <= 0)
        if len(close):
            found = _settled(problem, close, part, own, slack, spans[close])
            room[close, p], row[close, p] = found
    settled = (room > 0).ravel()
    beyond = float(room.ravel()[settled].min(initial=np.inf))
    if not np.isfinite(beyond):
        return None
    kept, rows = np.flatnonzero(~settled), np.where(settled, row.ravel(), -1)
    return Apart(kept, rows, np.repeat(spans, n_parts, axis=0), beyond)


def _check_obstacles(problem: Problem, spans: np.ndarray, n_steps: int) -> None:
    """Raises InputError for an obstacle that exists too late, is empty or unbounded."""
    for j in np.flatnonzero(spans[:, 1] >= n_steps):
        exists(problem, int(j), n_steps)
    # polygons with corners, and boxes as `from_box` writes them, are neither: no need for LPs
    sides = np.zeros((0, 0))
    known = corners_of_many(problem.obstacles)
    for j, obstacle in enumerate(problem.obstacles):
        n = obstacle.n
        if known[j] is not None:
            continue
        if len(sides) != 2 * n:
            sides = np.concatenate([np.eye(n), -np.eye(n)])
        boxed = obstacle.A.shape == sides.shape and (obstacle.A == sides).all()
        if not (boxed and (obstacle.b[:n] >= -obstacle.b[n:]).all()):
            corners(obstacle, f"obstacle {j}")


def spans_of(problem: Problem, n_steps: int) -> np.ndarray:
    """(o, 2) first and last interval in which each obstacle exists."""
    every = (0, n_steps - 1)
    return np.array([span or every for span in problem.all_spans], int).reshape(-1, 2)


def _settled(
    problem: Problem,
    some: np.ndarray,
    part: Part,
    extent: Extent,
    slack: float,
    spans: Int[np.ndarray, "s 2"] | None,
):
    """Of some obstacles (numbers) the gap [m] that the best of their rows leaves to a part, and
    that row. spans: intervals that count, None for all.
    """
    chosen = [problem.obstacles[j] for j in some]
    rows = np.array([len(o.b) for o in chosen])
    A, b = np.concatenate([o.A for o in chosen]), np.concatenate([o.b for o in chosen])
    gap = _gap(A, b, part, extent, slack)
    if spans is not None:
        at = np.arange(gap.shape[1])
        counts = (at >= spans[:, :1]) & (at <= spans[:, 1:])
        gap = np.where(np.repeat(counts, rows, axis=0), gap, np.inf)
    gap = gap.min(axis=1)
    first = np.cumsum(rows) - rows
    best = np.maximum.reduceat(gap, first)
    place = np.where(gap == np.repeat(best, rows), np.arange(len(gap)), len(gap))
    return best, np.minimum.reduceat(place, first) - first


def _gap(A: np.ndarray, b: np.ndarray, part: Part, extent: Extent, slack: float) -> np.ndarray:
    """(rows, T) [m] least gap of a part and the obstacle along the normal."""
    up, down, size = np.maximum(A, 0.0), np.minimum(A, 0.0), np.abs(A)
    threshold = b + body_support(part.shape, A)
    by_point = zip(*(x.swapaxes(0, 1) for x in extent), strict=True)
    rooms = [excess([up @ lo.T + down @ hi.T], size @ error.T) for lo, hi, error in by_point]
    farthest = (np.maximum(np.abs(extent.lo), np.abs(extent.hi)) + extent.error).max()
    terms = size.max(axis=1) * A.shape[1] * farthest + np.abs(threshold)
    paid = threshold + slack * size.sum(axis=1) + ROUNDING * UNIT * terms
    length = np.hypot.reduce(A, axis=1) * (1 + ROUNDING * UNIT)
    return excess([np.minimum.reduce(rooms)], paid[:, None]) / length[:, None]
