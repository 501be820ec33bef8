"""Does a run depend on where it starts, or on its heading there? The theory stands on it, so it is
tried before anything is learnt, where a system can be started elsewhere. [T22, T33]
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt

from parc_jax.common.arrays import difference, x64
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.runs.simulate import simulator
from parc_jax.learning.system import TURNS, Trajectory, rotation_of
from parc_jax.learning.systems.user_code import blamed


class StartGap(NamedTuple):
    """How far a run moves when its start moves, or turns. p: (n_p,) [m], q: (n_q,); starts: (n,
    n_p) [m], or headings (n,) [rad], k: (n, n_k) tried.

    Largest differences over runs and times; NaN against NaN is no difference, NaN against a number
    is an infinite one.
    """

    p: np.ndarray
    q: np.ndarray
    starts: np.ndarray
    k: np.ndarray


def translation_gap(system, key: jax.Array, starts: npt.ArrayLike) -> StartGap:
    """Run the same k and disturbance from the origin and from each of `starts` (n, n_p) [m], and
    compare offsets. Uses the SEARCH stream of `key`.

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
    many = getattr(system, "rollout_from_batch", None) or jax.jit(jax.vmap(system.rollout_from))
    k, here, there = _both(system, key, many, starts, "rollout_from(key, k, p0)")
    p = difference(here.p, there.p).reshape(-1, system.n_p).max(axis=0)
    return StartGap(p, difference(here.q, there.q).max(axis=0), starts, k)


def rotation_gap(system, key: jax.Array, headings: npt.ArrayLike) -> StartGap:
    """Run the same k and disturbance with heading 0 and with each of `headings` (n,) [rad] at the
    start, turned back, and compare. Uses the SEARCH stream of `key`. Raises InputError.

    The system must declare `rotation` and offer `rollout_headed(key, k, heading) -> Trajectory`, p
    relative to the start and not turned back.
    """
    rotation = rotation_of(system)
    if rotation is None or not can_be_headed(system):
        raise InputError(
            f"rotation_gap: expected {system.name} to declare rotation and to offer "
            "rollout_headed(key, k, heading) -> Trajectory; it does not. Without it, invariance is "
            "an assumption of every answer for a heading."
        )
    headings = np.asarray(headings, np.float64)
    if headings.ndim != 1:
        raise InputError(f"rotation_gap: expected headings (n,); got {headings.shape}.")
    many = jax.jit(jax.vmap(system.rollout_headed))
    k, straight, headed = _both(system, key, many, headings, "rollout_headed(key, k, heading)")
    cosine, sine = np.cos(headings), np.sin(headings)
    back = np.array([[cosine, sine], [-sine, cosine]])
    places = np.asarray(headed.p).reshape(len(headings), -1, 2)
    turned = np.einsum("abn,nsb->nsa", back, places)
    word = np.array([word == TURNS for word in rotation], float)
    angles = np.asarray(headed.q) - headings[:, None] * word
    p = difference(turned, np.asarray(straight.p).reshape(turned.shape)).max(axis=(0, 1))
    return StartGap(p, difference(angles, straight.q).max(axis=0), headings, k)


def can_start_elsewhere(system) -> bool:
    """Can `translation_gap` be measured? Otherwise invariance is an assumption of every claim."""
    return any(
        callable(getattr(system, name, None)) for name in ("rollout_from", "rollout_from_batch")
    )


def can_be_headed(system) -> bool:
    """Can `rotation_gap` be measured? Otherwise rotation invariance is declared alone."""
    return callable(getattr(system, "rollout_headed", None))


def _both(
    system, key: jax.Array, many, starts: np.ndarray, call: str
) -> tuple[np.ndarray, Trajectory, Trajectory]:
    """k (n, n_k), and their runs from nowhere else and from starts (n, ...), by one call of many
    (keys, k, starts). Raises InputError for a fault in the user's `call`.
    """
    rows = simulator(system).rows(key, Stage.SEARCH, np.arange(len(starts)))
    with x64():
        k, there = jnp.asarray(rows.k), jnp.asarray(starts)
        with blamed(f"{system.name}: expected {call} to run"):
            return rows.k, many(rows.keys, k, jnp.zeros_like(there)), many(rows.keys, k, there)
