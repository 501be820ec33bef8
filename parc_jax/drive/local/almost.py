"""How nearly safe are the plans of a model? A search needs an order where no plan is safe.

The order is by the least margin of the verdict, negative where something lacks, under all of the
tube or under a part of it. Nothing is proved: margins say where to look. [T24]
"""

from typing import NamedTuple

import numpy as np

from parc_jax.common.climb import Ranked, climb, ranked
from parc_jax.common.sets.box import Box
from parc_jax.learning.bound.claim import stand_in
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.safe_set.verdict.pointwise import anchor, paths_of, verdicts
from parc_jax.safe_set.verdict.scene import Scene

DRAWS = 1024
CHILDREN = 512  # of all parents together, every round
PARENTS = 16
SPREADS = np.cumprod([0.2, *[0.65] * 7])  # [sides of the boxes of k and of ends] of the children
KEPT = 256  # plans


class Nearly(NamedTuple):
    """Plans, best first: p0 (n, n_p), k (n, n_k), room (n,) their least margins."""

    p0: np.ndarray
    k: np.ndarray
    room: np.ndarray

    @property
    def score(self) -> float:
        """Of the best plan; what compares two models. -inf when there is none."""
        return float(self.room[0]) if len(self.k) else -np.inf


def nearly_safe(
    scene: Scene, rng: np.random.Generator, part: float = 1.0, apart: float = 0.0
) -> Nearly:
    """Plans of a model, most nearly safe first: uniform draws, then rounds closer to the best.

    part: of the tube under which they are judged, 0 for the model alone. apart: [sides of K] of
    those from each other around which the next are drawn: several places of K are looked at.
    """
    model = scene.model
    judged_by = scene.under(_under(model, part))
    lo, hi = model.domain.lo, model.domain.hi
    k = rng.uniform(lo, hi, (DRAWS, model.n_k))
    z = rng.uniform(scene.z_lo, scene.z_hi, (DRAWS, model.n_p))
    first = judged(judged_by, anchor(scene, z, k)[0], k)

    def closer(best: Ranked, spread: float) -> tuple[np.ndarray, np.ndarray]:
        p0, k = best.x
        if not len(k):
            return p0, k
        chosen = rng.choice(spread_out(k, model.domain, PARENTS, apart), CHILDREN)
        ends = paths_of(model, p0[chosen], k[chosen])[:, -1, : model.n_p]
        move_k = spread * (hi - lo) * rng.uniform(-1, 1, (CHILDREN, model.n_k))
        near_k = np.clip(k[chosen] + move_k, lo, hi)
        near_z = ends + spread * (scene.z_hi - scene.z_lo) * rng.uniform(-1, 1, ends.shape)
        return anchor(scene, near_z, near_k)[0], near_k

    begin = Ranked((first.p0, first.k), first.room)
    found = climb(begin, closer, lambda x: verdicts(judged_by, *x).room, SPREADS, KEPT)
    return Nearly(*found.x, found.value)


def judged(scene: Scene, p0: np.ndarray, k: np.ndarray) -> Nearly:
    """The best of the plans p0 (n, n_p), k (n, n_k)."""
    room = verdicts(scene, p0, k).room
    best = ranked((p0, k), room).at(slice(min(KEPT, int((room > -np.inf).sum()))))
    return Nearly(*best.x, best.value)


def spread_out(k: np.ndarray, domain: Box, most: int, apart: float) -> np.ndarray:
    """(m,) numbers of good plans, best first in k (n, n_k): the k of each at least `apart` [sides
    of the domain] from the better ones.
    """
    side = domain.hi - domain.lo
    chosen: list[int] = []
    for number, own in enumerate(k):
        if all(np.abs((own - k[other]) / side).max() >= apart for other in chosen):
            chosen.append(number)
        if len(chosen) == most:
            break
    return np.array(chosen, int)


def shrunk(given: Tube, part: float) -> Tube:
    """The tube with this part of its half widths, or more; a bin without claim keeps none."""
    halves = (np.where(np.isinf(half), half, part * half) for half in given.halves)
    return given.with_halves(*halves)


def _under(model: TrajectoryModel, part: float) -> TrajectoryModel:
    """The model with a part of its tube, about which nothing is claimed."""
    if part == 1.0:
        return model
    return model.replace(claim=stand_in(model.claim, shrunk(model.tube, part)))
