"""The plans that keep to one of some corridors: membership, and uniform samples by rejection.

No region and no polytope is needed, so this is as cheap for many parameters as for two: draws that
are uniform over all that could reach the goal, those kept that are safe and keep to a corridor.
"""

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.place import Place
from parc_jax.safe_set.corridors.plan_set import PlanSet
from parc_jax.safe_set.corridors.sampling import (
    FIRST_DRAW,
    HOPELESS,
    LARGEST_DRAW,
    Counts,
    Points,
    draw,
)
from parc_jax.safe_set.verdict.scene import Scene


class KeptPlans(PlanSet):
    """All safe plans that keep to a corridor; within a place, where the search was within one."""

    def __init__(self, scene: Scene, corridors: Corridors, within: Place | None):
        super().__init__(scene)
        self.corridors = corridors
        self.within = within

    @property
    def inner(self) -> np.ndarray:
        """The plans that the corridors were named with."""
        return self._rows([np.concatenate([c.p0, c.k]) for c in self.corridors.all])

    def has(self, safe: Points) -> np.ndarray:
        """(b,) bool: which of some plans that reach the goal keep to a corridor."""
        return self.corridors.first(safe.path, safe.bin) >= 0

    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """n plans (n, n_p + n_k), uniform over the set, which is that of `draw` but for what is not
        safe or keeps to no corridor.
        """
        if not len(self.corridors):
            raise InputError(
                "sample: expected an answer with corridors or safe polytopes; this one has none to "
                "sample from."
            )
        tally = Counts()
        parts = [self._rows([])]
        left = n
        while left > 0:
            size = 1.2 * left * tally.drawn / max(n - left, 1)
            some = int(np.clip(size, FIRST_DRAW, LARGEST_DRAW))
            one = draw(self.scene, rng, some, self.within)
            kept = one.safe.at(self.has(one.safe))
            parts.append(np.concatenate([kept.p0, kept.k], axis=1))
            tally = tally.plus(one)
            left -= len(kept.k)
            if left == n and tally.drawn >= HOPELESS:
                raise InputError(
                    f"sample: expected a set that one of {HOPELESS:,} draws meets; this one is too "
                    "small. Use `samples`, or cut polytopes with `with_polytopes`."
                )
        return np.concatenate(parts)[:n]
