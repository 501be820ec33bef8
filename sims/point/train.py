"""PPO on PointGoal from its first step on behind the shield, or without:

    python -m sims.point.train --steps 200000 [--bare]

One line of JSON per round of rollouts: steps so far, mean return and cost of the episodes that
ended, and steps in contact so far, of which there are none behind the shield. Hazards are known to
the shield; the policy has the lidar.
"""

import json
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import flax.linen as nn
import jax
import jax.numpy as jnp
import numpy as np
import optax

import parc_jax as pj
from sims.point import environment, model, sensing

GAMMA, LAMBDA, CLIP, EPOCHS, PARTS = 0.99, 0.95, 0.2, 8, 8
RATE, LONGEST = 3e-4, 0.5  # of Adam; norm of a gradient


@dataclass(frozen=True)
class Options:
    """How much, and of what."""

    steps: int = 200_000
    worlds: int = 32
    horizon: int = 64
    """Steps of each world between updates."""
    level: int = 1
    bare: bool = False
    """Without the shield."""
    seed: int = 0
    out: Path = Path("runs/point/ppo.jsonl")


class Policy(nn.Module):
    """Mean and deviation of actions, and the value of a state."""

    @nn.compact
    def __call__(self, seen):
        heads = []
        for n in (2, 1):
            x = seen
            for _ in range(2):
                x = nn.tanh(nn.Dense(64, kernel_init=nn.initializers.orthogonal(2**0.5))(x))
            last = nn.initializers.orthogonal(0.01 if n == 2 else 1.0)
            heads.append(nn.Dense(n, kernel_init=last)(x))
        return heads[0], self.param("deviation", nn.initializers.zeros, (2,)), heads[1][..., 0]


def likelihood(mean, deviation, action):
    """Logarithm of the probability density of actions (..., 2)."""
    off = (action - mean) / jnp.exp(deviation)
    return (-0.5 * off**2 - deviation - 0.5 * jnp.log(2 * jnp.pi)).sum(axis=-1)


POLICY = Policy()
ADAM = optax.chain(optax.clip_by_global_norm(LONGEST), optax.adam(RATE, eps=1e-5))


@jax.jit
def act(weights, seen, key):
    """Actions, the logarithm of their density, values."""
    mean, deviation, value = POLICY.apply(weights, seen)
    action = mean + jnp.exp(deviation) * jax.random.normal(key, mean.shape)
    return action, likelihood(mean, deviation, action), value


@partial(jax.jit, donate_argnums=(0, 1))
def update(weights, state, rows, key):
    """Some epochs over rows (n, ...): seen, action, its density, advantage, gain."""

    def loss(weights, part):
        seen, action, before, advantage, gain = part
        mean, deviation, value = POLICY.apply(weights, seen)
        ratio = jnp.exp(likelihood(mean, deviation, action) - before)
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        least = jnp.minimum(ratio * advantage, jnp.clip(ratio, 1 - CLIP, 1 + CLIP) * advantage)
        return 0.5 * ((value - gain) ** 2).mean() - least.mean()

    def one(carry, part):
        weights, state = carry
        change, state = ADAM.update(jax.grad(loss)(weights, part), state, weights)
        return (optax.apply_updates(weights, change), state), None

    def epoch(carry, key):
        order = jax.random.permutation(key, len(rows[0])).reshape(PARTS, -1)
        return jax.lax.scan(one, carry, [x[order] for x in rows])[0], None

    return jax.lax.scan(epoch, (weights, state), jax.random.split(key, EPOCHS))[0]


class Worlds:
    """Some worlds at once, behind one shield."""

    def __init__(self, options: Options):
        self.envs = [environment.PointGoal(options.level) for _ in range(options.worlds)]
        self.draw = np.random.default_rng(options.seed)
        self.shield = None
        if not options.bare:
            self.shield = pj.drive.BatchShield(model(), **sensing.batch_door())
            self.start, self.decide = jax.jit(self.shield.start), jax.jit(self.shield.step)
        self.changed = 0
        self.seen = np.array([self.reset(env) for env in self.envs])
        if self.shield is not None:
            self.under_way = self._started(np.ones(options.worlds, bool))

    def reset(self, env) -> np.ndarray:
        """A fresh world, of a robot whose start is certified to stop: all of them are at rest."""
        return env.reset(seed=int(self.draw.integers(2**32)))[0]

    def _measured(self):
        worlds = [env.world for env in self.envs]
        pose, speeds = ([getattr(w, name) for w in worlds] for name in ("pose", "speeds"))
        corners = np.array([sensing.corners(world) for world in worlds])
        return np.array(pose), np.array(speeds), corners, np.ones(corners.shape[:2], bool)

    def _started(self, which: np.ndarray):
        with jax.enable_x64(True):
            new = jax.tree.map(np.asarray, self.start(*self._measured()))
        if not new.certified[which].all():
            raise RuntimeError("expected a certified stop at each reset")
        return new

    def step(self, actions: np.ndarray):
        """Rewards, costs, ends, whether for good; a world that ends is replaced."""
        driven = actions.astype(np.float64)
        if self.shield is not None:
            with jax.enable_x64(True):
                told = self.decide(self.under_way, *self._measured(), driven)
            self.under_way, told = jax.tree.map(np.asarray, told)
            driven, self.changed = told.action, self.changed + int(told.changed.sum())
        rows, ends = [], np.zeros(len(self.envs), bool)
        for i, env in enumerate(self.envs):
            self.seen[i], reward, ended, over, info = env.step(np.clip(driven[i], -1, 1))
            rows.append((reward, info["cost"], ended or over))
            if ended or over:
                ends[i], self.seen[i] = True, self.reset(env)
        if self.shield is not None and ends.any():
            new = self._started(ends)
            chosen = [
                np.where(ends.reshape(-1, *[1] * (x.ndim - 1)), y, x)
                for x, y in zip(self.under_way, new, strict=True)
            ]
            self.under_way = type(new)(*chosen)
        return np.array(rows, np.float32).T


class Scale:
    """Running mean and deviation of what is seen."""

    def __init__(self, n: int):
        self.n, self.mean, self.square = 1e-4, np.zeros(n), np.ones(n) * 1e-4

    def __call__(self, seen: np.ndarray) -> np.ndarray:
        """Scaled; each row counts from now on."""
        m, off = len(seen), seen.mean(axis=0) - self.mean
        self.square += seen.var(axis=0) * m + off**2 * self.n * m / (self.n + m)
        self.n, self.mean = self.n + m, self.mean + off * m / (self.n + m)
        scaled = (seen - self.mean) / np.sqrt(self.square / self.n + 1e-8)
        return np.clip(scaled, -10, 10).astype(np.float32)


def train(options: Options) -> None:
    """Train, and write a line for each round."""
    worlds, key = Worlds(options), jax.random.PRNGKey(options.seed)
    scale, seen = Scale(worlds.seen.shape[1]), None
    weights = POLICY.init(key, jnp.zeros((1, worlds.seen.shape[1])))
    state, done, contact = ADAM.init(weights), 0, 0
    gained, cost, ended = np.zeros(options.worlds), np.zeros(options.worlds), []
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with options.out.open("w") as file:
        while done < options.steps:
            rows = []
            for _ in range(options.horizon):
                key, own = jax.random.split(key)
                seen = scale(worlds.seen)
                action, before, value = map(np.asarray, act(weights, seen, own))
                reward, touched, over = worlds.step(action)
                rows.append((seen, action, before, value, reward, over))
                gained, cost, contact = gained + reward, cost + touched, contact + touched.sum()
                for i in np.flatnonzero(over):
                    ended.append((gained[i], cost[i]))
                    gained[i] = cost[i] = 0.0
            seen, action, before, value, reward, over = (
                np.stack(x) for x in zip(*rows, strict=True)
            )
            following = np.asarray(act(weights, scale(worlds.seen), own)[2])
            advantage, ahead = np.zeros_like(value), np.zeros(options.worlds, np.float32)
            for t in reversed(range(options.horizon)):
                on = 1.0 - over[t]
                off = reward[t] + GAMMA * following * on - value[t]
                ahead = off + GAMMA * LAMBDA * on * ahead
                advantage[t], following = ahead, value[t]
            flat = [
                x.reshape(-1, *x.shape[2:])
                for x in (seen, action, before, advantage, advantage + value)
            ]
            key, own = jax.random.split(key)
            weights, state = update(weights, state, flat, own)
            done += options.horizon * options.worlds
            last = np.array(ended[-options.worlds :]).mean(axis=0).tolist() if ended else [None] * 2
            line = {
                "steps": done,
                "return": last[0],
                "cost": last[1],
                "contact": int(contact),
                "episodes": len(ended),
                "changed": worlds.changed,
                "seconds": round(time.process_time(), 1),
            }
            file.write(json.dumps(line) + "\n")
            file.flush()


if __name__ == "__main__":
    import tyro

    train(tyro.cli(Options, description=__doc__))
