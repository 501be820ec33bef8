"""Every obstacle with every part of the body: what has to be kept apart. [T19, T20]

A part is the hull of some reference points, grown by a shape. A polygon shape is added to the
obstacle instead, turned inside out; a disc or ball stays a radius. One direction keeps all points
of a pair apart, whatever the body does, so nothing about turning is needed.
"""

from collections.abc import Sequence
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct

from parc_jax.base.arrays import dot, x64
from parc_jax.body import Disc, Polygon, numbered
from parc_jax.claim.error_set import ErrorSet, at
from parc_jax.network.predict import Layout, by_point
from parc_jax.obstacles.distance import separation, touching
from parc_jax.obstacles.grown import bucket, exists, numbered_pairs
from parc_jax.obstacles.polygon import corners
from parc_jax.problem import ReachAvoid
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.sets.rational import convex_polygon


@struct.dataclass
class Pairs:
    """Pairs of an obstacle and a part, obstacle by obstacle: pair o is obstacle o // n_parts, part
    o % n_parts. Padding pairs are never active; a padding vertex or point repeats another one.

    vertices: (o, v, n_p) [m] of the obstacle + (-polygon). radius: (o,) [m] of a disc or ball.
    points: (o, i) numbers of the reference points. active: (o, T) bool, the intervals in which the
        obstacle exists.
    """

    vertices: np.ndarray
    radius: np.ndarray
    points: np.ndarray
    active: np.ndarray

    @property
    def size(self):
        """[m] Largest coordinate and radius together."""
        largest = np.abs(self.vertices).max(axis=(-3, -2, -1), initial=0.0)
        return largest + self.radius.max(axis=-1, initial=0.0)

    def only(self, o) -> "Pairs":
        """One of them. Kernel."""
        return jax.tree.map(lambda x: jnp.asarray(x)[o][None], self)

    def gaps(self, path, errors: ErrorSet):
        """Gap (o, T) [m] of every pair in every interval, and the unit direction (o, T, n_p) that
        shows it; path (T + 1, n_c), errors (T, n_points). Kernel.
        """
        places = by_point(path, path.shape[-1] // self.vertices.shape[-1])

        def one(vertices, radius, points):
            near = places[:, points]
            allowed = at(errors, np.s_[:, points])
            times = jax.vmap(separation, in_axes=(0, 0, 0, None, None))
            return times(near[:-1], near[1:], allowed, vertices, radius)

        return jax.vmap(one)(self.vertices, self.radius, jnp.asarray(self.points))

    def gap(self, o, start, end, errors: ErrorSet):
        """The same for one pair and one interval: start, end (n_c,) its knots, errors (n_points,).
        Kernel, and on the host.
        """
        if isinstance(start, jax.Array):
            return _gap(self, o, start, end, errors)
        with x64():
            return jax.device_get(_gap_on_host(self, o, start, end, errors))

    def touching(self, places, errors: ErrorSet):
        """(o, t) bool: does each pair touch for certain at places (t, n_c) with errors (t,
        n_points)? Kernel.
        """
        places = by_point(places, places.shape[-1] // self.vertices.shape[-1])

        def one(vertices, radius, points):
            allowed = at(errors, np.s_[:, points])
            times = jax.vmap(touching, in_axes=(0, 0, None, None))
            return times(places[:, points], allowed, vertices, radius)

        return jax.vmap(one)(self.vertices, self.radius, jnp.asarray(self.points))

    def support(self, w):
        """(o, ...) of the obstacle and the part's shape together along directions w (o, ..., n_p),
        unit vectors. Kernel.
        """
        extra = (1,) * (w.ndim - 2)
        vertices = jnp.asarray(self.vertices)
        vertices = vertices.reshape(len(vertices), *extra, *vertices.shape[1:])
        radius = jnp.asarray(self.radius).reshape(-1, *extra)
        return dot(vertices, w[..., None, :]).max(axis=-1) + radius


def pairs_of(
    problem: ReachAvoid,
    points: tuple[str, ...],
    layout: Layout,
    kept: Sequence[int] | None = None,
) -> Pairs:
    """All pairs of a problem, or those with these numbers, for a robot with these reference points
    (names). Raises InputError.
    """
    parts = numbered(problem.body, points)
    n_steps = layout.n_steps
    chosen = numbered_pairs(problem, kept)
    vertices = [
        _grown(problem.obstacles[j], parts[part].shape, f"obstacle {j}") for j, part in chosen
    ]
    n = len(vertices)
    n_o = bucket(n)
    n_v = bucket(max((len(v) for v in vertices), default=1))
    n_i = max(len(part.points) for part in parts)
    pairs = Pairs(
        vertices=np.zeros((n_o, n_v, layout.n_p)),
        radius=np.zeros(n_o),
        points=np.zeros((n_o, n_i), np.int32),
        active=np.zeros((n_o, n_steps), bool),
    )
    for o in range(n):
        j, part = chosen[o]
        shape, own = parts[part].shape, parts[part].points
        pairs.vertices[o] = np.pad(vertices[o], ((0, n_v - len(vertices[o])), (0, 0)), "edge")
        pairs.radius[o] = shape.radius if isinstance(shape, Disc) else 0.0
        pairs.points[o] = np.resize(own, n_i)
        pairs.active[o] = exists(problem, j, n_steps)
    return pairs


def vertices_of(obstacle: HPolytope, name: str) -> np.ndarray:
    """(v, n_p) vertices of a bounded polytope, each rounded to nearest. Raises InputError."""
    return _rounded([corner.point for corner in corners(obstacle, name)])


def _grown(obstacle: HPolytope, shape: Disc | Polygon, name: str) -> np.ndarray:
    """(v, n_p) vertices of the obstacle + (-shape), a disc left out; each rounded to nearest. In
    space some of them may lie inside.
    """
    if isinstance(shape, Disc):
        return vertices_of(obstacle, name)
    body = [tuple(map(Fraction, v)) for v in shape.vertices.tolist()]
    sums = {
        tuple(x - y for x, y in zip(corner.point, v, strict=True))
        for corner in corners(obstacle, name)
        for v in body
    }
    return _rounded(convex_polygon(list(sums)) if obstacle.n == 2 else sorted(sums))


def _rounded(points) -> np.ndarray:
    return np.array([[float(x) for x in point] for point in points])


def _gap(pairs: Pairs, o, start, end, errors: ErrorSet):
    n_points = start.shape[-1] // pairs.vertices.shape[-1]
    points = jnp.asarray(pairs.points)[o]
    a, b = (by_point(x, n_points)[points] for x in (start, end))
    vertices, radius = jnp.asarray(pairs.vertices)[o], jnp.asarray(pairs.radius)[o]
    return separation(a, b, at(errors, points), vertices, radius)


_gap_on_host = jax.jit(_gap)
