"""Volumes of faces given by hand, against closed forms."""

import numpy as np
import pytest

from parc_jax.proof.regions.assemble import cell_volumes

POLYGON = np.array([[0.0, 0.0], [1.0, 0.0], [10.0, 0.0], [10.0, 0.1]])


def prism(polygon):
    """Polygon x [0, 1] as a complex of one cell: points, boundaries. The edge that follows on the
    first vertex's comes first in both polygons.
    """
    count = len(polygon)
    points = np.concatenate([np.column_stack([polygon, np.full(count, z)]) for z in (0.0, 1.0)])
    ring = np.stack([np.arange(count), np.roll(np.arange(count), -1)], axis=1)
    ring = np.roll(ring, -1, axis=0)
    edges = np.concatenate([ring, ring + count, np.stack([ring[:, 0], ring[:, 0] + count], axis=1)])
    upright = {vertex: 2 * count + i for i, vertex in enumerate(ring[:, 0].tolist())}
    walls = [[i, upright[a], i + count, upright[b]] for i, (a, b) in enumerate(ring.tolist())]
    polygons = [list(range(count)), list(range(count, 2 * count)), *walls]
    sizes = [len(row) for row in polygons]
    boundaries = (
        (edges.ravel(), np.arange(0, edges.size + 1, 2)),
        (np.concatenate(polygons), np.concatenate([[0], np.cumsum(sizes)])),
        (np.arange(len(polygons)), np.array([0, len(polygons)])),
    )
    return points, boundaries


def turned(points):
    """A general position, by a rotation."""
    return points @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]


def upright(points):
    """Polygons across the first axis: their first component is 0."""
    return points[:, [2, 0, 1]]


@pytest.mark.parametrize("lift", [0.0, 2.0**-52, 1e-9])
@pytest.mark.parametrize("place", [lambda points: points, turned, upright])
def test_a_flat_pyramid_that_is_larger_than_the_others_around(lift, place):
    polygon = POLYGON.copy()
    polygon[1, 1] -= lift
    points, boundaries = prism(polygon)
    x, y = polygon.T
    area = 0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum()
    assert cell_volumes(place(points), boundaries)[0] == pytest.approx(area, rel=1e-13)
