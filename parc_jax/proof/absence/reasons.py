"""Why no plan of a box is safe, as a certificate says it: it misses the goal, starts elsewhere, or
is in contact. [T15, T16, T36]

Contacts: body points, with errors inside the tube, that put every vertex of a box into an obstacle.

A box in which everything hits needs at each vertex one contact c = body + error with p + c in the
obstacle. A few extreme contacts serve most vertices; any other vertex gets a separate one,
from the nearest point of the obstacle. Of a part that is the hull of several points, p is a mixture
of them, and the error is the same mixture of theirs. [T35] Everything is pulled in a little, so
that the text holds exactly; the checker has the last word.
"""

import itertools
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.common.spelling import fraction_text, hex_text
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.body import Disc, numbered
from parc_jax.problem.problem import Problem
from parc_jax.proof.absence.contact_margins import SHARES
from parc_jax.proof.absence.errors import BinErrors, ContactErrors
from parc_jax.proof.absence.examine import Batch
from parc_jax.safe_set.separation.directions import sphere
from parc_jax.safe_set.separation.pairs import vertices_of
from parc_jax.safe_set.verdict.scene import Scene

DIRECTIONS = {2: 16, 3: 48}  # body points on the rim of a disc or ball that are tried
ROUNDING = 1e-10  # [1 and m] weights and points are right up to this; far less than contact_depth
INSIDE = 1 - 2.0**-30  # body points are pulled towards the middle by this factor
FACET = 1e-8  # [size of the obstacle] a vertex that is no farther from a facet lies on it
WEIGHT_BITS = 40  # of the weights of a mixture of points


class Contact(NamedTuple):
    """A point of the body (n_p,), and an error of each point of a mixture (i, n_p), both [m]:
    together they reach from the predicted position into the obstacle.
    """

    body: np.ndarray
    errors: np.ndarray


class DiscBody:
    """Points of a disc or ball. points (m, n_p): the middle, points on the rim, and those that face
    the sides of an obstacle with the given normals (h, n_p).
    """

    def __init__(self, radius: float, normals: np.ndarray):
        self.radius = radius
        n = normals.shape[1]
        if n == 2:
            around = np.arange(DIRECTIONS[2]) * 2 * np.pi / DIRECTIONS[2]
            angle = np.concatenate([around, np.arctan2(-normals[:, 1], -normals[:, 0])])
            rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        else:
            rim = np.concatenate([sphere(DIRECTIONS[3]), -normals])
        self.points = np.concatenate([np.zeros((1, n)), radius * INSIDE * rim])

    def misfit(self, x: np.ndarray) -> np.ndarray:
        """How unlike points of the body the x (n, n_p) are: (n,), least where fit best."""
        return np.linalg.norm(x, axis=1)

    def spell(self, x: np.ndarray) -> list[str] | None:
        """A point (n_p,) of the body as certificates write it; None when it is outside."""
        exact = [Fraction(float(v)) for v in x]
        return None if sum(v * v for v in exact) > Fraction(self.radius) ** 2 else hex_text(x)


class PolygonBody:
    """Points of the hull of vertices (m, n_p), as weights of their triangles, in space tetrahedra.

    points (m + 1, n_p): the middle and the vertices.
    """

    def __init__(self, vertices: np.ndarray):
        self.vertices = vertices
        self.points = np.concatenate([vertices.mean(axis=0)[None], vertices])
        corners = min(vertices.shape[1] + 1, len(vertices))
        self._triples = np.array(list(itertools.combinations(range(len(vertices)), corners)))
        ones = np.ones((len(self._triples), 1, corners))
        self._system = np.concatenate([vertices[self._triples].swapaxes(1, 2), ones], axis=1)
        self._inverse = np.linalg.pinv(self._system)

    def misfit(self, x: np.ndarray) -> np.ndarray:
        """How far the x (n, n_p) are from being points of the body: (n,), inside only rounding."""
        return self._weights(x)[2]

    def spell(self, x: np.ndarray) -> list[str] | None:
        """A point (n_p,) of the body as certificates write it; None when it is outside."""
        weights = [Fraction(0)] * len(self.vertices)
        equal = np.flatnonzero((self.vertices == x).all(axis=1))
        if len(equal):
            weights[equal[0]] = Fraction(1)
            return fraction_text(weights)
        (triple,), (w,), (misfit,) = self._weights(x[None])
        if misfit > ROUNDING:
            return None
        for vertex, v in zip(triple, short_weights(np.maximum(w, 0)), strict=True):
            weights[vertex] = v
        return fraction_text(weights)

    def _weights(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertex numbers (n, 3), weights (n, 3) and misfit (n,) of the triangle of body vertices
        that fits x (n, n_p) best; a misfit up to rounding means that it holds x."""
        target = np.concatenate([x, np.ones((len(x), 1))], axis=1)
        w = np.einsum("cij,nj->nci", self._inverse, target)
        missed = np.abs(np.einsum("cji,nci->ncj", self._system, w) - target[:, None]).max(axis=2)
        misfit = np.maximum(-w.min(axis=2), missed)
        best = misfit.argmin(axis=1)
        rows = np.arange(len(x))
        return self._triples[best], w[rows, best], misfit[rows, best]


class Contacts:
    """Finds contacts of one part of the body with one obstacle of a problem."""

    def __init__(self, problem: Problem, obstacle: int, part: int = 0):
        poly = problem.obstacles[obstacle]
        length = np.linalg.norm(poly.A, axis=1)
        self.A = poly.A / length[:, None]
        self.b = poly.b / length
        self.corners = vertices_of(poly, f"obstacle {obstacle}")
        if poly.n == 2:
            self._edges = np.roll(self.corners, -1, axis=0) - self.corners, self.corners
        else:
            self._edges = _edges(self.corners, self.A, self.b)
        shape = problem.parts[part].shape
        is_disc = isinstance(shape, Disc)
        self.body = DiscBody(shape.radius, self.A) if is_disc else PolygonBody(shape.vertices)

    def find(self, p: np.ndarray, errors: ContactErrors, most: int | None = None) -> list | None:
        """Certificate entries [body, errors] that serve all places p (v, n_p) of a mixture of
        points, or None. most: entries that there may be, None for any number.
        """
        if (chosen := self._choose(p, errors, most)) is None:
            return None
        out = []
        for contact in chosen:
            spelled = self.body.spell(contact.body)
            if spelled is None or not errors.admits(contact.errors):
                return None
            out.append([spelled, [hex_text(error) for error in contact.errors]])
        return out

    def _choose(
        self, p: np.ndarray, errors: ContactErrors, most: int | None
    ) -> list[Contact] | None:
        """Few contacts that serve all places, at most so many; None where there are none."""
        tried = errors.candidates
        body = np.repeat(self.body.points, len(tried), axis=0)
        shift = np.tile(_mixed(errors.weights, tried), (len(self.body.points), 1))
        depth = self._depth(p[None] + (body + shift)[:, None])  # (contacts, v)
        for_all = depth.min(axis=1)
        best = int(np.argmax(for_all))
        if for_all[best] > TOLERANCES.contact_depth:
            return [Contact(body[best], tried[best % len(tried)])]
        serves = depth > TOLERANCES.contact_depth
        chosen = []
        left = np.ones(len(p), bool)
        while left.any():
            if len(chosen) == most:
                return None
            gain = (serves & left).sum(axis=1)
            best = int(np.argmax(gain))
            if gain[best]:
                chosen.append(Contact(body[best], tried[best % len(tried)]))
                left &= ~serves[best]
                continue
            first = np.flatnonzero(left)[0]
            own = self._own(p[first], errors)
            offset = own.body + _mixed(errors.weights, own.errors[None])[0]
            served = left & (self._depth(p + offset) > 10 * ROUNDING)
            if not served[first]:
                return None
            chosen.append(own)
            left &= ~served
        return chosen

    def _depth(self, x: np.ndarray) -> np.ndarray:
        """How deep x (..., n_p) is in the obstacle [m]."""
        return (self.b - x @ self.A.T).min(axis=-1)

    def _own(self, p: np.ndarray, errors: ContactErrors) -> Contact:
        """A contact that reaches from one place p (n_p,) to the nearest point of the obstacle."""
        nodes = self._nearest(p[None] + _mixed(errors.weights, errors.candidates))
        middle = self.corners.mean(axis=0)
        size = max(float(np.abs(self.corners - middle).max()), TOLERANCES.contact_depth)
        nodes = nodes + (middle - nodes) * min(1.0, 2 * TOLERANCES.contact_depth / size)
        of_each = errors.towards(nodes - p)
        body = nodes - p - _mixed(errors.weights, of_each)
        best = int(np.argmin(self.body.misfit(body)))
        return Contact(body[best], of_each[best])

    def _nearest(self, p: np.ndarray) -> np.ndarray:
        """Points of the obstacle's boundary, among them the nearest ones to p (v, n_p) outside."""
        along, start = self._edges  # (e, n_p) each
        length = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        share = np.einsum("evj,ej->ev", p[None] - start[:, None], along) / length[:, None]
        nearest = start[:, None] + np.clip(share, 0, 1)[:, :, None] * along[:, None]
        nodes = np.concatenate([self.corners, nearest.reshape(-1, p.shape[1])])
        if p.shape[1] == 2:
            return nodes
        beyond = p @ self.A.T - self.b
        on_planes = (p[:, None] - beyond[:, :, None] * self.A[None]).reshape(-1, p.shape[1])
        return np.concatenate([nodes, on_planes[self._depth(on_planes) > -ROUNDING]])


def short_weights(weights: np.ndarray) -> list[Fraction]:
    """Exact weights near the given ones (i,) >= 0: their sum is one, and short to spell."""
    short = [Fraction(round(float(v) * 2**WEIGHT_BITS), 2**WEIGHT_BITS) for v in weights]
    total = sum(short)
    return [v / total for v in short]


def _mixed(weights: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Errors (c, n_p) of a mixture by weights (i,), from those of its points (c, i, n_p)."""
    return np.einsum("i,cij->cj", weights, errors)


def _edges(nodes: np.ndarray, A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 3), starts (e, 3) of a polytope of vertices (v, 3): pairs on two common facets."""
    size = 1 + np.abs(nodes).max()
    on = np.abs(nodes @ A.T - b) < size * FACET
    first, second = np.triu_indices(len(nodes), 1)
    edge = (on[first] & on[second]).sum(axis=1) >= 2
    return nodes[second[edge]] - nodes[first[edge]], nodes[first[edge]]


class Reasons:
    """Spells the reasons of one scene's boxes."""

    def __init__(self, scene: Scene, errors: BinErrors):
        self.model = model = scene.model
        self.problem = problem = scene.problem
        self.errors = errors
        pairs = itertools.product(range(len(problem.obstacles)), range(len(problem.parts)))
        self.contacts = [Contacts(problem, *pair) for pair in pairs]
        self.parts = numbered(problem.body, model.points)
        self.goal_rows = len(problem.goal.b)
        self.start_rows = 0 if problem.start is None else len(problem.start.b)

    def of(self, batch: Batch, i: int):
        """(reason, its entries) of one box, the cheapest to check first, or None."""
        found = self._reason(batch, i)
        if found is None or not batch.bounded:
            return found
        reason, entries = found
        of_k = self.problem.goal.A[:, self.model.n_p :]
        if reason == "goal" and not of_k[[row for row, *_ in entries]].any():
            return found  # rows about z alone need no bound of the network
        return "bounded", {reason: entries}

    def _reason(self, batch: Batch, i: int):
        """The reason of one box and its entries, or None."""
        margin, seen = TOLERANCES.leaf_margin, batch.seen
        goal = seen.goal[i, : self.goal_rows]
        if goal.max(initial=-np.inf) > margin:
            errors = self.errors.at_end(batch.over[i].bins)
            return "goal", [self.errors.goal_entry(errors, int(np.argmax(goal)), Fraction(1))]
        start = seen.start[i, : self.start_rows]
        if start.max(initial=-np.inf) > margin:
            return "start", [[int(np.argmax(start)), "1"]]
        for c in np.flatnonzero(seen.hit[i] > margin):
            if (what := self._hit(batch, i, c)) is not None:
                return "hit", what
        return None

    def _hit(self, batch: Batch, i: int, c: int) -> list | None:
        """The entries of contact c of one box, or None where it cannot be written."""
        pair, t, share = batch.seen.which[i, c].tolist()
        points = list(self.parts[pair % len(self.parts)].points)
        at = batch.seen.at[batch.owner == i, c][:, points]
        corners: dict = {}  # those of z that have a mixture in common share its contacts
        mixtures = batch.seen.weights[i, c][:, points]
        node, n_p = batch.nodes[i], self.model.n_p
        of_z = itertools.product(*zip(node.lo[:n_p], node.hi[:n_p], strict=True))
        for corner, given in zip(of_z, mixtures, strict=True):
            corners.setdefault(tuple(short_weights(given)), []).append(corner)
        groups = []
        for weights, some in corners.items():
            mixed = np.array(weights, float)
            errors = self.errors.of_contact(batch.over[i], t, points, mixed)
            places = np.array(some)[:, None] + mixed @ at
            if (entries := self._contacts(pair, places, errors, batch.bounded)) is None:
                return None
            groups.append([fraction_text(weights), entries])
        return [*divmod(pair, len(self.parts)), t, str(Fraction(SHARES[share])), groups]

    def _contacts(
        self, pair: int, places: Float[np.ndarray, "z v n_p"], errors: ContactErrors, bounded: bool
    ) -> list | None:
        """Contacts that serve all places of a mixture: z corners, v vertices of k. By
        bounds one serves all that a corner has; else each vertex may have another.
        """
        if not bounded:
            return self.contacts[pair].find(places.reshape(-1, self.model.n_p), errors)
        entries: list = []
        for served in places:
            if (found := self.contacts[pair].find(served, errors, most=1)) is None:
                return None
            entries += [entry for entry in found if entry not in entries]
        return entries
