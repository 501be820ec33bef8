"""Stochastic local search: the best candidates so far have children, closer and closer to them. It
says where to look; that it misses a candidate proves nothing.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import jax
import numpy as np

Points = np.ndarray | tuple[np.ndarray, ...]  # candidates (n, ...); a tuple holds parts of each


class Ranked(NamedTuple):
    """Candidates x (n, ...), of a climb the best first. value (n,): of each, larger is better."""

    x: Points
    value: np.ndarray

    @property
    def score(self) -> float:
        """The value of the first; -inf without a candidate."""
        return float(self.value[0]) if len(self.value) else -np.inf

    def at(self, index) -> "Ranked":
        """Those of an index array or slice."""
        return jax.tree.map(lambda part: part[index], self)


def ranked(x: Points, value: np.ndarray) -> Ranked:
    """Candidates in the order of their values (n,); equal ones in the order they came."""
    return Ranked(x, value).at(np.argsort(-value, kind="stable"))


def climb(
    begin: Ranked,
    children: Callable[[Ranked, float], Points],
    value: Callable[[Points], np.ndarray],
    spreads: Iterable[float],
    kept: int | None = None,
) -> Ranked:
    """The best candidates after a round of children for every spread.

    begin: the first candidates. children: (best so far, spread) -> new ones, or none.
    value: of candidates (n, ...) -> (n,); those of -inf are dropped. kept: number that stays from
    round to round, None = all.
    """
    best = begin
    for spread in spreads:
        x = children(best, spread)
        if not len(jax.tree.leaves(x)[0]):
            continue
        new = Ranked(x, value(x))
        new = new.at(np.flatnonzero(new.value > -np.inf))
        joined = jax.tree.map(lambda *parts: np.concatenate(parts), best, new)
        best = ranked(*joined).at(slice(kept))
    return best
