"""Qhull gives up without an exception, and thin sets look round to it."""

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.common.sets.hull import convex_hull, delaunay, halfspace_intersection, scaled_around

FLAT = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def test_flat_or_open_sets_give_none():
    assert convex_hull(FLAT) is None and delaunay(FLAT) is None
    assert halfspace_intersection(np.eye(2), np.ones(2), np.zeros(2)) is None
    assert len(convex_hull(SQUARE).vertices) == 4 and len(delaunay(SQUARE)) == 2


def test_a_thin_box_is_a_square_after_scaling():
    thin = from_box(box([1.0, -1e-6], [3.0, 1e-6]))
    inside = np.array([2.0, 0.0])
    A, b, scale = scaled_around(thin.A, thin.b, inside)
    np.testing.assert_allclose(scale, [1.0, 1e-6])
    corners = halfspace_intersection(A, b, np.zeros(2)).intersections
    np.testing.assert_allclose(np.abs(corners), 1.0, rtol=1e-12)
    assert scaled_around(thin.A, thin.b, np.array([3.0, 0.0])) is None  # on the boundary
