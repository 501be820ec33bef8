"""PPO on PointGoal from its first step on behind the shield, or without it, or with a Lagrangian:

    python -m sims.point.train --steps 1000000 [--penalty 0.01 --patience 100] [--bare [--limit 25]]
    python -m sims.point.train --steps 1000000 --bare --robot Car | --level 2

One row of a CSV per round of rollouts, with counts of all steps so far: reward gained, steps in
contact, those in which a true pose of every 10 ms was inside a hazard, of which there are none
behind the shield; actions that it changed, steps without a new manoeuvre, tubes left; worlds that
were left because the robot stood. Hazards are known to the shield; the policy has the lidar. Beside
the CSV stands the policy, with all that is needed to go on from it in new worlds.
"""

import csv
import time
from dataclasses import dataclass
from typing import Literal

import flax.serialization
import jax
import numpy as np

from sims.point.policy import Scale
from sims.point.ppo import Rows, Training, act, fresh, keys_of, learn, raised
from sims.point.together import KITS, measured, shield_of
from sims.point.world import HAZARD, World

STANDS = 0.1  # [m] from where it was, within which a robot stands
COUNTED = ("entered", "changed", "stopped", "left", "stood")


@dataclass(frozen=True)
class Options(Training):
    """How much, and of what."""

    steps: int = 200_000
    worlds: int = 64
    horizon: int = 32
    """Steps of each world between updates."""
    level: int = 1
    robot: Literal["Point", "Car"] = "Point"


class Worlds:
    """Some worlds at once, behind one shield. begin: round in which they begin."""

    def __init__(self, options: Options, begin: int):
        n, kit = options.worlds, KITS[options.robot]
        self.envs = [kit.goal(options.level) for _ in range(n)]
        self.module = kit.module
        self.draw = np.random.default_rng((options.seed, begin))
        self.options, self.counts = options, dict.fromkeys(COUNTED, 0)
        self.seen = np.array([self.reset(env) for env in self.envs])
        self.last, self.since = np.full((n, 2), np.nan), np.zeros(n, int)  # where, how long ago
        self.start, self.decide = (None, None) if options.bare else shield_of(options.robot)
        if self.start is not None:
            self.under_way = self._started(np.ones(n, bool))

    def reset(self, env) -> np.ndarray:
        """A fresh world, of a robot whose start is certified to stop: all of them are at rest."""
        return env.reset(seed=int(self.draw.integers(2**32)))[0]

    @property
    def worlds(self) -> list[World]:
        """As they truly are."""
        return [env.world for env in self.envs]

    def _started(self, which: np.ndarray):
        with jax.enable_x64(True):
            new = jax.tree.map(np.asarray, self.start(*measured(self.module, self.worlds)))
        if not new.certified[which].all():
            raise RuntimeError("expected a certified stop at each reset")
        return new

    def step(self, actions: np.ndarray):
        """(4, worlds): rewards, costs, ends, penalties. What ends or is left is replaced."""
        driven, changed = actions.astype(np.float64), np.zeros(len(actions), bool)
        if self.start is not None:
            with jax.enable_x64(True):
                told = self.decide(self.under_way, *measured(self.module, self.worlds), driven)
            before = np.asarray(self.under_way.left)
            self.under_way, told = jax.tree.map(np.asarray, told)
            driven, changed = told.action, told.changed
            self._count(
                changed=changed, stopped=told.reason > 0, left=self.under_way.left & ~before
            )
        rows, ends = [], np.zeros(len(actions), bool)
        for i, env in enumerate(self.envs):
            self.seen[i], reward, ended, over, info = env.step(np.clip(driven[i], -1, 1))
            rows.append((reward, info["cost"]))
            ends[i] = ended or over
        ends |= self._looked()
        for i in np.flatnonzero(ends):
            self.seen[i], self.last[i] = self.reset(self.envs[i]), np.nan
        if self.start is not None and ends.any():
            new = self._started(ends)
            self.under_way = jax.tree.map(
                lambda x, y: np.where(ends.reshape(-1, *[1] * (x.ndim - 1)), y, x),
                self.under_way,
                new,
            )
        return np.array([*np.transpose(rows), ends, self.options.penalty * changed], np.float32)

    def _looked(self) -> np.ndarray:
        """Which robots stand, (worlds,); counts those of which a true pose was inside a hazard."""
        paths = np.array([world.trace[-2:] for world in self.worlds])[..., :2]
        hazards = np.array([world.hazards for world in self.worlds])
        away = np.linalg.norm(paths[:, :, None] - hazards[:, None], axis=-1)
        self._count(entered=~(away > HAZARD).all(axis=(1, 2)))
        moved = ~(np.linalg.norm(paths[:, -1] - self.last, axis=1) < STANDS)
        self.last[moved], self.since = paths[moved, -1], np.where(moved, 0, self.since + 1)
        stands = (self.since >= self.options.patience) & (self.options.patience > 0)
        self._count(stood=stands)
        return stands

    def _count(self, **rows: np.ndarray) -> None:
        for name, found in rows.items():
            self.counts[name] += int(found.sum())


def train(options: Options) -> None:
    """Train, and write a row for each round. Goes on where a policy of that name was saved."""
    n, (seen,) = options.worlds, KITS[options.robot].goal(options.level).observation_space.shape
    scale, (weights, state) = Scale(seen), fresh(jax.random.PRNGKey(options.seed), seen)
    counts = dict.fromkeys(("rounds", "contact", "episodes", *COUNTED), 0)
    kept = {"weights": weights, "state": state, "scale": scale.__dict__, "counts": counts}
    kept |= {"multiplier": 0.0, "gained": 0.0}
    file = options.out.with_suffix(".policy")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    if file.exists():
        kept = flax.serialization.from_bytes(kept, file.read_bytes())
        weights, state, counts = kept["weights"], kept["state"], kept["counts"]
        scale.__dict__.update(kept["scale"])
    multiplier, gained, before = kept["multiplier"], kept["gained"], dict(counts)
    worlds = Worlds(options, counts["rounds"])
    while counts["rounds"] * options.horizon * n < options.steps:
        rows, (key, keys) = [], keys_of(options.seed, counts["rounds"], options.horizon)
        for own in np.asarray(keys):
            scaled = scale.learn(worlds.seen)
            action, density, value = map(np.asarray, act(weights, scaled, own))
            reward, cost, over, penalty = worlds.step(action)
            got = np.stack([reward - penalty, cost], axis=-1)
            rows.append((scaled, action, density, value, got, over))
            gained += float(reward.sum())
            counts["episodes"] += int(over.sum())
        of_round = Rows(*(np.stack(x) for x in zip(*rows, strict=True)))
        following = act(weights, scale(worlds.seen), own)[2]
        multiplier = raised(multiplier, of_round.got[..., 1].mean(), options.limit)
        weights, state = learn(weights, state, of_round, following, multiplier, key)
        counts["rounds"] += 1
        counts["contact"] += int(of_round.got[..., 1].sum())
        counts |= {name: before[name] + worlds.counts[name] for name in COUNTED}
        row = {"steps": counts["rounds"] * options.horizon * n, "gained": round(gained, 3)}
        row |= counts | {"multiplier": round(float(multiplier), 4)}
        row |= {"seconds": round(time.process_time(), 1)}
        kept = {"weights": weights, "state": state, "scale": scale.__dict__, "counts": counts}
        kept |= {"multiplier": multiplier, "gained": gained}
        file.write_bytes(flax.serialization.to_bytes(kept))
        with options.out.open("a", newline="") as table:
            writer = csv.DictWriter(table, list(row))
            if not table.tell():
                writer.writeheader()
            writer.writerow(row)


if __name__ == "__main__":
    import tyro

    train(tyro.cli(Options, description=__doc__))
