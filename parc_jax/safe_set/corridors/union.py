"""The union of the safe polytopes: membership and uniform samples."""

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.plan_set import PlanSet
from parc_jax.safe_set.corridors.polytope import SafePolytope
from parc_jax.safe_set.corridors.sampling import Points, ends_from, groups, safe_ones
from parc_jax.safe_set.corridors.solid import Solid, sample_solid, solid
from parc_jax.safe_set.verdict.scene import Scene


class SafeUnion(PlanSet):
    """Polytopes with an index by cell. Two polytopes of different cells share no interior point."""

    def __init__(self, scene: Scene, polytopes: list[SafePolytope]):
        super().__init__(scene)
        self.polytopes = polytopes
        self._solids: list[Solid | None] | None = None
        corridors = {id(p.corridor): p.corridor for p in polytopes}
        place = {name: i for i, name in enumerate(corridors)}
        self._corridors = Corridors(scene.model.tube, corridors.values())
        self._corridor_of = np.array([place[id(p.corridor)] for p in polytopes], int)
        self._by_cell: dict[bytes, list[int]] = {}
        for index, polytope in enumerate(polytopes):
            self._by_cell.setdefault(polytope.cell, []).append(index)

    @property
    def solids(self) -> list[Solid | None]:
        """Geometry of every polytope, computed once; None for one thinner than rounding."""
        if self._solids is None:
            self._solids = [self._solid(p) for p in self.polytopes]
        return self._solids

    def _solid(self, polytope: SafePolytope) -> Solid | None:
        """Its geometry over (p0, k); where all plans have one start, that of its section there, a
        set in k alone, whose vertices are told with the start all the same.
        """
        start = self.scene.at
        if start is None:
            return solid(polytope.halfspaces, np.concatenate([polytope.p0, polytope.k]))
        n_p = len(start)
        A, b = polytope.halfspaces.A, polytope.halfspaces.b
        moves = A[:, n_p:].any(axis=1)
        section = solid(HPolytope(A[moves, n_p:], (b - A[:, :n_p] @ start)[moves]), polytope.k)
        if section is None:
            return None
        starts = np.tile(start, (len(section.vertices), 1))
        return section._replace(vertices=np.concatenate([starts, section.vertices], axis=1))

    @property
    def inner(self) -> np.ndarray:
        """The polytopes' inner points."""
        return self._rows([np.concatenate([p.p0, p.k]) for p in self.polytopes])

    def has(self, safe: Points) -> np.ndarray:
        """(b,) bool: which of some plans that reach the goal are inside a polytope."""
        return self.count(safe) > 0

    def count(self, at: Points) -> np.ndarray:
        """(b,) number of polytopes around each point."""
        rows = [np.zeros(0, int)]
        polytopes = [np.zeros(0, int)]
        for cell, index in groups(at.cell):
            own = self._by_cell.get(cell, [])
            rows.append(np.repeat(index, len(own)))
            polytopes.append(np.tile(np.array(own, int), len(index)))
        rows = np.concatenate(rows)
        # in a polytope's cell, its corridor is the polytope
        corridors = self._corridor_of[np.concatenate(polytopes)]
        inside = self._corridors.kept_pairs(at.path, at.bin, rows, corridors)
        return np.bincount(rows[inside], minlength=len(at.k))

    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """n points (n, n_p + n_k), uniform over the union: a point of m polytopes is kept with
        probability 1 / m.
        """
        solids = [s for s in self.solids if s is not None and s.volume > 0]
        if not solids:
            raise InputError(
                "sample: expected an answer with safe polytopes; this one has none to sample from."
            )
        volumes = np.array([s.volume for s in solids])
        n_p = self.model.n_p
        out = [np.zeros((0, n_p + self.model.n_k))]
        tries = 0
        while sum(len(part) for part in out) < n:
            counts = rng.multinomial(max(2 * n, 64), volumes / volumes.sum())
            x = np.concatenate(
                [sample_solid(s, rng, c) for s, c in zip(solids, counts, strict=True) if c]
            )
            x = x[rng.random(len(x)) * self._around(solids, x) < 1]
            p0, k = x[:, :n_p], x[:, n_p:]
            _, safe = safe_ones(self.scene, ends_from(p0, self.model, k), k)
            out.append(np.concatenate([safe.p0, safe.k], axis=1)[self.count(safe) > 0])
            tries += 1
            if tries > 100 and len(out[-1]) == 0:
                raise InputError(
                    "sample: the safe polytopes are thinner than float64 resolves; sample a wider "
                    "scene."
                )
        return rng.permutation(np.concatenate(out))[:n]

    def _around(self, solids: list[Solid], x: np.ndarray) -> np.ndarray:
        """(b,) in how many of them each point x (b, n_p + n_k) is, which one of them gave."""
        of = x if self.scene.at is None else x[:, self.model.n_p :]
        inside = ((of @ s.polytope.A.T <= s.polytope.b).all(axis=1) for s in solids)
        return np.maximum(sum(one.astype(int) for one in inside), 1)
