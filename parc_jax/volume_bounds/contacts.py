"""Contacts: points of the body, with errors inside the tube, that put every vertex of a box into an
obstacle.

A box in which everything hits needs at each vertex one contact c = body + error with p + c in the
obstacle. A few extreme contacts serve most vertices; one that none of them serves gets its own,
from the nearest point of the obstacle. Everything is pulled in a little, so that what is written
holds exactly; the checker has the last word.
"""

import itertools
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.body import Disc
from parc_jax.obstacles.polygon import corners
from parc_jax.problem import ReachAvoid
from parc_jax.spelling import fraction_text, hex_text
from parc_jax.tolerances import TOLERANCES

DIRECTIONS = 16  # body points on the rim of a disc that are tried
ROUNDING = 1e-10  # [1 and m] weights and points are right up to this; far less than contact_depth
INSIDE = 1 - 2.0**-30  # body points are pulled towards the middle by this factor
# where errors are taken: none, or a corner of the box of errors
SIGNS = np.array(list(itertools.product((0.0, 1.0, -1.0), repeat=2)))


class Contact(NamedTuple):
    """A point of the body (2,) and an error (2,), both [m]: together they reach from the predicted
    position into the obstacle.
    """

    body: np.ndarray
    shift: np.ndarray


class DiscBody:
    """Points of a disc. points (m, 2): the middle, points on the rim, and those that face the sides
    of an obstacle with the given normals (h, 2).
    """

    def __init__(self, radius: float, normals: np.ndarray):
        self.radius = radius
        around = np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
        facing = np.arctan2(-normals[:, 1], -normals[:, 0])
        angle = np.concatenate([around, facing])
        rim = radius * INSIDE * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        self.points = np.concatenate([np.zeros((1, 2)), rim])

    def misfit(self, x: np.ndarray) -> np.ndarray:
        """How unlike points of the body the x (n, 2) are: (n,), least where fit best."""
        return np.hypot(*x.T)

    def spell(self, x: np.ndarray) -> list[str] | None:
        """A point (2,) of the body as certificates write it; None when it is outside."""
        exact = [Fraction(float(v)) for v in x]
        if sum(v * v for v in exact) > Fraction(self.radius) ** 2:
            return None
        return hex_text(x)


class PolygonBody:
    """Points of a convex polygon, vertices (m, 2), as weights of triangles of its vertices.

    points (m + 1, 2): the middle and the vertices.
    """

    def __init__(self, vertices: np.ndarray):
        self.vertices = vertices
        self.points = np.concatenate([vertices.mean(axis=0)[None], vertices])
        corners = min(3, len(vertices))
        triples = itertools.combinations(range(len(vertices)), corners)
        self._triples = np.array(list(triples))
        ones = np.ones((len(self._triples), 1, corners))
        self._system = np.concatenate([vertices[self._triples].swapaxes(1, 2), ones], axis=1)
        self._inverse = np.linalg.pinv(self._system)

    def misfit(self, x: np.ndarray) -> np.ndarray:
        """How far the x (n, 2) are from being points of the body: (n,), inside only rounding."""
        return self._weights(x)[2]

    def spell(self, x: np.ndarray) -> list[str] | None:
        """A point (2,) of the body as certificates write it; None when it is outside."""
        weights = [Fraction(0)] * len(self.vertices)
        equal = np.flatnonzero((self.vertices == x).all(axis=1))
        if len(equal):
            weights[equal[0]] = Fraction(1)
            return fraction_text(weights)
        (triple,), (w,), (misfit,) = self._weights(x[None])
        if misfit > ROUNDING:
            return None
        short = [Fraction(round(max(v, 0.0) * 2**40), 2**40) for v in w]
        for vertex, v in zip(triple, short, strict=True):
            weights[vertex] = v / sum(short)
        return fraction_text(weights)

    def _weights(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertex numbers (n, 3), weights (n, 3) and misfit (n,) of the triangle of body vertices
        that fits x (n, 2) best; a misfit up to rounding means that it holds x."""
        target = np.concatenate([x, np.ones((len(x), 1))], axis=1)
        w = np.einsum("cij,nj->nci", self._inverse, target)
        missed = np.abs(np.einsum("cji,nci->ncj", self._system, w) - target[:, None]).max(axis=2)
        misfit = np.maximum(-w.min(axis=2), missed)
        best = misfit.argmin(axis=1)
        rows = np.arange(len(x))
        return self._triples[best], w[rows, best], misfit[rows, best]


class Contacts:
    """Finds contacts with one obstacle of a problem."""

    def __init__(self, problem: ReachAvoid, obstacle: int):
        poly = problem.obstacles[obstacle]
        length = np.hypot(*poly.A.T)
        self.A = poly.A / length[:, None]
        self.b = poly.b / length
        exact = corners(poly, f"obstacle {obstacle}")
        self.corners = np.array([[float(x) for x in corner.point] for corner in exact])
        self.body: DiscBody | PolygonBody
        if isinstance(problem.body, Disc):
            self.body = DiscBody(problem.body.radius, self.A)
        else:
            self.body = PolygonBody(problem.body.vertices)

    def find(self, p: np.ndarray, error: np.ndarray) -> list | None:
        """Certificate entries [body, error] that serve all points p (v, 2), or None. error (2,)
        [m]: half widths.
        """
        body = np.repeat(self.body.points, len(SIGNS), axis=0)
        shift = np.tile(SIGNS * error, (len(self.body.points), 1))
        depth = self._depth(p[None] + (body + shift)[:, None])  # (contacts, v)
        for_all = depth.min(axis=1)
        best = int(np.argmax(for_all))
        if for_all[best] > TOLERANCES.contact_depth:
            return self._spell([Contact(body[best], shift[best])])
        serves = depth > TOLERANCES.contact_depth
        chosen = []
        left = np.ones(len(p), bool)
        while left.any():
            gain = (serves & left).sum(axis=1)
            best = int(np.argmax(gain))
            if gain[best]:
                chosen.append(Contact(body[best], shift[best]))
                left &= ~serves[best]
                continue
            first = np.flatnonzero(left)[0]
            own = self._own(p[first], error)
            served = left & (self._depth(p + (own.body + own.shift)) > 10 * ROUNDING)
            if not served[first]:
                return None
            chosen.append(own)
            left &= ~served
        return self._spell(chosen)

    def _depth(self, x: np.ndarray) -> np.ndarray:
        """How deep x (..., 2) is in the obstacle [m]."""
        return (self.b - x @ self.A.T).min(axis=-1)

    def _own(self, p: np.ndarray, error: np.ndarray) -> Contact:
        """A contact that reaches from one point p (2,) to the nearest point of the obstacle."""
        near = _on_edges(self.corners, p[None] + error * _SQUARE)
        nodes = np.concatenate([self.corners, near])
        middle = self.corners.mean(axis=0)
        size = max(float(np.abs(self.corners - middle).max()), TOLERANCES.contact_depth)
        nodes = nodes + (middle - nodes) * min(1.0, 2 * TOLERANCES.contact_depth / size)
        shift = np.clip(nodes - p, -error, error)
        body = nodes - p - shift
        best = int(np.argmin(self.body.misfit(body)))
        return Contact(body[best], shift[best])

    def _spell(self, chosen: list[Contact]) -> list | None:
        """JSON entries; None when a body point cannot be spelled inside the body."""
        out = []
        for contact in chosen:
            spelled = self.body.spell(contact.body)
            if spelled is None:
                return None
            out.append([spelled, hex_text(contact.shift)])
        return out


_SQUARE = np.array([(0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])


def _on_edges(polygon: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Nearest points (e * v, 2) of the edges of a polygon (e, 2) to points p (v, 2)."""
    along = np.roll(polygon, -1, axis=0) - polygon
    length = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.einsum("evj,ej->ev", p[None] - polygon[:, None], along) / length[:, None]
    return (polygon[:, None] + np.clip(share, 0, 1)[:, :, None] * along[:, None]).reshape(-1, 2)
