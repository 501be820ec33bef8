"""A set of safe plans, however it is described: who is in it, uniform samples of it, how much of K
it serves.
"""

from abc import ABC, abstractmethod

import numpy as np

from parc_jax.learning.bound.counts import least_probability
from parc_jax.safe_set.corridors.sampling import Points, ends_from, points, safe_ones
from parc_jax.safe_set.verdict.pointwise import paths_of, predictions
from parc_jax.safe_set.verdict.scene import Scene

ENDS = 8  # predicted ends at which `share_of_k` tries every k


class PlanSet(ABC):
    """Plans of one model in one scene, all of them safe."""

    def __init__(self, scene: Scene):
        self.model = scene.model
        self.scene = scene

    @property
    @abstractmethod
    def inner(self) -> np.ndarray:
        """(m, n_p + n_k) plans of the set, well spread; none where it is empty."""

    @abstractmethod
    def has(self, safe: Points) -> np.ndarray:
        """(b,) bool: which of some plans that reach the goal are in the set."""

    @abstractmethod
    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """n plans (n, n_p + n_k), uniform over the set."""

    def contains(self, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
        """p0 (b, n_p), k (b, n_k) -> bool (b,): proved safe in float64 and in the set. The corridor
        that holds a plan shows that it touches nothing; no distance is measured. [T27]
        """
        e = predictions(self.scene, p0, k)
        out = e.reaches
        out[out] = self.has(points(p0, k, e).at(out))
        return out

    def share_of_k(self, n: int = 20_000) -> float:
        """Lower 99.9 % confidence bound of the share of K that has a safe start in the set.
        Deterministic draw.

        A k belongs when a start in the set leads to one of a few predicted ends, those of inner
        plans. Sufficient, so the share is never too large.
        """
        rng = np.random.default_rng(0)
        k = rng.uniform(self.model.domain.lo, self.model.domain.hi, (n, self.model.n_k))
        if not len(self.inner):
            return 0.0
        hit = np.zeros(n, bool)
        for z in self._ends() if self.scene.at is None else self.scene.at[None]:
            left = np.flatnonzero(~hit)
            if len(left) == 0:
                break
            some = k[left]
            ends_here = np.broadcast_to(z, (len(left), len(z)))
            if self.scene.at is not None:
                ends_here = ends_from(self.scene.at, self.model, some)
            seen, safe = safe_ones(self.scene, ends_here, some)
            hit[left[seen.row]] = self.has(safe)
        return least_probability(int(hit.sum()), n, 0.001)

    def _ends(self) -> np.ndarray:
        """A few well-spread predicted ends (m, n_p) of inner plans: farthest-point order."""
        p0, k = np.split(self.inner, [self.model.n_p], axis=1)
        ends = paths_of(self.model, p0, k)[:, -1, : self.model.n_p]
        chosen = [int(np.argmin(np.abs(ends - np.median(ends, axis=0)).sum(axis=1)))]
        distance = np.full(len(ends), np.inf)
        while len(chosen) < min(ENDS, len(ends)):
            distance = np.minimum(distance, np.abs(ends - ends[chosen[-1]]).sum(axis=1))
            chosen.append(int(np.argmax(distance)))
        return ends[chosen]

    def _rows(self, plans: list[np.ndarray]) -> np.ndarray:
        """(m, n_p + n_k) of a list of plans, which may be empty."""
        return np.array(plans, float).reshape(len(plans), self.model.n_p + self.model.n_k)
