"""The union of the safe polytopes: membership, uniform samples, the safest point."""

import numpy as np

from parc_jax.claim.counts import least_probability
from parc_jax.cover.corridors import Corridors
from parc_jax.cover.polytope import SafePolytope
from parc_jax.cover.sampling import Points, ends_from, groups, points, safe_ones
from parc_jax.cover.solid import Solid, sample_solid, solid
from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.verdict.pointwise import verdicts
from parc_jax.verdict.scene import Scene


class SafeUnion:
    """Polytopes with an index by cell. Two polytopes of different cells share no interior point."""

    def __init__(self, model: TrajectoryModel, scene: Scene, polytopes: list[SafePolytope]):
        self.model = model
        self.scene = scene
        self.polytopes = polytopes
        self._solids: list[Solid | None] | None = None
        corridors = {id(p.corridor): p.corridor for p in polytopes}
        place = {name: i for i, name in enumerate(corridors)}
        self._corridors = Corridors(model.tube, corridors.values())
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

    def contains(self, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
        """p0 (b, n_p), k (b, n_k) -> bool (b,): proved safe in float64 and inside a returned
        polytope.
        """
        e = verdicts(self.model, self.scene, p0, k)
        return self.count(points(p0, k, e)) * e.safe > 0

    def count(self, at: Points) -> np.ndarray:
        """(b,) number of polytopes around each safe point."""
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
            e = verdicts(self.model, self.scene, x[:, :n_p], x[:, n_p:])
            around = self.count(points(x[:, :n_p], x[:, n_p:], e)) * e.safe
            out.append(x[(around > 0) & (rng.random(len(x)) * around < 1)])
            tries += 1
            if tries > 100 and len(out[-1]) == 0:
                raise InputError(
                    "sample: the safe polytopes are thinner than float64 resolves; sample a wider "
                    "scene."
                )
        return rng.permutation(np.concatenate(out))[:n]

    def share_of_k(self, n: int = 20_000) -> float:
        """Lower 99.9 % confidence bound of the share of K that has a safe start in some polytope.
        Deterministic draw.

        A k belongs when the start of a polytope's own anchored offset keeps it inside: p0 moves so
        that the predicted end stays at the end of the polytope's inner point. Sufficient, so the
        share is never too large.
        """
        rng = np.random.default_rng(0)
        k = rng.uniform(self.model.domain.lo, self.model.domain.hi, (n, self.model.n_k))
        ends = self._ends() if self.scene.at is None else self.scene.at[None]
        if not self.polytopes:
            return 0.0
        hit = np.zeros(n, bool)
        for z in ends:
            left = np.flatnonzero(~hit)
            if len(left) == 0:
                break
            some = k[left]
            ends_here = np.broadcast_to(z, (len(left), len(z)))
            if self.scene.at is not None:
                ends_here = ends_from(self.scene.at, self.model, some)
            seen, safe = safe_ones(self.model, self.scene, ends_here, some)
            hit[left[seen.row]] = self.count(safe) > 0
        return least_probability(int(hit.sum()), n, 0.001)

    def _ends(self, most: int = 8) -> np.ndarray:
        """A few well-spread predicted ends (m, n_p) of inner points: farthest-point order."""
        if not self.polytopes:
            return np.zeros((0, self.model.n_p))
        p0, k = np.array([p.p0 for p in self.polytopes]), np.array([p.k for p in self.polytopes])
        ends = verdicts(self.model, self.scene, p0, k).path[:, -1, : self.model.n_p]
        chosen = [int(np.argmin(np.abs(ends - np.median(ends, axis=0)).sum(axis=1)))]
        distance = np.full(len(ends), np.inf)
        while len(chosen) < min(most, len(ends)):
            distance = np.minimum(distance, np.abs(ends - ends[chosen[-1]]).sum(axis=1))
            chosen.append(int(np.argmax(distance)))
        return ends[chosen]
