"""Vertices of a region table in rational arithmetic, from the facets through them."""

from fractions import Fraction

import numpy as np

from parc_jax.pwa.domain import unit_problem
from parc_jax.pwa.exact import ExactNetwork


class ExactPoints:
    """Exact vertices of a table, one at a time (a fraction of a millisecond each).

    The facets of one region that meet at one of its vertices have normals of rank n there, so they define the point.
    """

    def __init__(self, table):
        self.table, self.unit = table, unit_problem(table.net, table.domain)
        self.network = ExactNetwork(self.unit.A, self.unit.b, self.unit.weights, self.unit.biases)
        flat, offsets = table.face_vertices(table.net.n_in - 1)
        order = np.argsort(flat, kind="stable")
        self._facets = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))[order]
        self._starts = np.searchsorted(flat[order], np.arange(len(table.points) + 1))

    def point(self, v: int) -> list[Fraction]:
        """Coordinates of table.points[v] without rounding."""
        through = self._facets[self._starts[v] : self._starts[v + 1]]
        sides = self.table.facet_regions[through]
        region = sides[0, 0]
        label = self.table.facet_label[through[(sides == region).any(axis=1)]]
        rows, neurons = -1 - label[label < 0], np.sort(label[label >= 0])
        point, q = self.network.vertex(rows, neurons, self.table.patterns[region])
        return [Fraction(x, q) * Fraction(s) for x, s in zip(point, self.unit.scale, strict=True)]


def with_exact_points(table):
    """The same table, every vertex rounded from its exact value; point_error is half a unit in the last place."""
    exact = ExactPoints(table)
    points = np.array([[float(x) for x in exact.point(v)] for v in range(len(table.points))])
    return table.replace(points=points, point_error=0.5 * np.spacing(np.abs(points)))
