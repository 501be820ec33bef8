"""A robot whose errors are known exactly: small and random nearly everywhere, and a jump for every
k of a thin slab.

k is uniform on K = [0, 1]^2. The model predicts p(s) = s k and q = k_0 exactly but for an error A s
along the first axis, with the size A drawn anew in each run:

    A = HEIGHT                       where SLAB <= k_1 <= SLAB + width
    A = (0.02 + 0.1 k_0) E           elsewhere, E exponential with mean one

So a tube is left exactly when A exceeds the largest size that it holds, and the probability of that
is a sum of a share of K and a smooth integral. Nothing is estimated.
"""

from functools import cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.claim.tube import Tube
from parc_jax.network.relu import ReLUNetwork, relu_network
from parc_jax.rollout.batch import RolloutBatch, rollout_batch
from parc_jax.rollout.law import law_spec
from parc_jax.sets.box import box
from parc_jax.system import TimeGrid, Trajectory, time_grid

T, STRIDE = 4, 4
HEIGHT = 10.0  # [m]
SLAB = 0.37
LEAST, SLOPE = 0.02, 0.1  # [m], [m per unit of k_0]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


class JumpPlant:
    """The robot. width: share of K in which it jumps."""

    n_p = 2
    n_q = 1
    name = "jump_plant"
    domain = box([0.0, 0.0], [1.0, 1.0])
    time: TimeGrid = time_grid(1.0 / T, 1.0, 1.0 / (T * STRIDE))

    def __init__(self, width: float):
        """A robot that jumps in a slab of this width."""
        self.width = width

    @property
    def law(self) -> dict:
        """What the error depends on beside k."""
        return {"width": self.width}

    def rollout(self, key, k) -> Trajectory:
        """One run, relative to its start."""
        s = jnp.linspace(0.0, 1.0, T * STRIDE + 1)
        jumps = (k[1] >= SLAB) & (k[1] <= SLAB + self.width)
        size = (LEAST + SLOPE * k[0]) * jax.random.exponential(key)
        error = jnp.stack([jnp.where(jumps, HEIGHT, size), jnp.zeros(())])
        return Trajectory(s[:, None] * (k + error)[None], k[:1])


class Truth(NamedTuple):
    """Exact probabilities. whole: a new run leaves the tube. by_bin (n_bins,): given that k is in
    the bin. share (n_bins,): of
    the box.
    """

    whole: float
    by_bin: np.ndarray
    share: np.ndarray


@cache
def jump_plant(width: float) -> JumpPlant:
    """The robot with this slab, made once: compiled programs are kept with it."""
    return JumpPlant(width)


def network() -> ReLUNetwork:
    """k -> c_t = (t / T) k, q = k_0, one linear layer."""
    W = np.concatenate([np.kron(np.arange(1, T + 1)[:, None] / T, np.eye(2)), [[1.0, 0.0]]])
    return relu_network([W], [np.zeros(2 * T + 1)])


def largest_held(tube: Tube) -> np.ndarray:
    """(n_bins,) the largest size A that the tube holds."""
    reach = np.arange(1, T + 1) / T
    return np.minimum((tube.interval[:, :, 0] / reach).min(axis=1), tube.final[:, 0])


def truth(width: float, tube: Tube, low=(0.0, 0.0), high=(1.0, 1.0)) -> Truth:
    """Probabilities that runs with k uniform in the box from low to high leave the tube.

    In interval t the error is at most A (t + 1) / T, at the end A.
    """
    held = largest_held(tube)
    by_bin, share = np.zeros(tube.n_bins), np.zeros(tube.n_bins)
    for number in range(tube.n_bins):
        lo, hi = tube.bin_box(number)
        lo, hi = np.maximum(lo, low), np.minimum(hi, high)
        if (hi <= lo).any():
            continue
        inside = max(0.0, min(hi[1], SLAB + width) - max(lo[1], SLAB)) / (hi[1] - lo[1])
        middle, half = 0.5 * (hi[0] + lo[0]), 0.5 * (hi[0] - lo[0])
        scale = LEAST + SLOPE * (middle + half * NODES)
        tail = float(WEIGHTS @ np.exp(-held[number] / scale)) / 2
        by_bin[number] = inside * (held[number] < HEIGHT) + (1 - inside) * tail
        share[number] = np.prod(hi - lo) / np.prod(np.subtract(high, low))
    return Truth(float(by_bin @ share), by_bin, share)


def recordings(width: float, rng: np.random.Generator, n: int, parts: int) -> RolloutBatch:
    """n recordings of `parts` runs each, as a log would hold them: every run has its own k, uniform
    on K, but one draw of E is shared by all runs of a recording.
    """
    plant = jump_plant(width)
    k = rng.random((n * parts, 2))
    shared = np.repeat(rng.exponential(size=n), parts)
    jumps = (k[:, 1] >= SLAB) & (k[:, 1] <= SLAB + width)
    error = np.where(jumps, HEIGHT, (LEAST + SLOPE * k[:, 0]) * shared)
    end = k + np.stack([error, np.zeros(len(k))], axis=1)
    s = np.linspace(0.0, 1.0, T * STRIDE + 1)
    return rollout_batch(
        k,
        s[None, :, None] * end[:, None],
        k[:, :1],
        time=plant.time,
        domain=plant.domain,
        law=law_spec("file:log", plant.domain, "uniform"),
        groups=np.repeat(np.arange(n), parts),
    )


def truth_of_recordings(width: float, tube: Tube, parts: int, nodes: int = 20_000) -> float:
    """Probability that any run of a new recording leaves the tube: over E by midpoints of its
    distribution, over k exactly.
    """
    e = -np.log1p(-(np.arange(nodes) + 0.5) / nodes)
    stays = np.zeros(nodes)
    for held, number in zip(largest_held(tube), range(tube.n_bins), strict=True):
        lo, hi = tube.bin_box(number)
        inside = max(0.0, min(hi[1], SLAB + width) - max(lo[1], SLAB)) / (hi[1] - lo[1])
        last = (held / e - LEAST) / SLOPE  # the largest k_0 that stays inside
        small = np.clip((last - lo[0]) / (hi[0] - lo[0]), 0.0, 1.0)
        stays += np.prod(hi - lo) * ((1 - inside) * small + inside * (held >= HEIGHT))
    return float(1 - (stays**parts).mean())
