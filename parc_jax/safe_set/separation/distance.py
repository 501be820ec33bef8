"""A part of a body during one interval against one obstacle, in the plane or in space: the best
separating direction, and the gap it proves. [T14]

Both sides are given by their supports alone: the hull of the part's points at two knots with their
errors, less the obstacle, has a support point along every direction, and the shortest vector from
the origin to it is the best direction. A fixed number of steps of Gilbert, Johnson and Keerthi
approaches it: go to the nearest point of a simplex, evaluate the support along it, let the new
point replace one. Steps only propose; the gap returned is that of the inequality along the best.
"""

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Bool, Float

from parc_jax.common.arrays import dot
from parc_jax.common.shapes import Scalar, Vector, Vectors
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.safe_set.separation.inequality import excess

STEPS = {2: 10, 3: 14}  # by dimension: two more than any of thousands of random pairs needed
Many = Float[ArrayLike, "t i n_p"]
Until = tuple[Bool[ArrayLike, " t"], Scalar] | None
FLAT = 1e3  # [units in the last place] sine of an angle below which a triangle is its edges


def separations(
    a: Many, b: Many, errors: ErrorSet, vertices: Vectors, radius: Scalar, until: Until = None
):
    """Gaps (t,) [m] and unit directions (t, n_p) of conv {a_i + E_i, b_i + E_i} in each interval
    from conv(vertices) + ball; gap > 0 proves they are disjoint. Kernel; with `until` not for vmap.

    a, b: (t, i, n_p) the points at both knots.
    errors: (t, i) sets E_i.
    vertices: (v, n_p), repetitions allowed.
    until: some intervals, and a gap [m]: steps end where more change nothing, all of these have a
        larger gap, or one overlaps, in the plane: gaps are then less than they might be. Else they
        are exact where positive, up to rounding; of what touches or overlaps <= 0 up to rounding.
    """
    n = a.shape[-1]
    support = jax.vmap(_support, in_axes=(0, 0, 0, None, 0))

    def step(state: tuple):
        i, gap, w, towards, simplex, met = state
        tried, point = support(a, b, errors, vertices, towards)
        better = (tried > gap) & towards.any(axis=1)
        gap, w = jnp.where(better, tried, gap), jnp.where(better[:, None], towards, w)
        if until is not None and n == 2:  # three supports whose triangle holds the origin
            p, q, r = simplex[:, 0].T, simplex[:, 1].T, point.T
            turns = jnp.stack([u[0] * v[1] - u[1] * v[0] for u, v in ((p, q), (q, r), (r, p))])
            around = (turns > 0).all(axis=0) | (turns < 0).all(axis=0)
            met = (until[0] & (gap < 0) & around).any()
        closer, nearest = jax.vmap(_nearest)(simplex, point)
        onwards = jax.vmap(_unit)(nearest)
        if until is not None:  # from the same state all further steps are the same
            met |= (closer == simplex).all() & (onwards == towards).all()
            met |= ((gap - radius > until[1]) | ~until[0]).all()
        return i + 1, gap, w, onwards, closer, met

    # from the middle of the obstacle to that of the points; any direction where they coincide
    first = jax.vmap(_unit)((a.mean(axis=1) + b.mean(axis=1)) / 2 - vertices.mean(axis=0)[None])
    first = jnp.where(first.any(axis=1)[:, None], first, jnp.eye(1, n, dtype=first.dtype))
    gap, point = support(a, b, errors, vertices, first)
    gap = jnp.where(gap == gap, gap, -jnp.inf)
    simplex = jnp.broadcast_to(point[:, None], (len(a), n, n))
    state = (0, gap, first, jax.vmap(_unit)(point), simplex, False)
    _, gap, w, *_ = jax.lax.while_loop(lambda s: (s[0] < STEPS[n]) & ~s[-1], step, state)
    return gap - radius, w


def _support(a: Vectors, b: Vectors, errors: ErrorSet, vertices: Vectors, w: Vector):
    """Least w . d () over the differences d of both sides, and one that attains it (n_p,)."""
    at_a, at_b, beyond = (dot(x, w[None]) for x in (a, b, vertices))
    least = excess((at_a, at_b), errors.support(-w[None]))
    i, last = least.argmin(), beyond.argmax()
    end = jnp.where(at_a[i] <= at_b[i], a[i], b[i]) + at(errors, i).vertex(-w)
    return least[i] - beyond[last], end - vertices[last]


def _nearest(simplex: Float[ArrayLike, "n_p n_p"], point: Vector):
    """The simplex of n points with one replaced by the new point, and the vector (n,) from the
    origin to the nearest of their hull: its nearest face among those at the new point.
    """
    faces = jnp.stack([simplex.at[i].set(point) for i in range(len(simplex))])
    vectors = jax.vmap(_nearest_of_edge if len(simplex) == 2 else _nearest_of_triangle)(faces)
    chosen = dot(vectors, vectors).argmin()
    return faces[chosen], vectors[chosen]


def _nearest_of_edge(edge: Float[ArrayLike, "2 n_p"]):
    """Vector from the origin to the nearest point of a segment."""
    p, q = edge
    along = q - p
    square = dot(along, along)
    share = jnp.clip(-dot(p, along) / jnp.where(square > 0, square, 1), 0, 1)
    nearest = p + share * along
    # once more, for what was lost in the difference of two long vectors
    inside = (share > 0) & (share < 1)
    again = dot(nearest, along) / jnp.where(square > 0, square, 1)
    return jnp.where(inside, nearest - again * along, nearest)


def _nearest_of_triangle(triangle: Float[ArrayLike, "3 3"]):
    """Vector from the origin to the nearest point of a triangle in space."""
    p, q, r = triangle
    normal = jnp.cross(q - p, r - p)
    square = dot(normal, normal)
    flat = (FLAT * jnp.finfo(normal.dtype).eps) ** 2 * dot(q - p, q - p) * dot(r - p, r - p)
    above = jnp.stack([dot(jnp.cross(x, y), normal) for x, y in ((p, q), (q, r), (r, p))])
    inside = (above > 0).all() & (square > flat)
    foot = normal * (dot(normal, p) / jnp.where(square > 0, square, 1))
    edges = jax.vmap(_nearest_of_edge)(jnp.stack([jnp.stack(e) for e in ((p, q), (q, r), (r, p))]))
    return jnp.where(inside, foot, edges[dot(edges, edges).argmin()])


def _unit(w: Vector):
    """w at length one, however short it is; zero for zero."""
    largest = jnp.abs(w).max()
    w = w / jnp.where(largest > 0, largest, 1)
    square = dot(w, w)
    return w / jnp.sqrt(jnp.where(square > 0, square, 1))
