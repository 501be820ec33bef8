"""Contacts tried on a batch of boxes over (z, k): with which obstacle and part of the body, when,
and by how much every plan of a box is in contact. [T30, T35]

A part is the hull of some reference points, grown. At each corner of the box of z one mixture of
its points is sought that lies deep in the obstacle; if it does so at all vertices of k, with an
error that every bin of the box allows, every plan of the box touches.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int

from parc_jax.common.arrays import dot, product
from parc_jax.common.shapes import (
    Directions,
    Index,
    Path,
    Paths,
    Positions,
    Scalar,
    Supports,
    Vector,
    Vectors,
)
from parc_jax.learning.bound.error_set import ErrorSet
from parc_jax.learning.bound.error_set import at as errors_at
from parc_jax.learning.network.predict import by_point
from parc_jax.safe_set.separation.inequality import excess
from parc_jax.safe_set.separation.segment import separation
from parc_jax.safe_set.verdict.scene import Tabled

SHARES = (0.0, 0.5, 1.0)  # moments within an interval at which contact is tried
CANDIDATES = 6  # (obstacle, interval, moment) tried per box, the most promising first


class Tried(NamedTuple):
    """The contacts tried in each of n boxes.

    obstacle, interval, share: (n, c) numbers; an obstacle stands for one part of the body, too.
    way: (n, c, n_p) directions out of the obstacle. weights: (n, c, 2^n_p, n_points) of the mixture
    of points at each corner of the box of z. lost: (n, c, n_points, .) support of the
    errors, as of `_lost`.
    """

    obstacle: jax.Array
    interval: jax.Array
    share: jax.Array
    way: jax.Array
    weights: jax.Array
    lost: jax.Array


def contacts_to_try(
    scene: Tabled, path: Paths, half_size: Paths, common: ErrorSet, size: Positions
) -> Tried:
    """The contacts whose gap at the middle of the box, plus half the box along it, is smallest.

    path: of the middle. half_size: half of the growth by the box. common: errors that all bins
    allow, leading axes (n, T, n_points). size: of the box of z.

    These gaps only steer the search. With the errors of any bin they would point at worse contacts,
    but prove nothing false: whether a contact holds is decided by `contact_depth`, with those of
    all, and in the end by the checker.
    """
    n = len(path)
    n_points = path.shape[2] // size.shape[1]
    points = jnp.asarray(scene.obstacles.points)
    gaps, ways = jax.vmap(_gaps, in_axes=(None, 0, 0))(scene, path, common)
    half = by_point(moments(half_size), n_points)[:, :, :, points].mean(axis=-2)
    # along a way the box moves the points by half its size at most: all of it is to touch
    score = gaps + dot(jnp.abs(ways), jnp.moveaxis(half, 3, 1))
    scores = -score.reshape(n, -1)
    _, flat = jax.lax.top_k(scores, min(CANDIDATES, scores.shape[1]))
    o, t, share = jnp.unravel_index(flat, score.shape[1:])
    rows = jnp.arange(n)[:, None]
    way = ways[rows, o, t, share]
    at = by_point(moments(path)[rows, t, share], n_points)
    of_contact = jax.vmap(jax.vmap(_lost, in_axes=(None, 0, 0)), in_axes=(None, 0, 0))
    lost = of_contact(scene, o, errors_at(common, (rows, t)))
    away = corners_of(-size / 2, size / 2)
    of_box = jax.vmap(_weights, in_axes=(None, 0, 0, 0, None))
    weights = jax.vmap(of_box, in_axes=(None, 0, 0, 0, 0))(scene, o, at, lost, away)
    return Tried(o, t, share, way, weights, lost)


def contact_depth(
    scene: Tabled,
    tried: Tried,
    back: Float[ArrayLike, "m knots n_c"],
    owner: Int[ArrayLike, " m"],
    lo: Positions,
    hi: Positions,
):
    """Places less z (m, c, n_points, n_p) of every vertex at the moments tried, and the largest gap
    (m, c) there over the corners of z: negative where every plan touches.

    back: places less z at the vertices. owner: number of their box. lo, hi: of the boxes of z.
    """
    n_points = tried.weights.shape[-1]
    box = jnp.minimum(owner, len(lo) - 1)
    t = tried.interval[box]
    at = moments(back)[jnp.arange(len(back))[:, None], t, tried.share[box]]
    at = by_point(at, n_points)
    found = jax.vmap(jax.vmap(_deepest, in_axes=(None, 0, 0, 0, 0, None)), (None, 0, 0, 0, 0, 0))(
        scene, tried.obstacle[box], at, tried.lost[box], tried.weights[box], corners_of(lo, hi)[box]
    )
    active = jnp.asarray(scene.obstacles.active)[tried.obstacle[box], t]
    return at, jnp.where(active, found, jnp.inf)


def corners_of(lo: Float[ArrayLike, "*b n"], hi: Float[ArrayLike, "*b n"]):
    """Corners (..., 2^n, n) of boxes, the lower ones first."""
    n = lo.shape[-1]
    upper = jnp.asarray(list(itertools.product((False, True), repeat=n)))
    upper = upper.reshape(*[1] * (lo.ndim - 1), 2**n, n)
    return jnp.where(upper, hi[..., None, :], lo[..., None, :])


def moments(path: Float[ArrayLike, "*b knots n"]):
    """Points (..., T, shares, n) of a path at the SHARES of every interval."""
    before = path[..., :-1, :]
    after = path[..., 1:, :]
    return jnp.stack([before * (1 - share) + after * share for share in SHARES], axis=-2)


def _point_gap(p: Vector, corners: Vectors, radius: Scalar):
    """Signed distance [m] of a point from polygon + disc, negative inside, and unit direction."""
    return separation(p, p, corners, radius)


def hull_gap(w: Directions, support: Supports, at: Vectors, lost: Float[ArrayLike, "i d"]):
    """The same of the hull of points, as far as the directions w with this support of the obstacle
    show, less the support `lost` of the errors: for one point, how deep it is at most.
    """
    length = jnp.sqrt(dot(w, w))
    least = excess([dot(at[:, None], w[None])], lost).min(axis=0)
    gaps = (least - support) / jnp.where(length > 0, length, 1.0)
    gaps = jnp.where(length > 0, gaps, -jnp.inf)
    best = jnp.argmax(gaps)
    return gaps[best], w[best] / jnp.where(length[best] > 0, length[best], 1.0)


def _lost(scene: Tabled, o: Index, errors: ErrorSet):
    """Support of the errors of each point, leading axis (n_points,), against obstacle o: along its
    directions (n_points, d); half widths (n_points, n_p) where it is grown by them.
    """
    if scene.obstacles.closed:
        return errors.half
    return errors_at(errors, np.s_[:, None]).support(-jnp.asarray(scene.directions.w)[o])


STEPS = 18  # of Newton's method, after which the depth is right to nanometres
CENTRED = 0.05  # share of the complementarity that a step aims at
SHORT_OF = 0.99  # share of the way to the boundary that a step goes


def deepest_mixture(depth: Float[ArrayLike, "d i"]):
    """Weights (i,) >= 0 with sum 1 for which the least entry of depth @ weights is largest,
    about: a small linear program. One row is one condition, one column one point. Kernel.

    Algorithm: a primal-dual interior-point method, from the mean of all points on.
    """
    n = depth.shape[1]
    if n == 1:
        return jnp.ones(1)
    # the last weight is 1 less the others; the least entry is one more variable, to be maximised
    given = [depth[:, -1] - depth[:, j] for j in range(n - 1)]
    rows = jnp.stack([*given, jnp.ones(len(depth))], axis=1)
    bounds = jnp.concatenate([-jnp.eye(n - 1), jnp.ones((1, n - 1))])
    bounds = jnp.concatenate([bounds, jnp.zeros((n, 1))], axis=1)
    A = jnp.concatenate([rows, bounds])
    b = jnp.concatenate([depth[:, -1], jnp.zeros(n - 1), jnp.ones(1)])
    up = jnp.eye(n)[-1]

    def step(_: Index, state: tuple):
        x, multipliers = state
        slack = b - product(A, x)
        aim = CENTRED * (slack * multipliers).mean() / slack
        ratio = multipliers / slack
        move = _solved(product(A.T * ratio[None], A), up - product(A.T, aim))
        along = product(A, move)
        change = aim - multipliers + ratio * along
        nearest = jnp.maximum((along / slack).max(), (-change / multipliers).max())
        share = SHORT_OF / jnp.maximum(nearest, SHORT_OF)
        new = x + share * move, multipliers + share * change
        # at the optimum rounding alone is left
        usable = jnp.isfinite(jnp.concatenate(new)).all()
        return jax.tree.map(lambda now, old: jnp.where(usable, now, old), new, state)

    x = jnp.append(jnp.full(n - 1, 1 / n), depth.mean(axis=1).min() - 1)
    x, _ = jax.lax.fori_loop(0, STEPS, step, (x, 1 / (b - product(A, x))))
    # any weights are a mixture, so those of a failed solve are replaced and prove less
    weights = jnp.maximum(jnp.append(x[:-1], 1 - x[:-1].sum()), 0)
    weights = weights / weights.sum()
    return jnp.where(jnp.isfinite(weights).all(), weights, 1 / n)


def _solved(M: Float[ArrayLike, "i i"], r: Float[ArrayLike, " i"]):
    """x (i,) with M x = r, M positive definite, written out: LAPACK is slow for small systems."""
    rows = jnp.concatenate([M, r[:, None]], axis=1)
    for i in range(len(r)):
        row = rows[i] / rows[i, i]
        rows = (rows - rows[:, i, None] * row[None]).at[i].set(row)
    return rows[:, -1]


def _gaps(scene: Tabled, path: Path, errors: ErrorSet):
    """Gap (o, T, shares) and direction (o, T, shares, n_p) of every moment of one path from
    every obstacle; errors of each interval and point.
    """
    obstacles = scene.obstacles
    if obstacles.closed:

        def one(vertices: Vectors, signs: Vectors, radius: Scalar):
            polygons = vertices[None] + signs[None] * errors.half
            in_interval = jax.vmap(_point_gap, in_axes=(0, None, None))
            return jax.vmap(in_interval, in_axes=(0, 0, None))(moments(path), polygons, radius)

        gap, w = jax.vmap(one)(obstacles.vertices, obstacles.signs, obstacles.radius)
    else:
        n_points = path.shape[1] // scene.start_A.shape[1]
        table = scene.directions
        at = by_point(moments(path), n_points)

        def one(w: Directions, support: Supports, points: Int[ArrayLike, " i"]):
            lost = errors_at(errors, np.s_[:, points, None]).support(-w)
            in_interval = jax.vmap(hull_gap, in_axes=(None, None, 0, None))
            return jax.vmap(in_interval, in_axes=(None, None, 0, 0))(
                w, support, at[:, :, points], lost
            )

        gap, w = jax.vmap(one)(table.w, table.support, jnp.asarray(obstacles.points))
    return jnp.where(obstacles.active[:, :, None], gap, jnp.inf), w


def _weights(scene: Tabled, o: Index, at: Vectors, lost: Float[ArrayLike, "i _"], away: Vectors):
    """Weights (v, n_points) of the mixture that is deepest in obstacle o, for every corner of the
    box of z relative to its middle; at: places, lost: as in `_lost`.
    """
    points = jnp.asarray(scene.obstacles.points)[o]
    chosen = jax.nn.one_hot(points, len(at), dtype=at.dtype)
    if len(points) == 1:
        return jnp.broadcast_to(chosen, (len(away), len(at)))
    table = scene.directions
    w, support = jnp.asarray(table.w)[o], jnp.asarray(table.support)[o]
    length = jnp.sqrt(dot(w, w))[:, None]
    threshold = support[:, None] + lost[points].T

    def one(moved: Vector):
        depth = threshold - dot((at[points] + moved[None])[None], w[:, None])
        return deepest_mixture(depth / jnp.where(length > 0, length, 1.0))

    return jnp.matmul(jax.vmap(one)(away), chosen)


def _deepest(
    scene: Tabled,
    o: Index,
    at: Vectors,
    lost: Float[ArrayLike, "i _"],
    weights: Float[ArrayLike, "v i"],
    corners: Vectors,
):
    """Largest gap () over corners of z of a vertex of k, points less `_lost`, mixed by weights."""
    # a mixture of points has the same mixture of their errors
    at = corners + dot(weights[:, None], at.T[None])
    lost = dot(weights[:, None], lost.T[None])
    obstacles = scene.obstacles
    if obstacles.closed:
        one = jax.tree.map(lambda x: jnp.asarray(x)[o], obstacles)
        grown = one.vertices[None] + one.signs[None] * lost[:, None]
        gap, _ = jax.vmap(_point_gap, in_axes=(0, 0, None))(at, grown, one.radius)
    else:
        w, support = jnp.asarray(scene.directions.w)[o], jnp.asarray(scene.directions.support)[o]
        gap, _ = jax.vmap(hull_gap, in_axes=(None, None, 0, 0))(
            w, support, at[:, None], lost[:, None]
        )
    return gap.max()
