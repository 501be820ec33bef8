"""Safe plans that uniform draws miss, by multilevel splitting, and their proposal region. [T24]

The level is the least margin of a plan's verdict: the best quarter of a population stays, is copied
and moved about inside its level, and so on until the level is safe. A share of 1e-8 is thirteen
quarters. This is a search: its plans are judged like any other, and safe plans that it misses may
exist. `common.climb` ends around the best candidate; here all of a level is moved about, so that
the result is spread over the safe set.
"""

import logging

import numpy as np

from parc_jax.common.climb import Ranked
from parc_jax.safe_set.corridors.sampling import (
    Place,
    box_of_plans,
    ends_from,
    place_around,
    plans_of,
)
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene

POPULATION = 512  # of the first climb
KEPT = 0.25  # of a population, at every level
MOVES = 6  # of every plan, at every level
SPREAD_MOVES = 12  # of safe plans, before they say where the safe set is
MOST_LEVELS = 60
PATIENCE = 4  # levels without PROGRESS, a share of what a level still lacks, that end a climb
PROGRESS = 0.05
JITTER = 1e-10  # [sides of K and of the goal's box] added to every move
_log = logging.getLogger(__name__)
JUMP = 2.38  # of differential evolution, over the square root of twice the dimension


def where_safe(scene: Scene, rng: np.random.Generator, largest: int, limit: Limit) -> Place | None:
    """The proposal region around the safe plans of a splitting; populations double until one
    succeeds, or the largest has failed. One that the limit cuts off may still have safe plans.
    """
    size = POPULATION
    while True:
        if (safe := _raise_to_safe(scene, rng, size, limit)) is not None:
            return _around(scene, rng, safe, limit)
        if size >= largest or limit.over():
            return None
        size *= 2


def where_around(
    scene: Scene, rng: np.random.Generator, p0: np.ndarray, k: np.ndarray, limit: Limit
) -> Place:
    """A place around the safe plans near one, p0 (n_p,), k (n_k,)."""
    seed = np.concatenate([ends_from(p0, scene.model, k[None])[0], k])
    lo, hi = box_of_plans(scene)
    # a cloud so small that most of it is safe too, wherever that plan lies
    for size in 0.5 ** np.arange(4, 40, 3):
        x = np.clip(seed + size * (hi - lo) * rng.standard_normal((POPULATION, len(seed))), lo, hi)
        margin = _margins(scene, x)
        if (margin > 0).mean() >= KEPT:
            return _around(scene, rng, Ranked(x, margin).at(margin > 0), limit)
    return place_around(np.repeat(seed[None], 2, axis=0), lo, hi)


def _raise_to_safe(scene: Scene, rng: np.random.Generator, n: int, limit: Limit):
    """Safe plans, or None where the climb ends below."""
    lo, hi = box_of_plans(scene)
    x = rng.uniform(lo, hi, (n, len(lo)))
    plans = Ranked(x, _margins(scene, x))
    limit.start()  # what comes before mostly compiles
    if not np.isfinite(plans.value).any():
        return None
    levels = [_level(plans)]
    for _ in range(MOST_LEVELS):
        if levels[-1] >= 0:
            break
        _log.info("%d plans climb to safe ones: a quarter lack at most %.3g", n, -levels[-1])
        plans = _copied(rng, plans, levels[-1], n)
        plans = _moved(scene, rng, plans, levels[-1], MOVES, limit)
        levels.append(_level(plans))
        before = levels[-1 - PATIENCE] if len(levels) > PATIENCE else -np.inf
        if levels[-1] < (1 - PROGRESS) * before or limit.over():
            break
    safe = plans.value > 0
    return plans.at(safe) if safe.any() else None


def _level(plans: Ranked) -> float:
    """The margin that the share KEPT of the plans have, but no more than a safe one needs."""
    finite = np.where(np.isfinite(plans.value), plans.value, -np.finfo(float).max)
    return min(float(np.quantile(finite, 1 - KEPT, method="higher")), 0.0)


def _copied(rng: np.random.Generator, plans: Ranked, level: float, n: int) -> Ranked:
    """n plans drawn from those of at least this level."""
    among = np.flatnonzero(plans.value >= level)
    return plans.at(among[rng.integers(0, len(among), n)])


def _moved(
    scene: Scene, rng: np.random.Generator, plans: Ranked, level: float, moves: int, limit: Limit
) -> Ranked:
    """The plans after some moves that never leave the level: steps along differences of others,
    which fit a level however thin and slanted it is. limit: may end them between two moves.
    """
    lo, hi = box_of_plans(scene)
    n, dim = plans.x.shape
    x, margin = plans
    for move in range(moves):
        if limit.over():
            break
        a, b = rng.integers(0, n, (2, n))
        # every third move is long: from one island of a level to another
        scale = 1.0 if move % 3 == 2 else JUMP / np.sqrt(2 * dim) * rng.uniform(0.2, 1.0, (n, 1))
        step = scale * (x[a] - x[b]) + JITTER * (hi - lo) * rng.standard_normal((n, dim))
        tried = x + step
        inside = ((lo <= tried) & (tried <= hi)).all(axis=1)
        new = np.full(n, -np.inf)
        new[inside] = _margins(scene, tried[inside])
        better = new >= level
        x = np.where(better[:, None], tried, x)
        margin = np.where(better, new, margin)
    return Ranked(x, margin)


def _around(scene: Scene, rng: np.random.Generator, safe: Ranked, limit: Limit) -> Place:
    """A place around all the safe plans that moves from these lead to."""
    above = np.finfo(float).tiny
    plans = _copied(rng, safe, above, POPULATION)
    plans = _moved(scene, rng, plans, above, SPREAD_MOVES, limit)
    return place_around(plans.x, *box_of_plans(scene))


def _margins(scene: Scene, x: np.ndarray) -> np.ndarray:
    """(b,) least margin of the verdicts on x (b, n), positive for safe plans."""
    return verdicts(scene, *plans_of(scene, x)).room if len(x) else np.zeros(0)
