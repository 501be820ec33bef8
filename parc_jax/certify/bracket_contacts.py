"""Contacts: points of the body, with errors inside the tube, that put every vertex of a piece into an obstacle.

A piece in which everything hits needs at each vertex one contact c = body + error with p + c in the obstacle. A few
extreme contacts serve most vertices; one that none of them serves gets its own, from the nearest point of the obstacle.
Everything is pulled in a little, so that what is written holds exactly; the checker has the last word.
"""

import itertools
from fractions import Fraction

import numpy as np

from parc_jax.avoid.polygon import corners, decimal
from parc_jax.problem import Disc, ReachAvoid
from parc_jax.tolerances import TOLERANCES

DIRECTIONS = 16  # body points on the rim of a disc that are tried
ROUNDING = 1e-10  # [1 and m] weights and points are right up to this; far less than contact_depth
INSIDE = 1 - 2.0**-30  # body points are pulled towards the middle by this factor


class Contacts:
    """Finds contacts with one obstacle of a problem."""

    def __init__(self, problem: ReachAvoid, obstacle: int):
        poly = problem.obstacles[obstacle]
        length = np.hypot(*poly.A.T)
        self.A, self.b = poly.A / length[:, None], poly.b / length
        self.corners = np.array([[float(x) for x in c.point] for c in corners(poly, f"obstacle {obstacle}")])
        self.body = problem.body
        if isinstance(problem.body, Disc):
            angle = np.concatenate([
                np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS,
                np.arctan2(-self.A[:, 1], -self.A[:, 0]),
            ])  # fmt: skip
            rim = problem.body.radius * INSIDE * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            self.points = np.concatenate([np.zeros((1, 2)), rim])
        else:
            v = problem.body.vertices
            self.points = np.concatenate([v.mean(axis=0)[None], v])
            self.triples = np.array(list(itertools.combinations(range(len(v)), min(3, len(v)))))
            self.system = np.concatenate(
                [v[self.triples].swapaxes(1, 2), np.ones((len(self.triples), 1, min(3, len(v))))], 1
            )
            self.solve = np.linalg.pinv(self.system)

    def find(self, p: np.ndarray, error: np.ndarray) -> list | None:
        """Certificate entries [body, error] that serve all points p (v, 2), or None. error (2,) [m]: half widths."""
        signs = np.array(list(itertools.product((0.0, 1.0, -1.0), repeat=2)))
        body = np.repeat(self.points, len(signs), axis=0)
        shift = np.tile(signs * error, (len(self.points), 1))
        depth = self._depth(p[None] + (body + shift)[:, None])  # (contacts, v)
        single = depth.min(axis=1)
        if single.max() > TOLERANCES.contact_depth:
            best = int(np.argmax(single))
            return self._spell([(body[best], shift[best])])
        served, chosen = depth > TOLERANCES.contact_depth, []
        left = np.ones(len(p), bool)
        while left.any():
            gain = (served & left).sum(axis=1)
            best = int(np.argmax(gain))
            if gain[best]:
                chosen.append((body[best], shift[best]))
                left &= ~served[best]
                continue
            own = self._own(p[np.flatnonzero(left)[0]], error)
            now = left & (self._depth(p + sum(own)) > 10 * ROUNDING)
            if not now[np.flatnonzero(left)[0]]:
                return None
            chosen.append(own)
            left &= ~now
        return self._spell(chosen)

    def _depth(self, x: np.ndarray) -> np.ndarray:
        """How deep x (..., 2) is in the obstacle [m]."""
        return (self.b - x @ self.A.T).min(axis=-1)

    def _own(self, p: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Body point and error that reach from one point p (2,) to the nearest point of the obstacle."""
        nodes = np.concatenate([self.corners, _on_edges(self.corners, p[None] + error * _SQUARE)])
        middle = self.corners.mean(axis=0)
        size = max(float(np.abs(self.corners - middle).max()), TOLERANCES.contact_depth)
        nodes = nodes + (middle - nodes) * min(1.0, 2 * TOLERANCES.contact_depth / size)
        shift = np.clip(nodes - p, -error, error)
        body = nodes - p - shift
        best = int(np.argmin(self._misfit(body)))
        return body[best], shift[best]

    def _misfit(self, body: np.ndarray) -> np.ndarray:
        return np.hypot(*body.T) if isinstance(self.body, Disc) else self._weights(body)[2]

    def _weights(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertex numbers (n, 3), weights (n, 3) and misfit (n,) of the triangle of body vertices that fits x (n, 2)
        best; a misfit up to rounding means that it holds x."""
        target = np.concatenate([x, np.ones((len(x), 1))], axis=1)
        w = np.einsum("cij,nj->nci", self.solve, target)
        missed = np.abs(np.einsum("cji,nci->ncj", self.system, w) - target[:, None]).max(axis=2)
        misfit = np.maximum(-w.min(axis=2), missed)
        best = misfit.argmin(axis=1)
        rows = np.arange(len(x))
        return self.triples[best], w[rows, best], misfit[rows, best]

    def _spell(self, chosen) -> list | None:
        """JSON entries; None when a body point cannot be spelled inside the body."""
        out = []
        for body, shift in chosen:
            spelled = self._spell_disc(body) if isinstance(self.body, Disc) else self._spell_polygon(body)
            if spelled is None:
                return None
            out.append([spelled, [float(v).hex() for v in shift]])
        return out

    def _spell_disc(self, body) -> list[str] | None:
        exact = [Fraction(float(v)) for v in body]
        if sum(v * v for v in exact) > decimal(self.body.radius) ** 2:
            return None
        return [float(v).hex() for v in body]

    def _spell_polygon(self, body) -> list[str] | None:
        vertices = self.body.vertices
        whole = [Fraction(0)] * len(vertices)
        equal = np.flatnonzero((vertices == body).all(axis=1))
        if len(equal):
            whole[equal[0]] = Fraction(1)
            return [str(v) for v in whole]
        (rows,), (w,), (misfit,) = self._weights(body[None])
        short = [Fraction(round(max(v, 0.0) * 2**40), 2**40) for v in w]
        if misfit > ROUNDING:
            return None
        for row, v in zip(rows, short, strict=True):
            whole[row] = v / sum(short)
        return [str(v) for v in whole]


_SQUARE = np.array([(0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])


def _on_edges(polygon: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Nearest points (e * v, 2) of the edges of a polygon (e, 2) to points p (v, 2)."""
    along = np.roll(polygon, -1, axis=0) - polygon
    length = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.einsum("evj,ej->ev", p[None] - polygon[:, None], along) / length[:, None]
    return (polygon[:, None] + np.clip(share, 0, 1)[:, :, None] * along[:, None]).reshape(-1, 2)
