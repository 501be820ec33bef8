"""Proximal policy optimisation of the network of `sims.point.policy`, with values of reward and of
cost: what a training takes wherever its worlds are stepped.
"""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import optax

from sims.point.policy import POLICY, SEEN, likelihood
from sims.point.world import STEPS

GAMMA, LAMBDA, CLIP, EPOCHS, PARTS = 0.99, 0.95, 0.2, 8, 8
RATE, LONGEST = 3e-4, 0.5  # of Adam; norm of a gradient
RISE = 0.035  # of the multiplier in a round, for twice the cost that is allowed

ADAM = optax.chain(optax.clip_by_global_norm(LONGEST), optax.adam(RATE, eps=1e-5))


@dataclass(frozen=True)
class Training:
    """What all trainings ask for."""

    bare: bool = False
    """Without the shield."""
    penalty: float = 0.0
    """Of the reward that is learned from, for each action that the shield changes."""
    patience: int = 0
    """Steps after which a world is left whose robot stands; 0: it is not."""
    limit: float | None = None
    """Cost of a mean episode that a Lagrangian allows; without it cost is not looked at."""
    seed: int = 0
    out: Path = Path("runs/point/ppo.csv")


class Rows(NamedTuple):
    """Of a round (t, worlds, ...): what was seen, scaled; actions, their density, values (2,); got,
    reward and cost (2,); over, 1 where a world was replaced.
    """

    seen: Any
    action: Any
    density: Any
    value: Any
    got: Any
    over: Any


@partial(jax.jit, static_argnames="seen")
def fresh(key, seen: int = SEEN):
    """Weights, and the state of Adam, of a policy that sees so many numbers."""
    weights = POLICY.init(key, jnp.zeros((1, seen), jnp.float32))
    return weights, ADAM.init(weights)


@partial(jax.jit, static_argnums=2)
def keys_of(seed, rounds, n: int):
    """A key of a round, and one for each of its n steps."""
    key = jax.random.fold_in(jax.random.PRNGKey(seed), rounds)
    return key, jax.random.split(key, n)


@jax.jit
def act(weights, seen, key):
    """Actions, the logarithm of their density, values."""
    mean, deviation, value = POLICY.apply(weights, seen)
    action = mean + jnp.exp(deviation) * jax.random.normal(key, mean.shape, mean.dtype)
    return action, likelihood(mean, deviation, action), value


def raised(multiplier, cost, limit: float | None):
    """The multiplier after a round of cost a step; without a limit as it was."""
    if limit is None:
        return multiplier
    return (multiplier + RISE * (STEPS * cost / limit - 1.0)).clip(0.0)


@jax.jit
def advantages(reward, value, over, following):
    """Of rows (t, worlds, 2): generalised advantage estimates of reward and cost."""

    def back(carry, row):
        (ahead, following), (reward, value, over) = carry, row
        on = 1.0 - over[:, None]
        ahead = reward + GAMMA * following * on - value + GAMMA * LAMBDA * on * ahead
        return (ahead, value), ahead

    begin = jnp.zeros_like(following), following
    return jax.lax.scan(back, begin, (reward, value, over), reverse=True)[1]


@partial(jax.jit, static_argnames="parts", donate_argnums=(0, 1))
def learn(weights, state, rows: Rows, following, multiplier, key, parts: int = PARTS):
    """Weights and state of Adam after some epochs over a round, each in so many parts. following:
    values (worlds, 2) of what is seen after it; multiplier: of cost.
    """
    both = advantages(rows.got, rows.value, rows.over, following)
    multiplier = jnp.asarray(multiplier, both.dtype)
    advantage = (both[..., 0] - multiplier * both[..., 1]) / (1.0 + multiplier)
    of_each = (rows.seen, rows.action, rows.density, advantage, both + rows.value)
    flat = [x.reshape(-1, *x.shape[2:]) for x in of_each]

    def loss(weights, part):
        seen, action, before, advantage, gain = part
        mean, deviation, value = POLICY.apply(weights, seen)
        ratio = jnp.exp(likelihood(mean, deviation, action) - before)
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        least = jnp.minimum(ratio * advantage, jnp.clip(ratio, 1 - CLIP, 1 + CLIP) * advantage)
        return 0.5 * ((value - gain) ** 2).sum(axis=-1).mean() - least.mean()

    def one(carry, part):
        weights, state = carry
        change, state = ADAM.update(jax.grad(loss)(weights, part), state, weights)
        return (optax.apply_updates(weights, change), state), None

    def epoch(carry, key):
        order = jax.random.permutation(key, len(flat[0])).reshape(parts, -1)
        return jax.lax.scan(one, carry, [x[order] for x in flat])[0], None

    return jax.lax.scan(epoch, (weights, state), jax.random.split(key, EPOCHS))[0]
