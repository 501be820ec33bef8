"""Translation invariance: the theory stands on it, so it is measured before anything is learnt."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt

from parc_jax.arrays import difference, x64
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.rollout.simulate import simulator
from parc_jax.rollout.user_code import blamed


class TranslationGap(NamedTuple):
    """How far a run moves when its start moves. p: (n_p,) [m], q: (n_q,); starts: (n, n_p) [m], k:
    (n, n_k) tried.

    Largest differences over runs and times; NaN against NaN is no difference, NaN against a number
    is an infinite one.
    """

    p: np.ndarray
    q: np.ndarray
    starts: np.ndarray
    k: np.ndarray


def translation_gap(
    system, key: jax.Array, starts: npt.ArrayLike, stage: Stage = Stage.SEARCH
) -> TranslationGap:
    """Run the same k and disturbance from the origin and from each of `starts` (n, n_p) [m], and
    compare offsets.

    The system must offer `rollout_from(key, k, p0) -> Trajectory`, with p relative to p0, or, if it
    is not JAX, `rollout_from_batch(keys, ks, p0s)`. Rounding alone leaves a gap
    of about 1e-12 m in a smooth system; a chaotic one may turn that into more. Raises InputError
    without the method.
    """
    if not can_start_elsewhere(system):
        raise InputError(
            f"translation_gap: expected {system.name} to offer rollout_from(key, k, p0) -> "
            "Trajectory; it does not. "
            "Without it, invariance is an assumption of every claim."
        )
    starts = np.asarray(starts, np.float64)
    if starts.ndim != 2 or starts.shape[1] != system.n_p:
        raise InputError(f"translation_gap: expected starts (n, {system.n_p}); got {starts.shape}.")
    rows = simulator(system).rows(key, stage, np.arange(len(starts)))
    with x64():
        many = getattr(system, "rollout_from_batch", None) or jax.jit(jax.vmap(system.rollout_from))
        k, origin = jnp.asarray(rows.k), jnp.zeros_like(jnp.asarray(starts))
        with blamed(f"{system.name}: expected rollout_from(key, k, p0) to run"):
            here = many(rows.keys, k, origin)
            there = many(rows.keys, k, jnp.asarray(starts))
    p = difference(here.p, there.p).reshape(-1, system.n_p).max(axis=0)
    return TranslationGap(p, difference(here.q, there.q).max(axis=0), starts, rows.k)


def can_start_elsewhere(system) -> bool:
    """Can the gap be measured? Otherwise invariance is an assumption of every claim."""
    return any(
        callable(getattr(system, name, None)) for name in ("rollout_from", "rollout_from_batch")
    )
