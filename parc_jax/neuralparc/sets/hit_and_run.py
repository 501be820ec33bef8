"""Hit-and-run: nearly uniform samples of any bounded polytope from one inner point."""

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import x64

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
