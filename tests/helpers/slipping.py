"""A skid-steered robot in NumPy, integrated in small steps: what it does is known, and recorded."""

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.learning.runs.batch import RolloutBatch, rollout_batch
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.system import time_grid

K = box([-0.4, -0.8], [0.6, 0.8])  # speed [m/s], turning [rad/s] that are asked for
TIME = time_grid(0.25, 2.0, 0.125)
CORNERS = np.array([[0.0, 0.0], [0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]])
NAMES = ("centre", "front left", "rear left", "rear right", "front right")
STEPS = 40  # of the integration, within a record


def slipped(k: np.ndarray) -> np.ndarray:
    """Twist (n, 3) that wheels give: less than asked for, and sideways when it turns."""
    return np.column_stack([0.9 * k[:, 0], 0.05 * k[:, 1], 0.6 * k[:, 1] + 0.02])


def poses(twist: np.ndarray, lag: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, n_record + 1) complex [m] and headings [rad] under twists (n, 3), reached with a
    lag [s] from rest.
    """
    n, h = TIME.n_record * STEPS, TIME.dt_record / STEPS
    t = (np.arange(n) + 0.5) * h
    share = np.ones(n) if lag == 0 else 1 - np.exp(-t / lag)
    rate = np.concatenate([[0.0], np.cumsum(share) * h])
    heading = twist[:, 2:] * rate
    middle = heading[:, :-1] + 0.5 * twist[:, 2:] * share * h
    step = (twist[:, :1] + 1j * twist[:, 1:2]) * np.exp(1j * middle) * share * h
    way = np.concatenate([np.zeros((len(twist), 1)), np.cumsum(step, axis=1)], axis=1)
    return way[:, ::STEPS], heading[:, ::STEPS]


def drawn(n: int, seed: int = 0) -> np.ndarray:
    """Commands (n, 2), uniform on K."""
    return np.random.default_rng(seed).uniform(K.lo, K.hi, (n, 2))


def recorded(
    k: np.ndarray, twist=None, *, lag=0.0, noise=0.0, one_point=False, groups=None, seed=1
) -> RolloutBatch:
    """Runs of commands (n, 2): twist (n, 3), as slipped where it is None; noise [m] of a run grows
    with time, to either side.
    """
    way, heading = poses(slipped(k) if twist is None else twist, lag)
    drift = np.random.default_rng(seed).normal(size=(len(k), 2)) @ np.array([1.0, 1j])
    way = way + noise * drift[:, None] * np.linspace(0, 1, TIME.n_record + 1)
    corners = CORNERS[:1] if one_point else CORNERS
    offsets = corners @ np.array([1.0, 1j])
    at = way[..., None] + np.exp(1j * heading)[..., None] * offsets
    p = np.stack([at.real, at.imag], axis=-1).reshape(len(k), TIME.n_record + 1, -1)
    return rollout_batch(
        k,
        p,
        heading[:, -1:],
        time=TIME,
        domain=K,
        law=law_spec("file:slipping", K, "logged"),
        groups=groups,
        points=NAMES[: len(corners)] if not one_point else ("reference",),
        labels={"q": ("heading [rad]",)},
    )
