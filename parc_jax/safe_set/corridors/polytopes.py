"""The safe polytopes of a query: which corridors are used in which cells."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from parc_jax.safe_set.corridors.build import Building
from parc_jax.safe_set.corridors.polytope import SafePolytope
from parc_jax.safe_set.corridors.sampling import Points, groups
from parc_jax.safe_set.verdict.scene import Scene


class Cut(NamedTuple):
    """A polytope found: a corridor, by its number, in a cell. p0, k: an inner point. born: [s]
    after the query began.
    """

    cell: bytes
    p0: np.ndarray
    k: np.ndarray
    pattern: np.ndarray
    bin: int
    corridor: int
    born: float


class Polytopes:
    """Polytopes found so far. Nothing that is asked changes what the next question answers."""

    def __init__(self, cuts: Iterable[Cut] = ()):
        self.cuts = tuple(cuts)
        self._row: dict[bytes, int] = {}  # of a cell in the table of uses
        for cut in self.cuts:
            self._row.setdefault(cut.cell, len(self._row))
        n_corridors = max((cut.corridor + 1 for cut in self.cuts), default=0)
        # the last row stays empty, for cells that use none
        self._used = np.zeros((len(self._row) + 1, n_corridors), bool)
        for cut in self.cuts:
            self._used[self._row[cut.cell], cut.corridor] = True

    def __len__(self) -> int:
        return len(self.cuts)

    def with_more(self, cuts: Iterable[Cut]) -> "Polytopes":
        """These and some more."""
        return Polytopes((*self.cuts, *cuts))

    def first(self, points: Points, building: Building) -> np.ndarray:
        """(b,) the corridor of a polytope around each plan, -1 where it is in none."""
        if not self.cuts:
            return np.full(len(points.k), -1)
        used = self._used_in(points, len(building.corridors))
        return building.corridors.first(points.path, points.bin, building.order, used)

    def _used_in(self, points: Points, n_corridors: int) -> np.ndarray:
        """(b, c) bool: the corridors that are used in the cell of each plan."""
        row = np.full(len(points.k), len(self._used) - 1)
        for cell, index in groups(points.cell):
            row[index] = self._row.get(cell, len(self._used) - 1)
        never = n_corridors - self._used.shape[1]
        return np.pad(self._used, [(0, 0), (0, never)])[row]

    def spelled_out(self, scene: Scene, building: Building) -> list[SafePolytope]:
        """Every polytope with all that describes it."""
        corridors = building.corridors.all
        return [
            SafePolytope(scene, c.p0, c.k, c.pattern, c.bin, corridors[c.corridor], c.born)
            for c in self.cuts
        ]


class _Try(NamedTuple):
    """A corridor tried in a cell. index: the points of the cell. plans: those that may be
    inside."""

    cell: bytes
    index: np.ndarray
    corridor: int
    plans: np.ndarray


def cut_around(building: Building, points: Points, born: float) -> list[Cut]:
    """Polytopes around those of the plans that keep to a corridor: in every cell as few as hold
    them all, the next always holding most.
    """
    maybe = building.corridors.coarse(points.path, points.bin)
    popular = building.counts / (1 + building.counts.sum())  # decides among equals
    left = np.ones(len(points.k), bool)
    cuts = []
    cells = groups(points.cell)
    while tries := _most(cells, maybe, left, popular):
        for one, plans in zip(tries, _confirmed(building, points, tries, maybe), strict=True):
            if left[plans].any():
                left[plans] = False
                cuts.append(_cut(one, points.at(plans), born))
        cells = [(one.cell, one.index) for one in tries]
    return cuts


def _most(
    cells: Iterable[tuple[bytes, np.ndarray]],
    maybe: np.ndarray,
    left: np.ndarray,
    popular: np.ndarray,
) -> list[_Try]:
    """In every cell the corridor that may hold most of the plans left, if any."""
    tries = []
    for cell, index in cells:
        gain = maybe[index[left[index]]].sum(axis=0) + popular
        best = int(np.argmax(gain)) if len(gain) else 0
        if len(gain) and gain[best] >= 1:
            tries.append(_Try(cell, index, best, index[maybe[index, best]]))
    return tries


def _confirmed(
    building: Building, points: Points, tries: list[_Try], maybe: np.ndarray
) -> list[np.ndarray]:
    """Of every try the plans that do keep to its corridor; `maybe` learns of the others."""
    sizes = [len(one.plans) for one in tries]
    plan = np.concatenate([one.plans for one in tries])
    corridor = np.repeat([one.corridor for one in tries], sizes)
    kept = building.corridors.kept_pairs(points.path, points.bin, plan, corridor)
    maybe[plan[~kept], corridor[~kept]] = False
    parts = np.split(kept, np.cumsum(sizes)[:-1])
    return [one.plans[mine] for one, mine in zip(tries, parts, strict=True)]


def _cut(one: _Try, inside: Points, born: float) -> Cut:
    """The polytope around plans inside of it; as it is convex, their mean is inside too."""
    p0, k = inside.p0.mean(axis=0), inside.k.mean(axis=0)
    return Cut(one.cell, p0, k, inside.pattern[0], inside.bin[0], one.corridor, born)
