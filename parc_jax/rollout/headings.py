"""Rotation invariance: what an answer for a measured heading stands on, tried where a system can be
started with one. [T22]
"""

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
from parc_jax.system import TURNS, rotation_of


class RotationGap(NamedTuple):
    """How far a run, turned back by its heading, is from the one of heading 0. p: [m], q: (n_q,),
    largest over runs and times; headings: (n,) [rad], k: (n, n_k) tried.
    """

    p: float
    q: np.ndarray
    headings: np.ndarray
    k: np.ndarray


def can_be_headed(system) -> bool:
    """Can the gap be measured? Otherwise rotation invariance is declared alone."""
    return callable(getattr(system, "rollout_headed", None))


def rotation_gap(
    system, key: jax.Array, headings: npt.ArrayLike, stage: Stage = Stage.SEARCH
) -> RotationGap:
    """Run the same k and disturbance with heading 0 and with each of `headings` (n,) [rad] at the
    start, turned back, and compare. Raises InputError.

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
    rows = simulator(system).rows(key, stage, np.arange(len(headings)))
    with x64():
        many = jax.jit(jax.vmap(system.rollout_headed))
        k = jnp.asarray(rows.k)
        with blamed(f"{system.name}: expected rollout_headed(key, k, heading) to run"):
            straight = many(rows.keys, k, jnp.zeros(len(k)))
            headed = many(rows.keys, k, jnp.asarray(headings))
    cosine, sine = np.cos(headings), np.sin(headings)
    back = np.array([[cosine, sine], [-sine, cosine]])
    places = np.asarray(headed.p).reshape(len(headings), -1, 2)
    turned = np.einsum("abn,nsb->nsa", back, places)
    word = np.array([word == TURNS for word in rotation], float)
    angles = np.asarray(headed.q) - headings[:, None] * word
    p = difference(turned, np.asarray(straight.p).reshape(turned.shape))
    return RotationGap(float(p.max()), difference(angles, straight.q).max(axis=0), headings, rows.k)
