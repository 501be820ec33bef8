"""A polytope around vertices: rows of their convex hull, which hold every vertex exactly.

Sums of sets and of errors, rounded outward. The geometry of a solid: vertices, volume,
triangulation, uniform samples.

All calls of Qhull: its result, or None where it gives up. It works in floats, and nothing that must
be exact rests on it.

Corners of many polygons at once, in float64, with a bound of their error. Where two consecutive
rows meet at a small angle, or one cuts nothing off, a polygon needs exact arithmetic (`rational`).
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import round_down, round_up
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.common.sets.rational import Point, convex_polygon, exact_support, rational_vertices


def halfspace_intersection(A: np.ndarray, b: np.ndarray, inside: np.ndarray):
    """scipy's HalfspaceIntersection of {A x <= b}, A (h, n), around a point strictly inside (n,).

    None where the rows do not close around the point, or the set is too thin.
    """
    return _found("HalfspaceIntersection", np.column_stack([A, -b]), inside)


def convex_hull(points: np.ndarray, options: str | None = None):
    """scipy's ConvexHull of points (v, n); None for a flat hull."""
    return _found("ConvexHull", points, qhull_options=options)


def delaunay(points: np.ndarray, options: str | None = None) -> np.ndarray | None:
    """Simplices (s, n + 1) of the Delaunay triangulation of points (v, n); None for a flat hull."""
    found = _found("Delaunay", points, qhull_options=options)
    return None if found is None else found.simplices


def _found(kind: str, *data: np.ndarray, **options: str | None):
    from scipy import spatial

    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            return getattr(spatial, kind)(*data, **options)
    except (spatial.QhullError, ValueError):
        return None


def scaled_around(A: np.ndarray, b: np.ndarray, inside: np.ndarray):
    """Rows of {A x <= b} in coordinates y = (x - inside) / scale, in which thin sets look round.

    Returns A' (h, n), b' (h,) and scale (n,); None when `inside` is not strictly inside.
    """
    slack = b - A @ inside
    if not (slack > 0).all():
        return None
    size = np.abs(A)
    steps = np.where(size > 0, slack[:, None] / np.where(size > 0, size, 1.0), np.inf)
    scale = steps.min(axis=0)
    return A * scale, slack, scale


SINE = 0.05  # least of an angle at which two rows meet
# [largest coordinate] a corner may be off by: few roundings, divided by the least sine
OFF = 2.0**-44


def corners_of_many(polygons: Sequence[HPolytope]) -> list[np.ndarray | None]:
    """Corners (h, 2) of each polygon, counter-clockwise, all within OFF of its exact ones and none
    of these farther outside of their hull; None where exact arithmetic has to tell them, and for
    sets in space. A polygon with corners is bounded.
    """
    out: list[np.ndarray | None] = [None] * len(polygons)
    for some, A, b in alike(polygons):
        if A.shape[1] < 3 or A.shape[2] != 2:
            continue
        corners, known = _corners(A, b)
        for i, own, sure in zip(some, corners, known, strict=True):
            out[i] = own if sure else None
    return out


def alike(polytopes: Sequence[HPolytope]) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Those that have as many rows as one another: their numbers (m,), A (m, h, n), b (m, h)."""
    rows = np.array([len(p.b) for p in polytopes], int)
    for h in np.unique(rows):
        some = np.flatnonzero(rows == h)
        chosen = [polytopes[i] for i in some]
        yield some, np.stack([p.A for p in chosen]), np.stack([p.b for p in chosen])


def _corners(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (m, h, 2) of polygons A (m, h, 2), b (m, h), and (m,) bool: they are within OFF."""
    length = np.hypot(A[..., 0], A[..., 1])
    normal = A / length[..., None]
    order = np.argsort(np.arctan2(normal[..., 1], normal[..., 0]), axis=1, kind="stable")
    normal = np.take_along_axis(normal, order[..., None], axis=1)
    offset = np.take_along_axis(b / length, order, axis=1)
    following = np.roll(normal, -1, axis=1)
    bound = np.roll(offset, -1, axis=1)
    sine = normal[..., 0] * following[..., 1] - normal[..., 1] * following[..., 0]
    known = (sine > SINE).all(axis=1)
    divisor = np.where(sine > SINE, sine, 1.0)
    x = (offset * following[..., 1] - bound * normal[..., 1]) / divisor
    y = (bound * normal[..., 0] - offset * following[..., 0]) / divisor
    heights = normal[..., 0, None] * x[:, None] + normal[..., 1, None] * y[:, None]
    size = np.abs([x, y]).max(axis=(0, 2))
    inside = heights <= (offset + OFF * size[:, None])[..., None]
    return np.stack([x, y], axis=-1), known & inside.all(axis=(1, 2)) & np.isfinite(size)


SHARP = 1e-6  # [rad, about] a corner that is sharper may open where its normals are rounded


def polytope_around(vertices, name: str = "vertices") -> HPolytope:
    """The convex hull of vertices (v, n), or a little more: never less, so an obstacle only grows.

    In the plane vertices may lie on a line, or all in one place. Raises InputError, which begins
    with `name`, for fewer than two dimensions, or a flat hull in space.

    Algorithm: normals in the plane from the exact hull, in space from Qhull, rounded; offsets are
    the supports of all vertices along these very normals, in exact rationals, rounded up.
    """
    points = as_float64(name, vertices, (None, None))
    if not len(points) or points.shape[1] < 2:
        raise InputError(f"{name}: expected points of the workspace, one a row; got {vertices!r}.")
    exact = [tuple(Fraction(x) for x in point) for point in points.tolist()]
    normals = _in_plane(exact) if points.shape[1] == 2 else _in_space(points, name)
    return hpolytope(normals, np.array([round_up(exact_support(exact, w)) for w in normals]))


def _in_plane(exact: list[Point]) -> np.ndarray:
    """Across the edges; where they are one, or nearly, along them too, which closes the ends."""
    corners = convex_polygon(exact)
    pairs = zip(corners, corners[1:] + corners[:1], strict=True)
    edges = [(u - x, v - y) for (x, y), (u, v) in pairs]
    if len(corners) == 1:
        edges = [(Fraction(1), Fraction(0)), (Fraction(-1), Fraction(0))]
    sizes = [max(abs(a), abs(b)) for a, b in edges]
    along = np.array([(a / s, b / s) for (a, b), s in zip(edges, sizes, strict=True)], float) + 0.0
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) + 0.0
    turn = (np.roll(normals, -1, axis=0) * along).sum(axis=1)
    sharp = (np.abs(turn) < SHARP) & ((along * np.roll(along, -1, axis=0)).sum(axis=1) < 0)
    return np.unique(np.concatenate([normals, along[sharp], -along[sharp]]), axis=0)


def _in_space(points: np.ndarray, name: str) -> np.ndarray:
    if (hull := convex_hull(points)) is None:
        raise InputError(
            f"{name}: expected a hull with volume; its vertices are flat or nearly so. Thicken it."
        )
    return np.unique(hull.equations[:, :-1] + 0.0, axis=0)


UP = 1 + 2.0**-50  # pays for a sum of two products


def less_a_box(given: HPolytope, rows, widths: list[Fraction]) -> HPolytope:
    """The Pontryagin difference of a set and the box of these half widths, rounded down.

    rows: exact rationals, to which the box is applied in place of the set's own.
    """
    bounds = []
    for row, bound in zip(rows, given.b, strict=True):
        support = sum((abs(a) * w for a, w in zip(row, widths, strict=True) if a), Fraction(0))
        bounds.append(round_down(Fraction(bound) - support))
    return given.replace(b=np.array(bounds))


def around_box(obstacles: list[HPolytope], half: np.ndarray) -> list[HPolytope]:
    """The Minkowski sum of each obstacle and the box of half widths (n_p,) [m]: rows of both, as of
    `sum_of`; for polygons in floats, a few roundings larger.
    """
    known = corners_of_many(obstacles)
    out = [
        sum_of(obstacle, from_box(box(-half, half)), f"obstacle {j}") if own is None else obstacle
        for j, (obstacle, own) in enumerate(zip(obstacles, known, strict=True))
    ]
    axes = np.concatenate([np.eye(2), -np.eye(2)])
    planar = [j for j, own in enumerate(known) if own is not None]
    for some, A, b in alike([obstacles[j] for j in planar]):
        corners = np.stack([known[planar[i]] for i in some])
        farther = np.nextafter(b + (np.abs(A) * half).sum(axis=2) * UP, np.inf)
        ends = np.concatenate([corners.max(axis=1), -corners.min(axis=1)], axis=1)
        off = 2 * OFF * np.abs(corners).max(axis=(1, 2))[:, None]
        beside = np.nextafter(ends + (np.tile(half, 2) + off) * UP, np.inf)
        # sides of the box that the obstacle has already would come twice
        there = (A[:, :, None] == axes).all(axis=3).any(axis=1)
        for i, rows, own, new, more in zip(some, A, farther, beside, ~there, strict=True):
            out[planar[i]] = obstacles[planar[i]].replace(
                A=np.concatenate([rows, axes[more]]), b=np.concatenate([own, new[more]])
            )
    return out


def sum_of(obstacle: HPolytope, by: HPolytope, name: str) -> HPolytope:
    """The Minkowski sum of an obstacle and a set; in space a little more (rows of both, without
    those that cross two edges). Offsets are rounded up.
    """
    # the support of a sum is the sum of supports, along the normals of both
    corners = [rational_vertices(s, name) for s in (obstacle, by)]
    if not all(corners):
        raise InputError(f"{name}: expected sets with points, also of uncertainty; one is empty.")
    A = np.concatenate([obstacle.A, by.A])
    _, first = np.unique(A, axis=0, return_index=True)
    A = A[np.sort(first)]  # without normals that have come before
    offsets = [round_up(sum(exact_support(points, w) for points in corners)) for w in A]
    return obstacle.replace(A=A, b=np.array(offsets))


class Solid(NamedTuple):
    """Geometry of a polytope. polytope: without redundant rows. vertices (v, n). volume: [product
    of the axis units].

    simplices (s, n + 1): vertex indices of a triangulation. weights (s,): volume share of each.
    """

    polytope: HPolytope
    vertices: np.ndarray
    volume: float
    simplices: np.ndarray
    weights: np.ndarray


def solid(polytope: HPolytope, inside: np.ndarray) -> Solid | None:
    """Vertices, volume, triangulation. None when the set is too thin for floating-point geometry.

    inside (n,): a point strictly inside. Coordinates are centred on it, scaled per axis for qhull.
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
    # corners that share a facet up to rounding confuse qhull
    hull = convex_hull(corners) or convex_hull(corners, "QJ Pp")
    if hull is None:
        return None
    corners = corners[hull.vertices]
    simplices = np.arange(len(corners))[None]  # of a simplex itself: qhull refuses it joggled
    if len(corners) > len(inside) + 1:
        if (simplices := delaunay(corners, "QJ Pp")) is None:
            return None
    needed = np.unique(np.concatenate([np.asarray(f) for f in cut.dual_facets]).astype(int))
    vertices = inside + corners * scale
    sizes = np.abs(np.linalg.det(vertices[simplices[:, 1:]] - vertices[simplices[:, :1]]))
    volume = float(hull.volume * np.prod(scale))
    rows = HPolytope(polytope.A[needed], polytope.b[needed])
    return Solid(rows, vertices, volume, simplices, sizes / sizes.sum())


def _segment(polytope: HPolytope) -> Solid | None:
    """A set on a line, between the nearest of its rows."""
    a, b = polytope.A[:, 0], polytope.b
    ends = b[a != 0] / a[a != 0]
    lo, hi = ends[a[a != 0] < 0].max(), ends[a[a != 0] > 0].min()
    if not lo < hi:
        return None
    rows = HPolytope(np.array([[1.0], [-1.0]]), np.array([hi, -lo]))
    return Solid(rows, np.array([[lo], [hi]]), hi - lo, np.array([[0, 1]]), np.ones(1))


def sample_solid(shape: Solid, rng: np.random.Generator, n: int) -> np.ndarray:
    """n points (n, d), uniform in the solid: a simplex by volume, then flat Dirichlet weights."""
    pick = rng.choice(len(shape.weights), n, p=shape.weights)
    weights = rng.dirichlet(np.ones(shape.simplices.shape[1]), n)
    return np.einsum("nc,ncd->nd", weights, shape.vertices[shape.simplices[pick]])
