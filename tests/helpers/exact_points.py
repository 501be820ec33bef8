"""The vertices of a region table from rationals, an oracle for the floats."""

from fractions import Fraction
from itertools import pairwise

import numpy as np

from parc_jax.proof.regions.domain import unit_problem
from parc_jax.proof.regions.exact import ExactNetwork


def with_exact_points(table):
    """The same table, every vertex rounded from its exact value, which takes a fraction of a
    millisecond; point_error is half a unit in the last place.

    The facets of one region that meet at one of its vertices have normals of rank n there, so they
    define the point.
    """
    unit = unit_problem(table.net, table.domain)
    network = ExactNetwork(unit.A, unit.b, unit.weights, unit.biases)
    flat, offsets = table.face_vertices(table.net.n_in - 1)
    order = np.argsort(flat, kind="stable")
    facets = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))[order]
    starts = np.searchsorted(flat[order], np.arange(len(table.points) + 1))
    points = np.empty_like(table.points)
    for v, (first, last) in enumerate(pairwise(starts)):
        through = facets[first:last]
        sides = table.facet_regions[through]
        region = sides[0, 0]
        label = table.facet_label[through[(sides == region).any(axis=1)]]
        neurons = np.sort(label[label >= 0])
        point, q = network.vertex(-1 - label[label < 0], neurons, table.patterns[region])
        exact = zip(point, unit.scale, strict=True)
        points[v] = [float(Fraction(x, q) * Fraction(s)) for x, s in exact]
    return table.replace(points=points, point_error=0.5 * np.spacing(np.abs(points)))
