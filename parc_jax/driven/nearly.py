"""How nearly safe are the plans of a model? A search needs an order where no plan is safe.

A plan scores by the largest share of its tube under which it would be safe, -1 when it would not be
even without one, and then by its least margin. Nothing is proved: scores say where to look. [T24]
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from parc_jax.claim.tube import Tube
from parc_jax.model import TrajectoryModel
from parc_jax.verdict.pointwise import Verdicts, anchor, paths_of, verdicts
from parc_jax.verdict.scene import Scene

# [1] shares of a tube that are tried, the largest first; with 1 a plan is safe
LADDER = (1.0, 0.8, 0.6, 0.4, 0.2)
DRAWS = 2048
KEPT = 256  # plans with most room under no tube at all, which alone are tried under parts of it
CLOSER = 3  # rounds of draws around the best plans
AROUND = 8  # best plans that have children
SPREAD = 0.15  # [sides of the boxes of k and of ends] of children, halved every round


class Nearly(NamedTuple):
    """Plans and their scores, best first: p0 (n, n_p), k (n, n_k), share (n,) of the tube, room
    (n,) least margin under that share.
    """

    p0: np.ndarray
    k: np.ndarray
    share: np.ndarray
    room: np.ndarray

    @property
    def score(self) -> tuple[float, float]:
        """Of the best plan; what compares two models. (-1, -inf) when there is none."""
        return (float(self.share[0]), float(self.room[0])) if len(self.k) else (-1.0, -np.inf)


def nearly_safe(model: TrajectoryModel, scene: Scene, rng: np.random.Generator) -> Nearly:
    """Plans of a model that end in the goal, the most nearly safe first. Uniform draws, then draws
    closer to the best.
    """
    lo, hi = model.domain.lo, model.domain.hi
    k = rng.uniform(lo, hi, (DRAWS, model.n_k))
    z = rng.uniform(scene.z_lo, scene.z_hi, (DRAWS, model.n_p))
    best = judged(model, scene, z, k)
    spread = SPREAD
    for _ in range(CLOSER):
        parents = np.arange(min(AROUND, len(best.k)))
        if not len(parents):
            return best
        chosen = rng.choice(parents, DRAWS // 8)
        ends = _ends(model, best)[chosen]
        near_k = best.k[chosen] + spread * (hi - lo) * rng.uniform(-1, 1, (len(chosen), model.n_k))
        move = spread * (scene.z_hi - scene.z_lo) * rng.uniform(-1, 1, ends.shape)
        best = _joined(best, judged(model, scene, ends + move, np.clip(near_k, lo, hi)))
        spread /= 2
    return best


def judged(model: TrajectoryModel, scene: Scene, z: np.ndarray, k: np.ndarray) -> Nearly:
    """The plans with these predicted ends z (n, n_p) and k (n, n_k), the best of them."""
    p0, _ = anchor(model, scene, z, k)
    room = _room(verdicts(_under(model, 0.0), scene, p0, k))
    order = np.argsort(-room, kind="stable")[:KEPT]
    order = order[np.isfinite(room[order])]
    p0 = p0[order]
    k = k[order]
    room = room[order]
    share = np.where(room > 0, 0.0, -1.0)
    left = np.flatnonzero(room > 0)
    for part in LADDER:
        if not len(left):
            break
        e = verdicts(_under(model, part), scene, p0[left], k[left])
        share[left[e.safe]] = part
        room[left[e.safe]] = _room(e)[e.safe]
        left = left[~e.safe]
    return _sorted(Nearly(p0, k, share, room))


def _room(e: Verdicts) -> np.ndarray:
    """(n,) the least margin of each plan."""
    return np.minimum(np.minimum(e.goal, e.start), e.clearance)


def _under(model: TrajectoryModel, part: float) -> TrajectoryModel:
    """The model with a part of its tube, about which nothing is claimed."""
    if part == 1.0:
        return model
    return model.replace(claim=replace(model.claim, tube=shrunk(model.tube, part)))


def shrunk(given: Tube, part: float) -> Tube:
    """The tube with this part of its half widths, or more than them; a bin without claim keeps
    none.
    """
    halves = (np.where(np.isinf(half), half, part * half) for half in given.halves)
    return given.with_halves(*halves)


def _ends(model: TrajectoryModel, plans: Nearly) -> np.ndarray:
    return paths_of(model, plans.p0[:AROUND], plans.k[:AROUND])[:, -1, : model.n_p]


def _joined(a: Nearly, b: Nearly) -> Nearly:
    return _sorted(Nearly(*(np.concatenate(pair) for pair in zip(a, b, strict=True))))


def _sorted(plans: Nearly) -> Nearly:
    order = np.lexsort((-plans.room, -plans.share))
    order = order[:KEPT]
    return Nearly(*(part[order] for part in plans))
