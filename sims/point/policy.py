"""The policy that `sims.point.train` trains, and that was saved."""

import math
from collections.abc import Sequence
from pathlib import Path

import flax.linen as nn
import flax.serialization
import jax
import jax.numpy as jnp
import numpy as np

from sims.point.environment import observed

SEEN = 60  # numbers of an observation


class Policy(nn.Module):
    """Mean and deviation of actions, and what a state is worth: (..., 2), reward and cost."""

    @nn.compact
    def __call__(self, seen):
        heads = []
        for gain in (0.01, 1.0):
            x = seen
            for _ in range(2):
                x = nn.tanh(nn.Dense(64, kernel_init=nn.initializers.orthogonal(2**0.5))(x))
            heads.append(nn.Dense(2, kernel_init=nn.initializers.orthogonal(gain))(x))
        deviation = self.param("deviation", nn.initializers.zeros, (2,), jnp.float32)
        return heads[0], jnp.broadcast_to(deviation, heads[0].shape), heads[1]


POLICY = Policy()


def likelihood(mean, deviation, action):
    """Logarithm of the probability density of actions (..., 2)."""
    off = (action - mean) / jnp.exp(deviation)
    return (-0.5 * off**2 - deviation - 0.5 * math.log(2 * math.pi)).sum(axis=-1)


def learned(moments, seen):
    """Running number, mean and sum of squares of what is seen, after rows (n, ...) of it. NumPy or
    JAX.
    """
    (n, mean, square), m = moments, len(seen)
    off = seen.mean(axis=0) - mean
    square = square + seen.var(axis=0) * m + off**2 * n * m / (n + m)
    return n + m, mean + off * m / (n + m), square


def normalised(moments, seen):
    """What is seen, by its running mean and deviation. NumPy or JAX."""
    n, mean, square = moments
    return ((seen - mean) / (square / n + 1e-8) ** 0.5).clip(-10, 10).astype(np.float32)


class Scale:
    """Running mean and deviation of what is seen."""

    def __init__(self, n: int):
        self.n, self.mean, self.square = 1e-4, np.zeros(n), np.ones(n) * 1e-4

    def learn(self, seen: np.ndarray) -> np.ndarray:
        """Scaled; each row counts from now on."""
        self.n, self.mean, self.square = learned(self.moments, seen)
        return self(seen)

    def __call__(self, seen: np.ndarray) -> np.ndarray:
        """Scaled."""
        return normalised(self.moments, seen)

    @property
    def moments(self) -> tuple:
        """As `learned` has them."""
        return self.n, self.mean, self.square


class Trained:
    """A policy that was saved, with its noise, in some worlds driven in step: `trained(worlds)` is
    the actions (n, 2). seeds: of its draws, for each world.
    """

    def __init__(self, file: Path, seeds: Sequence = ()):
        kept = flax.serialization.msgpack_restore(file.read_bytes())
        self.weights, self.scale = kept["weights"], Scale(1)
        self.scale.__dict__.update(kept["scale"])
        self._draws = [np.random.default_rng(np.ravel(one).tolist()) for one in seeds]

    def __call__(self, worlds: Sequence) -> np.ndarray:
        mean = self.mean(np.array([observed(world) for world in worlds]))
        noise = np.array([draw.normal(size=2) for draw in self._draws])
        deviation = np.exp(np.asarray(self.weights["params"]["deviation"], np.float64))
        return np.clip(mean + deviation * noise, -1.0, 1.0)

    def mean(self, seen: np.ndarray) -> np.ndarray:
        """(..., 2) of what is seen (..., 60), without noise."""
        return np.asarray(mean_of(self.weights, self.scale(seen)), np.float64)


@jax.jit
def mean_of(weights, seen):
    """The action without noise."""
    return POLICY.apply(weights, seen)[0]
