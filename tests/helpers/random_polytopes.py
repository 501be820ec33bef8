"""Random polytopes for the tests of sets: bounded, with interior, from a seeded generator."""

import numpy as np

from parc_jax.common.sets.hpolytope import HPolytope, hpolytope


def round_polytope(rng, n: int, h: int, spread: float = 1.0) -> HPolytope:
    """Random unit normals around a random centre, closed by a box; contains a ball of radius 0.3 *
    spread.
    """
    A = rng.normal(size=(h, n))
    A = np.concatenate([A / np.linalg.norm(A, axis=1, keepdims=True), np.eye(n), -np.eye(n)])
    b = np.concatenate([rng.uniform(0.3, 1.5, h), np.full(2 * n, 2.0)]) * spread
    return hpolytope(A, b + A @ rng.normal(size=n))


def points_around(rng, p: HPolytope, count: int) -> np.ndarray:
    """Points in a box about the polytope: some inside, some outside."""
    centre = np.linalg.lstsq(p.A, p.b - 0.5, rcond=None)[0]
    return centre + rng.uniform(-2.5, 2.5, (count, p.n))
