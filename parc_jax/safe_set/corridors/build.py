"""Corridors built around safe plans that satisfy none."""

from collections.abc import Iterator
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.arrays import in_chunks, once, x64
from parc_jax.learning.bound.tube import Tube
from parc_jax.safe_set.corridors.choose import PLANS, Chosen, allowed_of, choose_batch
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.sampling import Points, joined
from parc_jax.safe_set.verdict.scene import Scene

SEEDS = 16  # whose corridors are chosen together
CALL = 4  # of which so many in one compiled call; the first corridor of a query comes from one call
CANDIDATES = 1024  # waiting plans among which a seed finds its neighbours
COMPARED = 10  # knots at which paths are compared
# [of the best of its batch] a corridor that adds less is chosen anew when the better ones are in
WORTH = 0.1


class Building(NamedTuple):
    """The corridors of a search and its waiting plans.

    counts: (c,) plans that were assigned to each corridor.
    waiting: safe plans that satisfy none.
    tried: number of corridors chosen so far; of each batch the best ones stay.
    """

    corridors: Corridors
    counts: np.ndarray
    waiting: Points
    tried: int = 0


def nothing_built(tube: Tube, points: Points) -> Building:
    """No corridor under a tube, and waiting plans."""
    return Building(Corridors(tube), np.zeros(0, int), points)


def admit(building: Building, points: Points) -> tuple[Building, np.ndarray]:
    """Assign plans to corridors: (b,) bool, which satisfy one. The others wait."""
    # those that hold most plans are tried first
    popular = np.argsort(-building.counts, kind="stable")
    result = building.corridors.first(points.path, points.bin, popular)
    held = result >= 0
    counts = building.counts + np.bincount(result[held], minlength=len(building.corridors))
    waiting = joined([building.waiting, points.at(~held)])
    return building._replace(counts=counts, waiting=waiting), held


def build(scene: Scene, building: Building, rng: np.random.Generator) -> Building:
    """One batch: corridors around some of the plans that wait; a small one for the first corridor.

    Fewer wait afterwards: a seed that no short direction separates is given up, and left uncovered.
    Where none waits nothing is built.
    """
    points = building.waiting
    if not len(points.k):
        return building
    n_seeds = min(SEEDS if len(building.corridors) else CALL, len(points.k))
    seeds = rng.choice(len(points.k), n_seeds, replace=False)
    plans = _with_neighbours(points, seeds, rng)
    chosen = Corridors(building.corridors.tube, _around(scene, building, plans))
    kept = chosen.kept(points.path, points.bin)
    done = np.zeros(len(points.k), bool)
    # a seed that no short direction separates is given up, else it would be drawn for ever
    done[seeds] = ~kept[seeds].any(axis=1)
    taken = []
    for c in greedy(kept, WORTH):
        done |= kept[:, c]
        # the corridor is named with a plan that the float64 test found inside
        plan = points.at(int(np.argmax(kept[:, c])))
        taken.append(chosen.all[c]._replace(p0=plan.p0, k=plan.k))
    return Building(
        corridors=building.corridors.with_more(taken),
        counts=np.append(building.counts, np.zeros(len(taken), int)),
        waiting=points.at(~done),
        tried=building.tried + n_seeds,
    )


def greedy(kept: np.ndarray, worth: float = 0.0) -> Iterator[int]:
    """Greedy set cover: columns of `kept` (b, c); each adds most rows, >= `worth` of the first."""
    left = np.ones(len(kept), bool)
    least = 1.0
    while kept.size:
        gain = kept[left].sum(axis=0)
        best = int(np.argmax(gain))
        if gain[best] < least:
            return
        least = max(least, worth * gain[best])
        left &= ~kept[:, best]
        yield best


def _with_neighbours(points: Points, seeds: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(s, PLANS) plans: every seed, then those of some candidates whose paths are nearest to it."""
    n = len(points.k)
    candidates = rng.choice(n, min(n, CANDIDATES), replace=False)
    knots = np.linspace(0, points.path.shape[1] - 1, COMPARED).astype(int)
    path = points.path[:, knots].reshape(n, -1).astype(np.float32)
    among = path[candidates]
    distance = np.array([np.abs(among - own).max(axis=1) for own in path[seeds]])
    again = np.arange(PLANS - 1) % len(candidates)  # where they are few, some serve twice
    order = np.argsort(distance, axis=1)[:, again]
    return np.concatenate([seeds[:, None], candidates[order]], axis=1)


def _around(scene: Scene, building: Building, plans: np.ndarray) -> list[Corridor]:
    """A corridor for every row (s, PLANS) of a seed and its neighbours, CALL rows at a time."""
    points, arrays, allowed = building.waiting, scene.tabled, once(scene, allowed_of)

    def call(rows: np.ndarray):
        some = plans[rows]
        path = points.path[some].astype(np.float32)
        with x64():
            of_some = allowed._replace(bins=points.bin[some])
            return jax.device_get(choose_batch(arrays, path, of_some))

    return _spelled_out(scene, in_chunks(len(plans), CALL, call))


def _spelled_out(scene: Scene, choice: Chosen) -> list[Corridor]:
    """Corridors of chosen directions. Those of a seed are first rounded to short multipliers."""
    table, n = scene.directions, int(scene.count)
    active, direction = scene.obstacles.active[:n], choice.direction[:, :n]
    n_w = table.w.shape[1]
    column = np.minimum(direction, n_w - 1)
    o = np.arange(n)[None, :, None]
    w, support = table.w[o, column], table.support[o, column]
    multipliers = table.spelled()[o, column]
    of_seed = (direction == n_w) & active & choice.kept[:, None, None]
    for j in np.flatnonzero(of_seed.any(axis=(0, 2))):
        of_pair = np.argwhere(of_seed[:, j])
        nearest = choice.nearest[:, j][of_seed[:, j]].astype(np.float64)
        for (i, t), m in zip(of_pair, table.nearest_of_many(j, nearest), strict=True):
            w[i, j, t], support[i, j, t] = table.direction(j, m)
            multipliers[i, j, t] = m
    support = np.where(active, support + scene.slack * np.abs(w).sum(axis=3), -np.inf)
    none = np.zeros(0)  # the plan that shows that it is not empty is named when it is taken
    points = scene.obstacles.points[:n]
    chosen = zip(w, support, multipliers, strict=True)
    return [Corridor(*fields, points, none, none, scene.apart) for fields in chosen]
