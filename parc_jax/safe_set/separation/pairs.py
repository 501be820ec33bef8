"""Pairs of an obstacle and a part of the body, which must be separated. [T14, T19, T20]

A part is the hull of some reference points, grown by a shape. A polygon shape is added to the
obstacle instead, reflected; a disc or ball stays a radius. One direction separates all points of a
pair, however the body turns.
"""

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from operator import mul
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from parc_jax.common import struct
from parc_jax.common.arrays import dot, least, most, x64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import corners_of_many
from parc_jax.common.sets.rational import Point, convex_polygon, rational_vertices, unbounded, whole
from parc_jax.common.shapes import Index, Knot, Path, Scalar, Vector
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.learning.network.predict import Layout, by_point
from parc_jax.problem.body import Disc, Polygon, numbered
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.separation import distance, segment
from parc_jax.safe_set.separation.inequality import height

FARTHEST = 10**100  # [m] a corner beyond this is taken for a direction left open


class Corner(NamedTuple):
    """A vertex, exact (n_p,), and the rows active there, in the plane by angle of their normals."""

    point: Point
    rows: tuple[int, ...]


def corners(poly: HPolytope, name: str = "polygon") -> tuple[Corner, ...]:
    """Corners of a bounded polytope in the plane, counter-clockwise, or in space; exact. Raises
    InputError when empty or unbounded.

    The last few hundred polytopes are remembered.
    """
    return _corners(poly.A.tobytes(), poly.b.tobytes(), poly.n, name)


@lru_cache(maxsize=512)
def _corners(rows: bytes, offsets: bytes, n: int, name: str) -> tuple[Corner, ...]:
    A = np.frombuffer(rows).reshape(-1, n)
    b = np.frombuffer(offsets)
    points = rational_vertices(HPolytope(A, b), name)
    if not points:
        raise InputError(f"{name}: expected a set with points; its rows contradict each other.")
    if any(abs(x) > FARTHEST for point in points for x in point):
        raise unbounded(name)
    # in whole numbers a row is active where it is equal, without a tolerance
    exact = [whole(row) for row in np.column_stack([A, b]).tolist()]
    in_order = np.argsort(np.arctan2(A[:, 1], A[:, 0]), kind="stable") if n == 2 else range(len(A))
    out = []
    for point in points:
        *x, one = whole((*point, Fraction(1)))
        active = [sum(map(mul, normal, x)) == bound * one for *normal, bound in exact]
        out.append(Corner(point, tuple(int(i) for i in in_order if active[i])))
    return tuple(out)


BUCKETS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)


@struct.dataclass
class Obstacles:
    """Pairs of an obstacle and a part, obstacle by obstacle: pair o is obstacle o // n_parts, part
    o % n_parts. Padding pairs are never active; a padding vertex or point repeats another one.

    vertices: (o, v, n_p) [m] of the obstacle + (-polygon), off by `polygons.OFF` at most.
    radius: (o,) [m] of a disc or ball.
    points: (o, i) numbers of the reference points.
    active: (o, T) bool, the intervals in which the obstacle exists.
    signs: (o, v, 2) in {-1, 0, 1} where errors are boxes around one point in the plane: a pair
        grown by errors e is a polygon with the corners vertices + signs * e, counter-clockwise, for
        every e at once, and its distance has a closed form. Else (o, 0, n_p).
    """

    vertices: np.ndarray
    signs: np.ndarray
    radius: np.ndarray
    points: np.ndarray
    active: np.ndarray

    @property
    def closed(self) -> bool:
        """Has the gap a closed form? Else a direction is searched for."""
        return self.signs.shape[-2] > 0

    @property
    def size(self):
        """[m] Largest coordinate and radius together."""
        largest = np.abs(self.vertices).max(axis=(-3, -2, -1), initial=0.0)
        return largest + self.radius.max(axis=-1, initial=0.0)

    def only(self, o: Index) -> "Pair":
        """One of them. Kernel."""
        return Pair(*(jnp.asarray(x)[o] for x in jax.tree.leaves(self)))

    def gaps(self, path: Path, errors: ErrorSet):
        """Gap (o, T) [m] of every pair in every interval, and the unit direction (o, T, n_p) that
        shows it; errors (T, n_points). Kernel.
        """
        every = Pair(*map(jnp.asarray, jax.tree.leaves(self)))
        return jax.vmap(Pair.gaps, in_axes=(0, None, None))(every, path, errors)

    def box_gaps(self, path: Path, errors: ErrorSet):
        """(n_p, o, T) [m] gap along each axis, negative where they overlap, between boxes around
        all points and around the obstacle, without the radius. Kernel.
        """
        n_p = self.vertices.shape[-1]
        places = jnp.moveaxis(by_point(path, path.shape[-1] // n_p), -1, 0)
        axes = jnp.eye(n_p, dtype=path.dtype)[:, None, None]
        over, under = errors.support(axes), errors.support(-axes)
        # the way between two knots is straight: the boxes at both ends hold it
        lo = least(jnp.minimum(places[:, :-1], places[:, 1:]) - under, axis=2)[:, None]
        hi = most(jnp.maximum(places[:, :-1], places[:, 1:]) + over, axis=2)[:, None]
        vertices = jnp.asarray(self.vertices)
        below, above = least(vertices, axis=1).T[..., None], most(vertices, axis=1).T[..., None]
        return jnp.maximum(lo - above, below - hi)

    def away(self, path: Path, errors: ErrorSet):
        """(o,) [m] lower bound of the gaps of each pair, up to rounding, from boxes around all
        points and around the obstacle; -inf where these overlap. Kernel.
        """
        apart = jnp.maximum(self.box_gaps(path, errors), 0.0)
        square = least(jnp.where(self.active, height(apart, apart), jnp.inf), axis=1)
        # boxes that overlap say nothing of what is inside them
        return jnp.where(square > 0, jnp.sqrt(square), -jnp.inf) - self.radius

    def gap(self, o: Index, start: Knot, end: Knot, errors: ErrorSet):
        """The same for one pair, interval: knots start, end, errors (n_points,). Kernel, host."""
        if isinstance(start, jax.Array):
            return self.only(o).gap(start, end, errors)
        if self.closed:  # compiling would cost more
            polygon = self.vertices[o] + self.signs[o] * errors.half
            return segment.separation(start, end, polygon, self.radius[o], np)
        with x64():
            return jax.device_get(_gap_on_host(self, o, start, end, errors))


class Pair(NamedTuple):
    """One of `Obstacles`: the same fields without the leading axis. All its answers are kernels."""

    vertices: jax.Array
    signs: jax.Array
    radius: jax.Array
    points: jax.Array
    active: jax.Array

    closed = Obstacles.closed

    def gaps(self, path: Path, errors: ErrorSet, until: Scalar | None = None):
        """Gap (T,) [m] in every interval, and the unit direction (T, n_p) that shows it; errors
        (T, n_points). until: [m], as of `distance.separations`.
        """
        if self.closed:
            polygons = self.vertices[..., None] + self.signs[..., None] * errors.half[:, 0].T[None]
            gap, w = segment.separation(path[:-1].T, path[1:].T, polygons, self.radius)
            return gap, w.T
        # of the points of this pair, (t, i, n_p) and (t, i)
        near = by_point(path, path.shape[-1] // self.vertices.shape[-1])[:, self.points]
        allowed = at(errors, np.s_[:, self.points])
        ends = None if until is None else (self.active, until)
        return distance.separations(near[:-1], near[1:], allowed, self.vertices, self.radius, ends)

    def gap(self, start: Knot, end: Knot, errors: ErrorSet):
        """The same in one interval: start, end its knots, errors (n_points,)."""
        gap, w = self.gaps(jnp.stack([start, end]), at(errors, None))
        return gap[0], w[0]

    def support(self, w: Vector):
        """Of the obstacle and the part's shape together along a direction w, a unit vector."""
        return most(dot(self.vertices, w[None])) + self.radius


_gap_on_host = jax.jit(lambda pairs, o, *of: pairs.only(o).gap(*of))


def obstacles_of(
    problem: Problem,
    points: tuple[str, ...],
    layout: Layout,
    closed: bool = False,
    kept: Sequence[int] | np.ndarray | None = None,
) -> Obstacles:
    """All pairs of a problem, or those with these numbers, for a robot with these reference points
    (names). closed: as of `Obstacles.closed`, for one point in the plane. Raises InputError.
    """
    parts = numbered(problem.body, points)
    chosen = numbered_pairs(problem, kept)
    known = [None] * len(problem.obstacles) if closed else corners_of_many(problem.obstacles)

    def spelled_out(j: int, shape: Disc | Polygon):
        # a disc stays a radius, so the corners are those of the obstacle
        if known[j] is not None and isinstance(shape, Disc):
            return known[j], None
        spell = signed_vertices if closed else _grown
        return spell(problem.obstacles[j], shape, f"obstacle {j}")

    spelled = [spelled_out(j, parts[part].shape) for j, part in chosen]
    n_o = bucket(len(chosen))
    n_v = bucket(max((len(v) for v, _ in spelled), default=1))
    n_i = max(len(part.points) for part in parts)
    pairs = Obstacles(
        vertices=np.zeros((n_o, n_v, layout.n_p)),
        signs=np.zeros((n_o, n_v if closed else 0, layout.n_p)),
        radius=np.zeros(n_o),
        points=np.zeros((n_o, n_i), np.int32),
        active=np.zeros((n_o, layout.n_steps), bool),
    )
    own = [np.resize(part.points, n_i) for part in parts]
    for o, ((j, part), (vertices, signs)) in enumerate(zip(chosen, spelled, strict=True)):
        shape = parts[part].shape
        # padding repeats a vertex and a point, which changes no extreme
        every = np.minimum(np.arange(n_v), len(vertices) - 1)
        pairs.vertices[o] = vertices[every]
        if closed:
            pairs.signs[o] = signs[every]
        pairs.radius[o] = shape.radius if isinstance(shape, Disc) else 0.0
        pairs.points[o] = own[part]
        pairs.active[o] = exists(problem, j, layout.n_steps)
    return pairs


def exists(problem: Problem, j: int, n_steps: int) -> np.ndarray:
    """(T,) bool: the intervals in which obstacle j exists. Raises InputError."""
    first, last = (problem.spans and problem.spans[j]) or (0, n_steps - 1)
    if last >= n_steps:
        raise InputError(f"span of obstacle {j}: expected last < {n_steps} intervals; got {last}.")
    at = np.arange(n_steps)
    return (at >= first) & (at <= last)


def numbered_pairs(
    problem: Problem, kept: Sequence[int] | np.ndarray | None = None
) -> list[tuple[int, int]]:
    """(obstacle, part) of the pairs with these numbers, of all where none are given."""
    n_parts = len(problem.parts)
    every = range(len(problem.obstacles) * n_parts) if kept is None else kept
    return [divmod(int(pair), n_parts) for pair in every]


def vertices_of(obstacle: HPolytope, name: str) -> np.ndarray:
    """(v, n_p) vertices of a bounded polytope, each rounded to nearest. Raises InputError."""
    return _rounded([corner.point for corner in corners(obstacle, name)])


def signed_vertices(obstacle: HPolytope, shape: Disc | Polygon, name: str):
    """Vertices and signs (v, 2) of obstacle + (-shape) in the plane, less a disc; rounded last."""
    body = [(Fraction(0), Fraction(0))]
    if not isinstance(shape, Disc):
        body = [(-Fraction(x), -Fraction(y)) for x, y in shape.vertices]
    points = [tuple(corner.point) for corner in corners(obstacle, name)]
    sums = [(v[0] + p[0], v[1] + p[1]) for v in points for p in body]
    table = segment.signed_corners(convex_polygon(sums))
    return _rounded([point for point, _ in table]), np.array([sign for _, sign in table], float)


def _grown(obstacle: HPolytope, shape: Disc | Polygon, name: str):
    """Vertices (v, n_p) of the obstacle + (-shape), a disc left out, each rounded to nearest, and
    no signs. In space some of them may lie inside.
    """
    if isinstance(shape, Disc):
        return vertices_of(obstacle, name), None
    body = [tuple(map(Fraction, v)) for v in shape.vertices.tolist()]
    sums = {
        tuple(x - y for x, y in zip(corner.point, v, strict=True))
        for corner in corners(obstacle, name)
        for v in body
    }
    return _rounded(convex_polygon(list(sums)) if obstacle.n == 2 else sorted(sums)), None


def _rounded(points: Iterable[Point]) -> np.ndarray:
    return np.array([[float(x) for x in point] for point in points])


def bucket(n: int) -> int:
    """Padded size for n items: few compiled shapes. Powers of two beyond the last bucket."""
    return next((size for size in BUCKETS if n <= size), 1 << (n - 1).bit_length())


class Alike(NamedTuple):
    """The pairs of a scene grouped by shared normals: boxes of a map, one obstacle at many times.
    The projections of a plan are computed once per group. [T14, T20]

    order (o,): pairs, group by group. kinds (): number of groups. first (o + 1,): where each group
    begins in `order`, and the last one ends.
    """

    order: np.ndarray
    first: np.ndarray
    kinds: np.ndarray

    def look(self, of_kind: Callable, of_pair: Callable, state: Any):
        """The state after all pairs. Kernel.

        of_kind: pair -> projections, evaluated for one pair of each kind.
        of_pair: (pair, projections, state) -> state.
        """
        order, first = (jnp.asarray(x) for x in (self.order, self.first))

        # the projections of a kind stay in the cache while all of its pairs use them
        def kind(number: Index, state: Any):
            known = of_kind(order[first[number]])
            return jax.lax.fori_loop(
                first[number],
                first[number + 1],
                lambda at, state: of_pair(order[at], known, state),
                state,
            )

        return jax.lax.fori_loop(0, self.kinds, kind, state)


def alike(w: Float[np.ndarray, "n d n_p"], points: Int[np.ndarray, "n i"], room: int) -> Alike:
    """Group n pairs by equal directions and points, padded to a capacity of `room` pairs."""
    kinds: dict[bytes, list[int]] = {}
    # by their bytes: 0.0 and -0.0 make two kinds, which costs time alone
    for pair, told in enumerate(zip(w, points, strict=True)):
        kinds.setdefault(b"".join(x.tobytes() for x in told), []).append(pair)
    order, first = np.zeros(room, np.int32), np.zeros(room + 1, np.int32)
    order[: len(w)] = [pair for pairs in kinds.values() for pair in pairs]
    first[1 : len(kinds) + 1] = np.cumsum([len(pairs) for pairs in kinds.values()])
    return Alike(order, first, np.int32(len(kinds)))
