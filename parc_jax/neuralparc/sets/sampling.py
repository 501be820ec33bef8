"""Uniform samples in simplices and in polytopes with few vertices. Keys first; each function
consumes its key.
"""

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.vertices import vertices
from parc_jax.neuralparc.sets.volume import simplex_volumes, triangulate


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
