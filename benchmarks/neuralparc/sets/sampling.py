"""Volumes and triangulations of polytopes given by their vertices, uniform samples in them, and
hit-and-run: nearly uniform samples of any bounded polytope from one inner point. Keys first; each
function consumes its key.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.neuralparc.sets.vertices import vertices
from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import delaunay

_INSIDE = 1e-9  # share of a chord kept free at both ends, so that rounding does not leave the set


def hit_and_run(key, A, b, start, count: int, thin: int):
    """A chain of count points in {A x <= b}, `thin` steps apart. Consumes `key`. Pure kernel.

    A: (h, n); a padding row is zero with b = 1. b: (h,). start: (n,) with A start < b. Returns
    (count, n). Each step picks a uniform direction and a uniform point of the chord, so the uniform
    law is stationary (Smith 1984); n^2 steps apart, samples of a well rounded set are nearly
    independent. An unbounded chord gives infinite samples.
    """
    precision = jax.lax.Precision.HIGHEST

    # One draw for directions and places: compiling the generator is most of a first call's cost.
    drawn = jax.random.uniform(
        key, (count, thin, start.shape[0] + 1), start.dtype, _INSIDE, 1.0 - _INSIDE
    )
    directions = jax.lax.erf_inv(2.0 * drawn[..., :-1] - 1.0)
    places = drawn[..., -1]

    def step(x, drawn):
        d, place = drawn
        slope = jnp.matmul(A, d, precision=precision)
        slack = jnp.maximum(b - jnp.matmul(A, x, precision=precision), 0.0)
        steps = slack / jnp.where(slope != 0, slope, 1.0)
        ahead = jnp.min(jnp.where(slope > 0, steps, jnp.inf))
        behind = jnp.max(jnp.where(slope < 0, steps, -jnp.inf))
        return x + (behind + place * (ahead - behind)) * d, None

    def sample(x, drawn):
        x, _ = jax.lax.scan(step, x, drawn)
        return x, x

    _, points = jax.lax.scan(sample, start, (directions, places))
    return points


hit_and_run_batch = jax.jit(  # over polytopes: keys (r, 2), A (r, h, n), b (r, h), start (r, n)
    jax.vmap(hit_and_run, in_axes=(0, 0, 0, 0, None, None)), static_argnums=(4, 5)
)


def sample_polytopes(
    keys, A: np.ndarray, b: np.ndarray, start: np.ndarray, count: int, thin: int
) -> np.ndarray:
    """Host door of `hit_and_run_batch` in float64: (r, count, n). Consumes `keys` (r, 2)."""
    with x64():
        return np.asarray(
            hit_and_run_batch(keys, jnp.asarray(A), jnp.asarray(b), jnp.asarray(start), count, thin)
        )


def simplex_volumes(simplices: np.ndarray) -> np.ndarray:
    """Volumes of simplices (..., n + 1, n): (...)."""
    n = simplices.shape[-1]
    return np.abs(np.linalg.det(simplices[..., 1:, :] - simplices[..., :1, :])) / math.factorial(n)


def triangulate(points: np.ndarray) -> np.ndarray:
    """Simplices (s, n + 1, n) with disjoint interiors that fill the hull of points (v, n); s = 0
    for a flat hull.
    """
    n = points.shape[1]
    none = np.zeros((0, n + 1, n))
    scale = np.ptp(points, axis=0) if len(points) > n else np.zeros(n)
    if not (scale > 0).all():
        return none
    if n == 1:
        return np.array([[points.min(axis=0), points.max(axis=0)]])
    # thin sets triangulate like round ones
    corners = delaunay((points - points.mean(axis=0)) / scale)
    if corners is None:
        return none
    simplices = points[corners]
    return simplices[simplex_volumes(simplices) > 0]


def volume(points: np.ndarray) -> float:
    """Volume of the hull of points (v, n); 0 for a flat or empty one."""
    return float(simplex_volumes(triangulate(points)).sum())


def sample_simplices(key, simplices, volumes, count: int):
    """count points uniform in a union of simplices with disjoint interiors. Consumes `key`. Pure
    kernel.

    simplices: (s, n + 1, n). volumes: (s,) >= 0, any common scale. Returns (count, n).
    """
    which_key, where_key = jax.random.split(key)
    total = jnp.cumsum(volumes)
    draw = jax.random.uniform(which_key, (count,), volumes.dtype) * total[-1]
    chosen = jnp.minimum(jnp.searchsorted(total, draw, side="right"), volumes.shape[0] - 1)
    # Exponential variables over their sum are uniform on the simplex of barycentric coordinates.
    weight = jax.random.exponential(where_key, (count, simplices.shape[1]), volumes.dtype)
    weight = weight / weight.sum(axis=1, keepdims=True)
    return (weight[:, :, None] * simplices[chosen]).sum(axis=1)


def sample_polytope(key, p: HPolytope, count: int) -> np.ndarray:
    """count points uniform in a full-dimensional bounded polytope, n <= 6: (count, n). Consumes
    `key`.

    Through a triangulation of its vertices; for more dimensions or many rows use `hit_and_run`.
    Raises InputError.
    """
    simplices = triangulate(vertices(p))
    if not len(simplices):
        raise InputError("sample_polytope: expected a set with interior; it is empty or flat.")
    with x64():
        volumes = jnp.asarray(simplex_volumes(simplices))
        return np.asarray(_sample_simplices(key, jnp.asarray(simplices), volumes, count))


_sample_simplices = jax.jit(sample_simplices, static_argnums=3)
