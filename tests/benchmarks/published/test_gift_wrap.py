"""Hull normals against Qhull, on degenerate point sets, and independent between sets of a batch."""

import jax
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from benchmarks.neuralparc.by_support import hull_normals

kernel = jax.jit(hull_normals)


def normals_of(points):
    """Distinct unit normals of one set, padded to 12 points so that one shape compiles."""
    padded = np.concatenate([points, np.repeat(points[-1:], 12 - len(points), axis=0)])
    w = np.stack(kernel(padded[:, 0], padded[:, 1]), axis=1)
    w = w[w.any(axis=1)]
    return {tuple(row) for row in np.round(w / np.linalg.norm(w, axis=1, keepdims=True), 7) + 0.0}


def test_normals_are_those_of_qhull(rng):
    for count in (3, 5, 12):
        for _ in range(10):
            points = rng.normal(size=(count, 2))
            expected = {
                tuple(row) for row in np.round(ConvexHull(points).equations[:, :2], 7) + 0.0
            }
            assert normals_of(points) == expected


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([[2.0, 3.0]] * 3, set()),
        ([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], {(0.0, -1.0), (0.0, 1.0)}),
        ([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]], {(0.0, -1.0), (0.0, 1.0)}),
        (
            [[0, 0], [1, 0], [2, 0], [2, 2], [1, 2], [0, 2], [0, 1], [1, 1]],
            {(0, -1), (1, 0), (0, 1), (-1, 0)},
        ),
        (
            [[0, 0], [1e-17, 0], [1, 0], [1, 1], [1 + 2e-16, 1 - 1e-16], [0, 1]],
            {(0, -1), (1, 0), (0, 1), (-1, 0)},
        ),
    ],
)
def test_degenerate_sets(points, expected):
    assert normals_of(np.array(points, dtype=float)) == expected
