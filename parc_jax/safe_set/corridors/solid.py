"""Vertices, volumes and uniform samples of safe polytopes: bounded polytopes with a known inner
point.
"""

from typing import NamedTuple

import numpy as np

from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.qhull import convex_hull, delaunay, halfspace_intersection, scaled_around


class Solid(NamedTuple):
    """A polytope in the round. polytope: without redundant rows. vertices (v, n). volume: [product
    of the axis units].

    simplices (s, n + 1): vertex indices of a triangulation. weights (s,): share of the volume in
    each simplex.
    """

    polytope: HPolytope
    vertices: np.ndarray
    volume: float
    simplices: np.ndarray
    weights: np.ndarray


def solid(polytope: HPolytope, inside: np.ndarray) -> Solid | None:
    """Vertices, volume, triangulation. None when the set is too thin for floating-point geometry.

    inside (n,): a point strictly inside. Coordinates are centred on it and scaled per axis before
    qhull sees them.
    """
    if len(inside) == 1:
        return _segment(polytope)
    scaled = scaled_around(polytope.A, polytope.b, inside)
    if scaled is None:
        return None
    A, b, scale = scaled
    cut = halfspace_intersection(A, b, np.zeros(len(inside)))
    if cut is None:
        return None
    corners = np.unique(cut.intersections.round(12), axis=0)
    hull = convex_hull(corners)
    if hull is None:  # corners that share a facet up to rounding confuse qhull
        hull = convex_hull(corners, "QJ Pp")
    simplices = None if hull is None else _simplices(corners[hull.vertices])
    if simplices is None:
        return None
    needed = np.unique(np.concatenate([np.asarray(f) for f in cut.dual_facets]).astype(int))
    vertices = inside + corners[hull.vertices] * scale
    edges = vertices[simplices[:, 1:]] - vertices[simplices[:, :1]]
    sizes = np.abs(np.linalg.det(edges))
    volume = float(hull.volume * np.prod(scale))
    return Solid(
        HPolytope(polytope.A[needed], polytope.b[needed]),
        vertices,
        volume,
        simplices,
        sizes / sizes.sum(),
    )


def _segment(polytope: HPolytope) -> Solid | None:
    """A set on a line, between the nearest of its rows."""
    a, b = polytope.A[:, 0], polytope.b
    ends = b[a != 0] / a[a != 0]
    lo, hi = ends[a[a != 0] < 0].max(), ends[a[a != 0] > 0].min()
    if not lo < hi:
        return None
    rows = HPolytope(np.array([[1.0], [-1.0]]), np.array([hi, -lo]))
    return Solid(rows, np.array([[lo], [hi]]), hi - lo, np.array([[0, 1]]), np.ones(1))


def _simplices(vertices: np.ndarray) -> np.ndarray | None:
    """Triangulation (s, n + 1) of the hull of vertices (v, n); a simplex is its own, and qhull
    refuses it joggled.
    """
    v, n = vertices.shape
    if v == n + 1:
        return np.arange(v)[None]
    return delaunay(vertices, "QJ Pp")


def sample_solid(shape: Solid, rng: np.random.Generator, n: int) -> np.ndarray:
    """n points (n, d), uniform in the solid: a simplex by volume, then flat Dirichlet weights on
    its corners.
    """
    pick = rng.choice(len(shape.weights), n, p=shape.weights)
    weights = rng.dirichlet(np.ones(shape.simplices.shape[1]), n)
    return np.einsum("nc,ncd->nd", weights, shape.vertices[shape.simplices[pick]])
