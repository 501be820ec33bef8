"""The union of the safe pieces: membership, uniform samples, the safest point."""

import numpy as np

from parc_jax.certify.corridor import Corridors
from parc_jax.certify.draw import Points, groups, points
from parc_jax.certify.evaluate import anchor, evaluate
from parc_jax.certify.piece import Piece
from parc_jax.certify.scene import Scene
from parc_jax.certify.volume import Body, body, sample_body
from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel


class SafeUnion:
    """Pieces with an index by cell. Two pieces of different cells share no interior point."""

    def __init__(self, model: TrajectoryModel, scene: Scene, pieces: list[Piece]):
        self.model, self.scene, self.pieces = model, scene, pieces
        self._bodies: list[Body | None] | None = None
        corridors = {id(p.corridor): p.corridor for p in pieces}
        number = {name: i for i, name in enumerate(corridors)}
        self._corridors = Corridors(model.tube.interval, list(corridors.values()))
        self._corridor_of = np.array([number[id(p.corridor)] for p in pieces], int)
        self._by_cell: dict[bytes, list[int]] = {}
        for index, piece in enumerate(pieces):
            self._by_cell.setdefault(piece.cell, []).append(index)

    @property
    def bodies(self) -> list[Body | None]:
        """Geometry of every piece, computed once; None for one thinner than rounding."""
        if self._bodies is None:
            self._bodies = [body(p.polytope, np.concatenate([p.p0, p.k])) for p in self.pieces]
        return self._bodies

    def contains(self, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
        """p0 (b, n_p), k (b, n_k) -> bool (b,): proved safe in float64 and inside a returned piece."""
        e = evaluate(self.model, self.scene, p0, k)
        return self.count(points(p0, k, e)) * e.safe > 0

    def count(self, at: Points) -> np.ndarray:
        """(b,) number of pieces around each safe point."""
        rows, numbers = [np.zeros(0, int)], [np.zeros(0, int)]
        for cell, index in groups(at.cell):
            own = self._by_cell.get(cell, [])
            rows.append(np.repeat(index, len(own)))
            numbers.append(np.tile(np.array(own, int), len(index)))
        rows, corridors = np.concatenate(rows), self._corridor_of[np.concatenate(numbers)]
        inside = self._corridors.kept_pairs(at.path, at.bin, rows, corridors)  # in a piece's cell, they are the piece
        return np.bincount(rows[inside], minlength=len(at.k))

    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """n points (n, n_p + n_k), uniform over the union: a point of m pieces is kept with probability 1 / m."""
        solid = [b for b in self.bodies if b is not None and b.volume > 0]
        if not solid:
            raise InputError("sample: expected an answer with safe polytopes; this one has none to sample from.")
        volumes = np.array([b.volume for b in solid])
        out, n_p, tries = [np.zeros((0, self.model.n_p + self.model.n_k))], self.model.n_p, 0
        while sum(len(part) for part in out) < n:
            counts = rng.multinomial(max(2 * n, 64), volumes / volumes.sum())
            x = np.concatenate([sample_body(b, rng, c) for b, c in zip(solid, counts, strict=True) if c])
            e = evaluate(self.model, self.scene, x[:, :n_p], x[:, n_p:])
            around = self.count(points(x[:, :n_p], x[:, n_p:], e)) * e.safe
            out.append(x[(around > 0) & (rng.random(len(x)) * around < 1)])
            tries += 1
            if tries > 100 and len(out[-1]) == 0:
                raise InputError("sample: the safe polytopes are thinner than float64 resolves; sample a wider scene.")
        return rng.permutation(np.concatenate(out))[:n]

    def share_of_k(self, n: int = 20_000) -> float:
        """Lower 99.9 % confidence bound of the share of K that has a safe start in some piece. Deterministic draw.

        A k belongs when the start of a piece's own anchored offset keeps it inside: p0 moves so that the predicted end
        stays at the end of the piece's inner point. Sufficient, so the share is never too large.
        """
        from scipy.special import betaincinv

        rng = np.random.default_rng(0)
        k = rng.uniform(self.model.domain.lo, self.model.domain.hi, (n, self.model.n_k))
        ends = self._ends()
        if len(ends) == 0:
            return 0.0
        hit = np.zeros(n, bool)
        for z in ends:
            left = np.flatnonzero(~hit)
            if len(left) == 0:
                break
            p0, reaches = anchor(self.model, self.scene, np.broadcast_to(z, (len(left), len(z))), k[left])
            left, p0 = left[reaches], p0[reaches]
            e = evaluate(self.model, self.scene, p0, k[left])
            hit[left] = self.count(points(p0, k[left], e)) * e.safe > 0
        x = int(hit.sum())
        return 0.0 if x == 0 else float(betaincinv(x, n - x + 1, 0.001))

    def _ends(self, most: int = 8) -> np.ndarray:
        """A few well-spread predicted ends (m, n_p) of inner points: farthest-point order."""
        if not self.pieces:
            return np.zeros((0, self.model.n_p))
        p0, k = np.array([p.p0 for p in self.pieces]), np.array([p.k for p in self.pieces])
        ends = evaluate(self.model, self.scene, p0, k).path[:, -1]
        chosen = [int(np.argmin(np.abs(ends - np.median(ends, axis=0)).sum(axis=1)))]
        distance = np.full(len(ends), np.inf)
        while len(chosen) < min(most, len(ends)):
            distance = np.minimum(distance, np.abs(ends - ends[chosen[-1]]).sum(axis=1))
            chosen.append(int(np.argmax(distance)))
        return ends[chosen]
