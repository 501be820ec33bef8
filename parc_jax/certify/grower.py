"""The loop that grows corridors around plans that keep to none."""

from collections.abc import Iterator

import jax
import numpy as np

from parc_jax.arrays import on_all_cores, x64
from parc_jax.avoid.directions import DirectionTable, direction, multiplier_near
from parc_jax.certify.corridor import Corridor, Corridors
from parc_jax.certify.draw import Points, joined
from parc_jax.certify.grow import POINTS, Growth, grow_batch
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

SEEDS = 16  # grown together
CALL = 4  # of which so many in one compiled call; the first corridor of a query comes from one call
CANDIDATES = 1024  # waiting plans among which a seed finds its mates
LOOK_AT = 10  # knots at which paths are compared
WORTH = 0.1  # [of the best of its batch] a corridor that adds less is grown anew when the better ones are in


class Grower:
    """Corridors found so far. `keep` shows it safe plans, `grow` adds corridors around those that keep to none."""

    def __init__(self, model: TrajectoryModel, problem: ReachAvoid, scene: Scene, rng: np.random.Generator):
        self.model, self.problem, self.scene, self.rng = model, problem, scene, rng
        self.corridors = Corridors(model.tube.interval)
        self.waiting: Points | None = None
        self._spelled = _objects(scene.directions)

    def keep(self, points: Points) -> np.ndarray:
        """(b,) bool: keeps to some corridor. The others wait for one."""
        kept = self.corridors.first(points.path, points.bin) >= 0
        new = points.at(~kept)
        self.waiting = new if self.waiting is None else joined([self.waiting, new])
        return kept

    def grow(self, leave: int = 0, few: bool = False) -> Iterator[None]:
        """Grow corridors until at most `leave` plans wait. Yields after each batch; few: start with a small one."""
        while self.waiting is not None and len(self.waiting.k) > leave:
            points = self.waiting
            seeds = self.rng.choice(len(points.k), min(CALL if few else SEEDS, len(points.k)), replace=False)
            few = False
            grown = Corridors(self.corridors.interval, self._grown(points, seeds))
            kept = grown.kept(points.path, points.bin)
            done = np.zeros(len(points.k), bool)
            done[seeds] = ~kept[seeds].any(axis=1)  # not separable in short fractions: given up, and left uncovered
            for number in greedy(kept, WORTH):
                done |= kept[:, number]
                first = points.at(int(np.argmax(kept[:, number])))
                self.corridors.append(grown.all[number]._replace(p0=first.p0, k=first.k))
            self.waiting = points.at(~done)
            yield

    def _grown(self, points: Points, seeds: np.ndarray) -> list[Corridor]:
        """A corridor around every seed, CALL seeds at a time."""
        plans = self._with_mates(points, seeds)
        arrays, interval = self.scene.arrays, self.corridors.interval

        def call(first):
            some = plans[np.resize(np.arange(first, min(first + CALL, len(seeds))), CALL)]
            path, error = points.path[some].astype(np.float32), interval[points.bin[some]].astype(np.float32)
            with x64():
                return jax.device_get(grow_batch(arrays, path, error))

        parts = on_all_cores(call, range(0, len(seeds), CALL))
        return self._spelled_out(Growth(*(np.concatenate(field)[: len(seeds)] for field in zip(*parts, strict=True))))

    def _with_mates(self, points: Points, seeds: np.ndarray) -> np.ndarray:
        """(s, POINTS) plans: every seed, then those of some candidates whose paths are nearest to its own."""
        n = len(points.k)
        candidates = self.rng.choice(n, min(n, CANDIDATES), replace=False)
        knots = np.linspace(0, points.path.shape[1] - 1, LOOK_AT).astype(int)
        path = points.path[:, knots].reshape(n, -1)
        distance = np.abs(path[seeds][:, None] - path[candidates][None]).max(axis=2)
        order = np.argsort(distance, axis=1)[:, np.arange(POINTS - 1) % len(candidates)]  # again where they are few
        return np.concatenate([seeds[:, None], candidates[order]], axis=1)

    def _spelled_out(self, growth: Growth) -> list[Corridor]:
        """Look the chosen directions up; a seed's own nearest ones are first rounded to short multipliers."""
        table, active = self.scene.directions, self.scene.obstacles.active
        n_w = table.w.shape[1]
        known = np.minimum(growth.choice, n_w - 1)
        o = np.arange(len(table.w))[None, :, None]
        w, reach, spelled = table.w[o, known], table.reach[o, known], self._spelled[o, known]
        for i, j, t in np.argwhere((growth.choice == n_w) & active & growth.kept[:, None, None]):
            own = multiplier_near(self.problem, table, j, growth.nearest[i, j, t].astype(np.float64))
            w[i, j, t], reach[i, j, t] = direction(self.problem, j, own)
            spelled[i, j, t] = own
        reach = np.where(active, reach + self.scene.slack * np.abs(w).sum(axis=3), -np.inf)
        none = np.zeros(0)  # the plan that shows that it is not empty is named when it is taken
        return [Corridor(*fields, none, none) for fields in zip(w, reach, spelled, strict=True)]


def greedy(kept: np.ndarray, worth: float = 0.0) -> Iterator[int]:
    """Greedy set cover: columns of kept (b, c), the next always adding most rows, at least `worth` of the first."""
    left, least = np.ones(len(kept), bool), 1.0
    while kept.size:
        gain = kept[left].sum(axis=0)
        best = int(np.argmax(gain))
        if gain[best] < least:
            return
        least = max(least, worth * gain[best])
        left &= ~kept[:, best]
        yield best


def _objects(table: DirectionTable) -> np.ndarray:
    """Multipliers (o, d) as an object array, looked up by index like w; None for obstacles that only pad."""
    out = np.empty(table.reach.shape, object)
    for j, row in enumerate(table.multipliers):
        for d, m in enumerate(row):
            out[j, d] = m
    return out
