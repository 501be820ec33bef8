"""PPO on PointGoal from its first step on behind the shield, or without it, or with a Lagrangian:

    python -m sims.point.train --steps 1000000 [--bare [--limit 25]]

One row of a CSV per round of rollouts: steps so far, mean return and cost of the episodes that
ended last, and of all steps so far those in contact, of which there are none behind the shield.
Hazards are known to the shield; the policy has the lidar. Beside the CSV stands the policy, with
all that is needed to go on from it in new worlds.
"""

import csv
import math
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import flax.linen as nn
import flax.serialization
import jax
import jax.numpy as jnp
import numpy as np
import optax

import parc_jax as pj
from sims.point import environment, model, sensing
from sims.point.judge import judge
from sims.point.world import STEPS

GAMMA, LAMBDA, CLIP, EPOCHS, PARTS = 0.99, 0.95, 0.2, 8, 8
RATE, LONGEST = 3e-4, 0.5  # of Adam; norm of a gradient
RISE = 0.035  # of the multiplier in a round, for twice the cost that is allowed
SEEN = 60  # numbers of an observation
KEPT = 20  # rounds from one saved policy to the next


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
    penalty: float = 0.0
    """Of the reward that is learned from, for each action that the shield changes."""
    limit: float | None = None
    """Cost of a mean episode that a Lagrangian allows; without it cost is not looked at."""
    seed: int = 0
    out: Path = Path("runs/point/ppo.csv")


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


def likelihood(mean, deviation, action):
    """Logarithm of the probability density of actions (..., 2)."""
    off = (action - mean) / jnp.exp(deviation)
    return (-0.5 * off**2 - deviation - 0.5 * math.log(2 * math.pi)).sum(axis=-1)


POLICY = Policy()
ADAM = optax.chain(optax.clip_by_global_norm(LONGEST), optax.adam(RATE, eps=1e-5))


@jax.jit
def fresh(key):
    """Weights, and the state of Adam."""
    weights = POLICY.init(key, jnp.zeros((1, SEEN), jnp.float32))
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


@partial(jax.jit, donate_argnums=(0, 1))
def update(weights, state, rows, key):
    """Some epochs over rows (n, ...): seen, action, its density, advantage, gain."""

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
        order = jax.random.permutation(key, len(rows[0])).reshape(PARTS, -1)
        return jax.lax.scan(one, carry, [x[order] for x in rows])[0], None

    return jax.lax.scan(epoch, (weights, state), jax.random.split(key, EPOCHS))[0]


class Worlds:
    """Some worlds at once, behind one shield. begin: round in which they begin."""

    def __init__(self, options: Options, begin: int):
        self.envs = [environment.PointGoal(options.level) for _ in range(options.worlds)]
        self.draw = np.random.default_rng((options.seed, begin))
        self.shield, self.penalty = None, options.penalty
        if not options.bare:
            self.shield = pj.drive.BatchShield(model(), **sensing.batch_door())
            self.start, self.decide = jax.jit(self.shield.start), jax.jit(self.shield.step)
        self.changed = self.entered = 0  # actions; episodes with a true pose inside a hazard
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
        """(4, worlds): rewards, costs, ends, penalties; a world that ends is replaced."""
        driven, penalty = actions.astype(np.float64), np.zeros(len(actions))
        if self.shield is not None:
            with jax.enable_x64(True):
                told = self.decide(self.under_way, *self._measured(), driven)
            self.under_way, told = jax.tree.map(np.asarray, told)
            driven, self.changed = told.action, self.changed + int(told.changed.sum())
            penalty = self.penalty * told.changed
        rows, ends = [], np.zeros(len(self.envs), bool)
        for i, env in enumerate(self.envs):
            self.seen[i], reward, ended, over, info = env.step(np.clip(driven[i], -1, 1))
            rows.append((reward, info["cost"], ended or over))
            if ended or over:
                self.entered += judge(np.array(env.world.trace), env.world.hazards).ever
                ends[i], self.seen[i] = True, self.reset(env)
        if self.shield is not None and ends.any():
            new = self._started(ends)
            chosen = [
                np.where(ends.reshape(-1, *[1] * (x.ndim - 1)), y, x)
                for x, y in zip(self.under_way, new, strict=True)
            ]
            self.under_way = type(new)(*chosen)
        return np.array([*np.transpose(rows), penalty], np.float32)


class Scale:
    """Running mean and deviation of what is seen."""

    def __init__(self, n: int):
        self.n, self.mean, self.square = 1e-4, np.zeros(n), np.ones(n) * 1e-4

    def learn(self, seen: np.ndarray) -> np.ndarray:
        """Scaled; each row counts from now on."""
        m, off = len(seen), seen.mean(axis=0) - self.mean
        more = seen.var(axis=0) * m + off**2 * self.n * m / (self.n + m)
        self.square = self.square + more
        self.n, self.mean = self.n + m, self.mean + off * m / (self.n + m)
        return self(seen)

    def __call__(self, seen: np.ndarray) -> np.ndarray:
        """Scaled."""
        scaled = (seen - self.mean) / np.sqrt(self.square / self.n + 1e-8)
        return np.clip(scaled, -10, 10).astype(np.float32)


class Trained:
    """A policy that was saved: `trained(seen)` is its mean action, without noise."""

    def __init__(self, file: Path):
        kept = flax.serialization.msgpack_restore(file.read_bytes())
        self.weights, self.scale = kept["weights"], Scale(1)
        self.scale.__dict__.update(kept["scale"])

    def __call__(self, seen: np.ndarray) -> np.ndarray:
        """(2,) of what is seen (60,)."""
        return np.asarray(mean_of(self.weights, self.scale(seen)), np.float64).clip(-1.0, 1.0)


@jax.jit
def mean_of(weights, seen):
    """The action without noise."""
    return POLICY.apply(weights, seen)[0]


def advantages(reward, value, over, following):
    """Of rows (t, worlds, 2): generalised advantage estimates of reward and cost."""
    found, ahead = np.zeros_like(value), np.zeros_like(following)
    for t in reversed(range(len(reward))):
        on = 1.0 - over[t][:, None]
        off = reward[t] + GAMMA * following * on - value[t]
        ahead = off + GAMMA * LAMBDA * on * ahead
        found[t], following = ahead, value[t]
    return found


def train(options: Options) -> None:
    """Train, and write a row for each round. Goes on where a policy of that name was saved."""
    n, scale = options.worlds, Scale(SEEN)
    weights, state = fresh(jax.random.PRNGKey(options.seed))
    counts = dict.fromkeys(("rounds", "contact", "entered", "changed", "episodes"), 0)
    kept = {"weights": weights, "state": state, "scale": scale.__dict__, "counts": counts}
    kept |= {"multiplier": 0.0}
    file = options.out.with_suffix(".policy")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    if file.exists():
        kept = flax.serialization.from_bytes(kept, file.read_bytes())
        weights, state, counts = kept["weights"], kept["state"], kept["counts"]
        scale.__dict__.update(kept["scale"])
    multiplier, before, worlds = kept["multiplier"], dict(counts), Worlds(options, counts["rounds"])
    gained, ended = np.zeros((n, 2)), []
    while counts["rounds"] * options.horizon * n < options.steps:
        rows, (key, keys) = [], keys_of(options.seed, counts["rounds"], options.horizon)
        for own in np.asarray(keys):
            seen = scale.learn(worlds.seen)
            action, density, value = map(np.asarray, act(weights, seen, own))
            reward, cost, over, penalty = worlds.step(action)
            got = np.stack([reward - penalty, cost], axis=-1)
            rows.append((seen, action, density, value, got, over))
            gained += np.stack([reward, cost], axis=-1)
            for i in np.flatnonzero(over):
                ended.append(gained[i].tolist())
                gained[i] = 0.0
        seen, action, density, value, got, over = (np.stack(x) for x in zip(*rows, strict=True))
        following = np.asarray(act(weights, scale(worlds.seen), own)[2])
        both = advantages(got, value, over, following)
        if options.limit is not None:
            cost = STEPS * got[..., 1].mean()
            multiplier = max(0.0, multiplier + RISE * (cost / options.limit - 1.0))
        advantage = (both[..., 0] - multiplier * both[..., 1]) / (1.0 + multiplier)
        flat = [
            x.reshape(-1, *x.shape[2:]) for x in (seen, action, density, advantage, both + value)
        ]
        weights, state = update(weights, state, flat, key)
        counts["rounds"] += 1
        counts["contact"] += int(got[..., 1].sum())
        counts["episodes"] = before["episodes"] + len(ended)
        for name in ("entered", "changed"):
            counts[name] = before[name] + getattr(worlds, name)
        last = np.mean(ended[-n:], axis=0) if ended else (np.nan, np.nan)
        row = {"steps": counts["rounds"] * options.horizon * n}
        row |= {"return": round(float(last[0]), 3), "cost": round(float(last[1]), 3)}
        row |= counts | {"multiplier": round(float(multiplier), 4)}
        row |= {"seconds": round(time.process_time(), 1)}
        with options.out.open("a", newline="") as table:
            writer = csv.DictWriter(table, list(row))
            if not table.tell():
                writer.writeheader()
            writer.writerow(row)
        if counts["rounds"] % KEPT == 0 or row["steps"] >= options.steps:
            kept = {"weights": weights, "state": state, "scale": scale.__dict__, "counts": counts}
            kept |= {"multiplier": multiplier}
            file.write_bytes(flax.serialization.to_bytes(kept))


if __name__ == "__main__":
    import tyro

    train(tyro.cli(Options, description=__doc__))
