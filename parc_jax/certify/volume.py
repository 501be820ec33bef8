"""Vertices, volumes and uniform samples of safe pieces: bounded polytopes with a known inner point."""

from typing import NamedTuple

import numpy as np

from parc_jax.sets.hpolytope import HPolytope


class Body(NamedTuple):
    """A piece in the round. polytope: without redundant rows. vertices (v, n). volume: [product of the axis units].

    simplices (s, n + 1): vertex indices of a triangulation. weights (s,): share of the volume in each simplex.
    """

    polytope: HPolytope
    vertices: np.ndarray
    volume: float
    simplices: np.ndarray
    weights: np.ndarray


def body(polytope: HPolytope, inside: np.ndarray) -> Body | None:
    """Vertices, volume, triangulation. None when the set is too thin for floating-point geometry.

    inside (n,): a point strictly inside. Coordinates are centred on it and scaled per axis before qhull sees them.
    """
    from scipy.spatial import HalfspaceIntersection, QhullError

    room = polytope.b - polytope.A @ inside
    if not (room > 0).all():
        return None
    size = np.abs(polytope.A)
    scale = np.where(size > 0, room[:, None] / np.where(size > 0, size, 1.0), np.inf).min(axis=0)
    A = polytope.A * scale
    try:
        cut = HalfspaceIntersection(np.column_stack([A, -room]), np.zeros(len(inside)))
        corners = np.unique(cut.intersections.round(12), axis=0)
        hull = _hull(corners)
        simplices = _simplices(corners[hull.vertices])
    except (QhullError, ValueError):
        return None
    needed = np.unique(np.concatenate([np.asarray(f) for f in cut.dual_facets]).astype(int))
    vertices = inside + corners[hull.vertices] * scale
    edges = vertices[simplices[:, 1:]] - vertices[simplices[:, :1]]
    sizes = np.abs(np.linalg.det(edges))
    volume = float(hull.volume * np.prod(scale))
    return Body(HPolytope(polytope.A[needed], polytope.b[needed]), vertices, volume, simplices, sizes / sizes.sum())


def _hull(corners: np.ndarray):
    """Qhull's hull of corners (v, n); joggled where corners that share a facet up to rounding confuse qhull."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(corners)
    except QhullError:
        return ConvexHull(corners, qhull_options="QJ Pp")


def _simplices(vertices: np.ndarray) -> np.ndarray:
    """Triangulation (s, n + 1) of the hull of vertices (v, n); a simplex is its own, and qhull refuses it joggled."""
    from scipy.spatial import Delaunay

    v, n = vertices.shape
    if v == n + 1:
        return np.arange(v)[None]
    return Delaunay(vertices, qhull_options="QJ Pp").simplices


def sample_body(shape: Body, rng: np.random.Generator, n: int) -> np.ndarray:
    """n points (n, d), uniform in the body: a simplex by volume, then flat Dirichlet weights on its corners."""
    pick = rng.choice(len(shape.weights), n, p=shape.weights)
    weights = rng.dirichlet(np.ones(shape.simplices.shape[1]), n)
    return np.einsum("nc,ncd->nd", weights, shape.vertices[shape.simplices[pick]])
