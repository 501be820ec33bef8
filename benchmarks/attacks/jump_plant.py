"""A robot whose errors are known exactly: small and random nearly everywhere, and a jump for every
k of a thin slab.

k is uniform on K = [0, 1]^2. The model predicts p(s) = s k and q = k_0 exactly but for an error A s
along the first axis, with the size A drawn anew in each run:

    A = HEIGHT                       where SLAB <= k_1 <= SLAB + width
    A = (0.02 + 0.1 k_0) E           elsewhere, E exponential with mean one

So a tube is left exactly when A exceeds the largest size that it holds, or, of a tube off centre,
falls below the least; and the probability of that is a sum of a share of K and a smooth integral.
Nothing is estimated.
"""

from functools import cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.runs.batch import RolloutBatch, rollout_batch
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.system import TimeGrid, Trajectory, time_grid

T, STRIDE = 4, 4
HEIGHT = 10.0  # [m]
SLAB = 0.37
LEAST, SLOPE = 0.02, 0.1  # [m], [m per unit of k_0]
STARTS, STOPS = np.arange(T) / T, np.arange(1, T + 1) / T  # of the intervals
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


class Hidden(JumpPlant):
    """The robot with a k of its own, drawn anew in each run, whatever it is asked for: a run of any
    plan jumps with probability `width`.
    """

    name = "hidden_jumps"

    def rollout(self, key, k) -> Trajectory:
        """One run, relative to its start."""
        pick, own = jax.random.split(key)
        return super().rollout(own, jax.random.uniform(pick, (2,)))


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


@cache
def hidden(width: float) -> Hidden:
    """The robot that jumps whatever it is asked for, made once."""
    return Hidden(width)


def network() -> ReLUNetwork:
    """k -> c_t = (t / T) k, q = k_0, one linear layer."""
    W = np.concatenate([np.kron(np.arange(1, T + 1)[:, None] / T, np.eye(2)), [[1.0, 0.0]]])
    return relu_network([W], [np.zeros(2 * T + 1)])


def held_sizes(tube: Tube) -> tuple[np.ndarray, np.ndarray]:
    """(n_bins,) the least and the largest size A >= 0 that the tube holds; the least is infinite
    where it holds none.
    """
    if tube.templates is None:
        growth = np.arange(1, T + 1) / T
        largest = np.minimum((tube.interval[:, :, 0] / growth).min(axis=1), tube.final[:, 0])
        return np.zeros(tube.n_bins), largest
    least, largest = np.zeros(tube.n_bins), np.full(tube.n_bins, np.inf)
    during, at_end = tube.templates
    ends = [(given, s) for given, s in ((at_end, np.ones(1)), (during, STARTS), (during, STOPS))]
    for given, s in ends:
        for sign in (1, -1):
            # sign u . (A s, 0, ..) <= sign c + half: one bound on A for every pair of faces
            slope = sign * given.directions[..., 0] * s.reshape(-1, *[1] * (given.half.ndim - 2))
            room = sign * given.centre + given.half
            bound = room / np.where(slope == 0, 1.0, slope)
            axes = tuple(range(1, room.ndim))
            largest = np.minimum(largest, np.where(slope > 0, bound, np.inf).min(axis=axes))
            none = np.where((slope == 0) & (room < 0), np.inf, 0.0)
            least = np.maximum(least, np.where(slope < 0, bound, none).max(axis=axes))
    return least, largest


def truth(width: float, tube: Tube, low=(0.0, 0.0), high=(1.0, 1.0)) -> Truth:
    """Probabilities that runs with k uniform in the box from low to high leave the tube.

    In interval t the error is at most A (t + 1) / T, at the end A.
    """
    least, largest = held_sizes(tube)
    by_bin, share = np.zeros(tube.n_bins), np.zeros(tube.n_bins)
    for number in range(tube.n_bins):
        lo, hi = tube.bin_box(number)
        lo, hi = np.maximum(lo, low), np.minimum(hi, high)
        if (hi <= lo).any():
            continue
        inside = max(0.0, min(hi[1], SLAB + width) - max(lo[1], SLAB)) / (hi[1] - lo[1])
        middle, half = 0.5 * (hi[0] + lo[0]), 0.5 * (hi[0] - lo[0])
        scale = LEAST + SLOPE * (middle + half * NODES)
        inside_tube = np.exp(-least[number] / scale) - np.exp(-largest[number] / scale)
        tail = 1.0 - float(WEIGHTS @ np.maximum(inside_tube, 0.0)) / 2
        jump_leaves = not least[number] <= HEIGHT <= largest[number]
        by_bin[number] = inside * jump_leaves + (1 - inside) * tail
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
    for held, number in zip(held_sizes(tube)[1], range(tube.n_bins), strict=True):
        lo, hi = tube.bin_box(number)
        inside = max(0.0, min(hi[1], SLAB + width) - max(lo[1], SLAB)) / (hi[1] - lo[1])
        last = (held / e - LEAST) / SLOPE  # the largest k_0 that stays inside
        small = np.clip((last - lo[0]) / (hi[0] - lo[0]), 0.0, 1.0)
        stays += np.prod(hi - lo) * ((1 - inside) * small + inside * (held >= HEIGHT))
    return float(1 - (stays**parts).mean())
