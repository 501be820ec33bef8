"""As `sims.point.train`, wholly on an accelerator: a round of rollouts in MJX, each step behind the
shield, and the update after it are one jitted program.

    python -m sims.point.on_device [--penalty 0.01 --patience 100] [--bare [--limit 25]]

The worlds are those of `sims.point.functional`, from a pool of layouts drawn before; behind the
shield only those are in it whose start is certified to stop. The table has the columns of
`sims.point.train`, every so many rounds, and how many layouts were left out; the policy beside it
drives in `sims.point.episodes`. First episodes are shorter, so that not all end at once.
"""

import csv
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import flax.serialization
import jax
import jax.numpy as jnp
import numpy as np

import parc_jax as pj
from sims.point import model, sensing
from sims.point.functional import Goal, Worlds, drawn
from sims.point.policy import SEEN, Scale, learned, normalised
from sims.point.ppo import Rows, Training, act, fresh, keys_of, learn, raised
from sims.point.train import COUNTED, STANDS
from sims.point.world import STEPS, VASE

FIRST = 3 * 10**9  # seed of the pool's first world; the others follow
SQUARE = sensing.DOT * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
SUMMED = ("gained", "contact", "episodes", *COUNTED)
MOMENTS = ("n", "mean", "square")  # of what was seen, as `Scale` names them


@dataclass(frozen=True)
class Options(Training):
    """How much, and of what."""

    steps: int = 10_000_000
    robots: int = 1024
    horizon: int = 32
    """Steps of each robot between updates."""
    parts: int = 16
    """Of a round, in each of which the policy is updated once an epoch."""
    pool: int = 4096
    """Layouts of worlds that are drawn before."""
    every: int = 10
    """Rounds between rows of the table."""


class Begun(NamedTuple):
    """Worlds, what is seen in them (b, 60), and what the shield has under way, None without it."""

    worlds: Worlds
    seen: Any
    under_way: Any


class Run(NamedTuple):
    """now; steps (b,) of the episode; last (b, 2), where the robot was since (b,) steps ago."""

    now: Begun
    steps: Any
    last: Any
    since: Any


class Learner(NamedTuple):
    """Weights, state of Adam, moments of what was seen, multiplier of cost."""

    weights: Any
    state: Any
    moments: Any
    multiplier: Any


class Device:
    """Its functions are pure, but for `pool`, and are to be jitted."""

    def __init__(self, options: Options):
        self.options, self.goal = options, Goal()
        self.shield = None
        if not options.bare:
            self.shield = pj.drive.BatchShield(model(), **sensing.batch_door())

    def pool(self) -> Begun:
        """Of layouts of fixed seeds, those whose start is certified."""
        o = self.options
        worlds, seen = drawn(FIRST + o.seed * o.pool + np.arange(o.pool))
        pool = Begun(worlds, seen, None)
        if self.shield is not None:
            under_way = jax.jit(self.shield.start)(*self.measured(worlds))
            at = np.flatnonzero(under_way.certified)
            pool = jax.tree.map(lambda x: np.asarray(x)[at], Begun(worlds, seen, under_way))
        return jax.tree.map(jnp.asarray, pool)

    def begin(self, pool: Begun, key) -> Run:
        """Each robot in a world of the pool, somewhere in its episode."""
        n = self.options.robots
        of_worlds, of_steps = jax.random.split(key)
        steps = jax.random.randint(of_steps, n, 0, STEPS, jnp.int32)
        nowhere = jnp.full((n, 2), jnp.nan, pool.worlds.pose.dtype)
        return Run(self._any(pool, of_worlds), steps, nowhere, jnp.zeros(n, jnp.int32))

    def round(self, learner: Learner, run: Run, pool: Begun, key, keys):
        """Rollouts and an update: learner, run, and counts of the round."""
        o = self.options

        def one(carry, key):
            (moments, run), (of_action, of_step) = carry, jax.random.split(key)
            moments = learned(moments, run.now.seen)
            seen = normalised(moments, run.now.seen)
            action, density, value = act(learner.weights, seen, of_action)
            run, got, over, counts = self.step(run, pool, action, of_step)
            return (moments, run), (Rows(seen, action, density, value, got, over), counts)

        (moments, run), (rows, counts) = jax.lax.scan(one, (learner.moments, run), keys)
        following = act(learner.weights, normalised(moments, run.now.seen), key)[2]
        multiplier = raised(learner.multiplier, rows.got[..., 1].mean(), o.limit)
        weights, state = learn(
            learner.weights, learner.state, rows, following, multiplier, key, parts=o.parts
        )
        learner = Learner(weights, state, moments, multiplier)
        return learner, run, jax.tree.map(lambda x: x.sum(axis=0), counts)

    def step(self, run: Run, pool: Begun, action, key):
        """One step of all robots: reward less penalty, and cost (b, 2); ends (b,); counts. What
        ends or is left is replaced.
        """
        o, (worlds, _, under_way) = self.options, run.now
        driven, reason = action.astype(worlds.pose.dtype), jnp.zeros(len(action), int)
        changed = left = reason > 0
        if self.shield is not None:
            before = under_way.left
            under_way, told = self.shield.step(under_way, *self.measured(worlds), driven)
            driven, changed, reason = told
            left = under_way.left & ~before
        of_goal, of_pool = jax.random.split(key)
        worlds, told = self.goal.step(worlds, driven.clip(-1.0, 1.0), of_goal)
        place, steps = worlds.pose[:, :2], run.steps + 1
        moved = ~(jnp.linalg.norm(place - run.last, axis=1) < STANDS)
        last, since = jnp.where(moved[:, None], place, run.last), jnp.where(moved, 0, run.since + 1)
        stood = (since >= o.patience) & (o.patience > 0)
        over = told.ended | (steps >= STEPS) | stood
        other = Run(self._any(pool, of_pool), 0 * steps, last * jnp.nan, 0 * since)
        run = _rows_of(over, other, Run(Begun(worlds, told.seen, under_way), steps, last, since))
        found = (
            *(told.reward, told.cost > 0, over),
            *(told.entered, changed, reason > 0, left, stood),
        )
        counts = {name: x.sum() for name, x in zip(SUMMED, found, strict=True)}
        got = jnp.stack([told.reward - o.penalty * changed, told.cost], axis=1)
        return run, got.astype(action.dtype), over.astype(action.dtype), counts

    def measured(self, worlds: Worlds):
        """As `BatchShield` has it."""
        dots = jnp.asarray(worlds.hazards)[:, :, None] + SQUARE[None, None]
        middle = worlds.vase.mean(axis=1, keepdims=True)
        vase = middle + (1 - sensing.CUT / VASE) * (worlds.vase - middle)
        corners = jnp.concatenate([dots, vase[:, None]], axis=1)
        there = jnp.ones(corners.shape[:2], bool)
        return worlds.pose, worlds.speeds, corners, there

    def _any(self, pool: Begun, key) -> Begun:
        at = jax.random.randint(key, self.options.robots, 0, len(pool.seen))
        return jax.tree.map(lambda x: x[at], pool)


def _rows_of(which, yes, no):
    """Rows of one tree or the other."""

    def one(yes, no):
        return jnp.where(which.reshape(-1, *[1] * (no.ndim - 1)), yes, no)

    return jax.tree.map(one, yes, no)


def train(options: Options) -> None:
    """Train, and write rows. Goes on, in new worlds, where a policy of that name was saved."""
    begun, file = time.perf_counter(), options.out.with_suffix(".policy")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with jax.enable_x64(True):
        device, (learner, sums) = Device(options), kept_in(file, options.seed)
        pool, round_of = device.pool(), jax.jit(device.round, donate_argnums=(0, 1))
        run = jax.jit(device.begin)(pool, keys_of(options.seed, sums["rounds"], 1)[1][0])
        each, counts = options.robots * options.horizon, []
        while sums["rounds"] * each < options.steps:
            keys = keys_of(options.seed, sums["rounds"], options.horizon)
            learner, run, found = round_of(learner, run, pool, *keys)
            counts.append(found)
            sums["rounds"] += 1
            if sums["rounds"] % options.every and sums["rounds"] * each < options.steps:
                continue
            for one in jax.device_get(counts):
                sums |= {name: sums[name] + one[name].item() for name in SUMMED}
            counts = []
            save(file, learner, sums)
            row = {"steps": sums["rounds"] * each, "gained": round(sums["gained"], 3)}
            row |= {name: n for name, n in sums.items() if name != "gained"}
            row |= {"multiplier": round(float(learner.multiplier), 4)}
            row |= {"seconds": round(time.perf_counter() - begun, 1)}
            row |= {"uncertified": options.pool - len(pool.seen)}
            with options.out.open("a", newline="") as table:
                writer = csv.DictWriter(table, list(row))
                if not table.tell():
                    writer.writeheader()
                writer.writerow(row)


def kept_in(file: Path, seed: int) -> tuple[Learner, dict]:
    """What was saved, or what begins, with sums of all counts so far."""
    weights, state = fresh(jax.random.PRNGKey(seed))
    kept = {"weights": weights, "state": state, "scale": dict(Scale(SEEN).__dict__)}
    kept |= {"counts": dict.fromkeys(("rounds", *SUMMED[1:]), 0), "multiplier": 0.0, "gained": 0.0}
    if file.exists():
        kept = flax.serialization.from_bytes(kept, file.read_bytes())
    moments = tuple(jnp.asarray(kept["scale"][of], float) for of in MOMENTS)
    network = jax.tree.map(jnp.asarray, (kept["weights"], kept["state"]))
    learner = Learner(*network, moments, jnp.asarray(kept["multiplier"], jnp.float32))
    return learner, kept["counts"] | {"gained": kept["gained"]}


def save(file: Path, learner: Learner, sums: dict) -> None:
    """As `sims.point.train` does."""
    weights, state, moments, multiplier = jax.device_get(learner)
    kept = {"weights": weights, "state": state, "scale": dict(zip(MOMENTS, moments, strict=True))}
    kept |= {"counts": {name: n for name, n in sums.items() if name != "gained"}}
    kept |= {"multiplier": float(multiplier), "gained": sums["gained"]}
    file.write_bytes(flax.serialization.to_bytes(kept))


if __name__ == "__main__":
    import tyro

    train(tyro.cli(Options, description=__doc__))
