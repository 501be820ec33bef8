"""Minkowski sum {x + y : x in P, y in Q}: how an obstacle grows. Offsets are rounded up."""

import numpy as np
from jaxtyping import Float

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import round_up
from parc_jax.common.lp.witness import gamma
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.rational import exact_support, rational_vertices
from parc_jax.neuralparc.sets.affine import Set, product
from parc_jax.neuralparc.sets.ahpolytope import as_ah


def minkowski_sum(p: Set, q: Set) -> Set:
    """The sum of any two sets, exact. Two boxes give a box (rounded outward), else an AH-polytope
    of stacked bases.
    """
    if p.n != q.n:
        raise InputError(f"minkowski_sum: expected two sets of one dimension; got {p.n} and {q.n}.")
    if isinstance(p, Box) and isinstance(q, Box):
        return Box(np.nextafter(p.lo + q.lo, -np.inf), np.nextafter(p.hi + q.hi, np.inf))
    both = product(as_ah(p), as_ah(q))
    return both.replace(G=both.G[: p.n] + both.G[p.n :], c=both.c[: p.n] + both.c[p.n :])


def grow(p: HPolytope, radius: Float[np.ndarray, "... n"]) -> HPolytope:
    """P plus the box [-radius, radius] along the rows of P: contains the sum, and equals it if P
    has the box's normals.

    p: h rows in R^n. radius: (..., n) >= 0. Returns b of shape (..., h). In the plane,
    `with_axis_rows` adds the four axis normals, so that the result is the sum itself.
    """
    gain = radius @ np.abs(p.A).T
    slack = gamma(p.n + 2) * (np.abs(p.b) + gain)
    return p.replace(b=np.nextafter(p.b + gain + slack, np.inf))


def polygon_sum(p: HPolytope, q: HPolytope) -> HPolytope:
    """Sum of two bounded polygons as an H-polytope: the normals of both, offsets from exact
    vertices, rounded up.

    In the plane every edge of the sum is parallel to an edge of one of them. Raises InputError if a
    set is empty or unbounded.
    """
    normals = np.concatenate([p.A, q.A])
    corners = [rational_vertices(s) for s in (p, q)]
    if not all(corners):
        raise InputError("polygon_sum: expected two sets with points in them; one is empty.")
    offsets = [round_up(sum(exact_support(points, w) for points in corners)) for w in normals]
    return HPolytope(normals, np.array(offsets))


def with_axis_rows(p: HPolytope) -> HPolytope:
    """The same bounded polygon with the four axis normals as (touching) rows added, rounded up."""
    axes = np.concatenate([np.eye(2), -np.eye(2)])
    corners = rational_vertices(p)
    if not corners:
        raise InputError("with_axis_rows: expected a set with points in it; it is empty.")
    offsets = np.array([round_up(exact_support(corners, w)) for w in axes])
    return HPolytope(np.concatenate([p.A, axes]), np.r_[p.b, offsets])
