"""Many tiny linear programs at once: the JAX kernel proposes, NumPy checks, the host solver decides
what is left.

Grown obstacles O + (-B) + box(e) as explicit polytopes with fixed normals, as the published
method needs them.

A disc body becomes the circumscribed polygon, so the sets are slightly larger than those of
`grown`, never smaller.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64, slices, x64
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import (
    dual_bound,
    gamma,
    proves_empty,
    round_up,
    row_bounds,
    violation,
)
from parc_jax.common.lp.interior import interior_point
from parc_jax.common.lp.program import LPStatus
from parc_jax.common.lp.solve import solve
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.rational import Point, convex_polygon, exact_support, rational_vertices
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.tube import Tube
from parc_jax.problem.body import Disc
from parc_jax.problem.problem import Problem

BODY_SIDES = 10  # of the polygon around a disc body, as published


@struct.dataclass
class GrownPolytopes:
    """All grown obstacles of a planar scene: o obstacles, T intervals, h rows, m corners. Padded
    rows read 0 <= 1.

    A: (o, h, 2) unit normals, shared by all intervals and bins. b: (n_bins, T, o, h) offsets,
        rounded up.
    corners: (o, m, 2) of obstacle + (-body), repeated to fill. error: (n_bins, T, 2) half widths of
        the error box.
    active: (o, T) bool.
    """

    A: np.ndarray
    b: np.ndarray
    corners: np.ndarray
    error: np.ndarray
    active: np.ndarray

    def at(self, bin_number: int, t: int, obstacle: int) -> HPolytope:
        """One grown obstacle, without padding."""
        rows = self.A[obstacle].any(axis=1)
        return HPolytope(self.A[obstacle][rows], self.b[bin_number, t, obstacle][rows])


def grown_polytopes(problem: Problem, tube: Tube) -> GrownPolytopes:
    """Grow every obstacle by the body and by the error of every interval and bin. Raises InputError
    off the plane.
    """
    n_steps = tube.n_steps
    n_p = tube.n_p
    if n_p != 2:
        raise InputError(f"grown obstacles: expected a planar workspace; got {n_p} dimensions.")
    body_normals, body_corners = _body(problem)
    grown = [_grow(obstacle, body_normals, body_corners) for obstacle in problem.obstacles]
    o = len(grown)
    height = max((len(one.normals) for one in grown), default=1)
    width = max((len(one.corners) for one in grown), default=1)
    A = np.zeros((o, height, 2))
    base = np.ones((o, height))
    corners = np.zeros((o, width, 2))
    active = np.zeros((o, n_steps), bool)
    for j, one in enumerate(grown):
        A[j, : len(one.normals)] = one.normals
        base[j, : len(one.normals)] = one.offsets
        corners[j] = one.corners + [one.corners[-1]] * (width - len(one.corners))
        span = problem.all_spans[j]
        first, last = (0, n_steps - 1) if span is None else span
        active[j, first : last + 1] = True
    gain = np.einsum("btp,ohp->btoh", tube.interval, np.abs(A))
    b = np.nextafter(base + gain + gamma(6) * (np.abs(base) + gain), np.inf)
    return GrownPolytopes(A, b, corners, tube.interval, active)


class _Grown(NamedTuple):
    """One obstacle + (-body): unit normals (h, 2), offsets (h,) rounded up, corners (m, 2)."""

    normals: np.ndarray
    offsets: list[float]
    corners: list[list[float]]


def _grow(obstacle: HPolytope, body_normals: np.ndarray, body_corners: list[Point]) -> _Grown:
    points = rational_vertices(obstacle)
    if not points:
        raise InputError(
            "grown obstacles: expected obstacles with points in them; one is empty. Remove it."
        )
    normals = _unit(np.concatenate([obstacle.A, body_normals, np.eye(2), -np.eye(2)]))
    offsets = [round_up(exact_support(points, w) + exact_support(body_corners, w)) for w in normals]
    sums = convex_polygon([(x + u, y + v) for x, y in points for u, v in body_corners])
    return _Grown(normals, offsets, [[float(x), float(y)] for x, y in sums])


def _body(problem: Problem) -> tuple[np.ndarray, list[Point]]:
    """Normals and exact corners of -body, or of a polygon around it."""
    if isinstance(problem.body, Disc):
        angle = 2 * np.pi * np.arange(BODY_SIDES) / BODY_SIDES
        normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        radius = np.nextafter(problem.body.radius * (1 + gamma(8)), np.inf)
        around = HPolytope(normals, np.full(BODY_SIDES, radius))
        return normals, rational_vertices(around)
    corners = convex_polygon(
        [(-Fraction(float(x)), -Fraction(float(y))) for x, y in problem.body.vertices]
    )
    points = np.array([[float(x), float(y)] for x, y in corners])
    edges = np.roll(points, -1, axis=0) - points
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    return normals[edges.any(axis=1)], corners


def _unit(w: np.ndarray) -> np.ndarray:
    """Rows of length one (to rounding), in order, without repeats."""
    w = w[w.any(axis=1)]
    w = w / np.linalg.norm(w, axis=1, keepdims=True)
    distinct = [i for i in range(len(w)) if not (np.abs(w[:i] - w[i]) < 1e-14).all(axis=1).any()]
    return w[distinct]


MAX_N = 10
_CHUNK = 1024  # most programs per compiled call: the working set stays in cache
# fewest; between the two, batches are padded to powers of two so that few shapes compile
_BUCKET = 64
_ROW_BUCKET = 8  # rows are padded to a multiple of this


@dataclass(frozen=True)
class LPBatch:
    """Answers to B linear programs; fields as in LPResult with a leading batch axis.

    status: (B,) int, values of LPStatus. x: (B, n). multipliers: (B, h). lower, upper: (B,).
    n_host: how many of them the batched kernel left to the host solver.
    """

    status: np.ndarray
    x: np.ndarray
    multipliers: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    n_host: int


def solve_batch(c, A, b, lo=None, hi=None) -> LPBatch:
    """min c.x over {A x <= b, lo <= x <= hi} for B programs of n <= 10 variables and h rows.

    c: (B, n). A: (B, h, n), or (h, n) shared by all. b: (B, h) or (h,). lo, hi: (B, n) or (n,),
    finite, or None. Verdicts as in `solve`, by the same checks. Give bounds where you know them:
    they are what a proof without rational arithmetic needs. Raises InputError.
    """
    c, A, b, lo, hi = _broadcast(c, A, b, lo, hi)
    x, y = propose(c, *_with_bound_rows(A, b, lo, hi))
    return _decide(c, A, b, lo, hi, x, y[:, : A.shape[1]])


def _broadcast(c, A, b, lo, hi):
    c = as_float64("LP batch c", c, (None, None))
    batch, n = c.shape
    if n > MAX_N:
        raise InputError(
            f"solve_batch: expected at most {MAX_N} variables; got {n}. Use `solve` one by one."
        )
    A = as_float64("LP batch A", A, (None, n) if np.ndim(A) == 2 else (batch, None, n))
    h = A.shape[-2]
    b = as_float64("LP batch b", b, (h,) if np.ndim(b) == 1 else (batch, h))
    bounds = []
    for name, bound, missing in (("lo", lo, -np.inf), ("hi", hi, np.inf)):
        if bound is not None:
            bound = as_float64(
                f"LP batch {name}", bound, (n,) if np.ndim(bound) == 1 else (batch, n)
            )
        bounds.append(np.broadcast_to(missing if bound is None else bound, (batch, n)))
    return c, np.broadcast_to(A, (batch, h, n)), np.broadcast_to(b, (batch, h)), *bounds


def _with_bound_rows(A, b, lo, hi):
    """Finite bounds as rows, so that the kernel sees them."""
    eye = np.broadcast_to(np.eye(A.shape[2]), (A.shape[0], A.shape[2], A.shape[2]))
    rows = [A]
    offsets = [b]
    if np.isfinite(hi).all():
        rows.append(eye)
        offsets.append(hi)
    if np.isfinite(lo).all():
        rows.append(-eye)
        offsets.append(-lo)
    return np.concatenate(rows, axis=1), np.concatenate(offsets, axis=1)


def propose(c, A, b):
    """Unchecked hints for c (B, n), A (B, h, n), b (B, h): points x (B, n) and multipliers y (B,
    h).

    y belongs to an optimum, or is a Farkas ray of size one. Nothing may rest on them without a
    check from `witness`.
    """
    batch, h, n = A.shape
    length = np.linalg.norm(A, axis=2)
    length = np.where(length > 0, length, 1.0)
    more = -h % _ROW_BUCKET
    A = np.pad(A / length[..., None], ((0, 0), (0, more), (0, 0)))
    b = np.pad(b / length, ((0, 0), (0, more)), constant_values=1.0)
    x = np.empty((batch, n))
    y = np.empty((batch, h + more))
    with x64():
        for part in slices(batch, _CHUNK):
            rows = np.arange(batch)[part]
            size = max(_BUCKET, 1 << (len(rows) - 1).bit_length())
            padded = np.pad(rows, (0, size - len(rows)), mode="edge")
            found = _kernel(jnp.asarray(c[padded]), jnp.asarray(A[padded]), jnp.asarray(b[padded]))
            x[part], y[part] = (np.asarray(array)[: len(rows)] for array in found)
    return x, y[:, :h] / length


@jax.jit
def _kernel(c, A, b):
    """c (B, n), A (B, h, n), b (B, h) -> x (B, n), y (B, h), divided by tau (optimum) or by the
    largest y (ray).
    """
    columns = jnp.transpose(A, (2, 1, 0))
    st = interior_point([*c.T], [*columns], b.T)
    solved = st.tau > st.kappa
    scale = jnp.where(solved, st.tau, st.y.max(0))
    return (jnp.stack(st.x) / st.tau[None]).T, (st.y / scale[None]).T


def _decide(c, A, b, lo, hi, x, y) -> LPBatch:
    """Statuses from witnesses; whatever has none goes to the host."""
    low, high = row_bounds(A, b, lo, hi)
    point = violation(x, A, b, lo, hi) <= TOLERANCES.lp_feasible
    value = np.where(point, np.einsum("bn,bn->b", c, np.where(point[:, None], x, 0.0)), np.inf)
    lower = dual_bound(c, A, b, y, low, high)
    empty = ~point & proves_empty(A, b, y, low, high, TOLERANCES.lp_margin)
    flat = ~c.any(axis=1)
    near = value - lower <= TOLERANCES.lp_gap * (1 + np.abs(np.where(point, value, 0.0)))
    status = np.full(len(c), int(LPStatus.UNKNOWN))
    status[point & flat] = int(LPStatus.FEASIBLE)
    status[point & ~flat & near] = int(LPStatus.OPTIMAL)
    status[empty] = int(LPStatus.INFEASIBLE)
    lower = np.where(empty, np.inf, np.where(flat, 0.0, lower))
    x = np.where(point[:, None], x, np.nan)
    left = np.flatnonzero(status == int(LPStatus.UNKNOWN))
    for i in left:
        one = solve(c[i], A[i], b[i], lo=lo[i], hi=hi[i])
        status[i] = int(one.status)
        x[i] = one.x
        y[i] = one.multipliers
        lower[i] = one.lower
        value[i] = one.upper
    return LPBatch(status, x, y, lower, value, len(left))
