"""The polytope around vertices holds every one of them, in exact arithmetic, and little more."""

from fractions import Fraction

import numpy as np
import pytest

from benchmarks.neuralparc.sets.vertices import vertices
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hull import polytope_around


def holds(p, points) -> bool:
    """Every point meets every row exactly."""
    rows = [([Fraction(a) for a in row], Fraction(b)) for row, b in zip(p.A, p.b, strict=True)]
    exact = [[Fraction(x) for x in point] for point in np.asarray(points, float).tolist()]
    return all(sum(a * x for a, x in zip(w, v, strict=True)) <= b for v in exact for w, b in rows)


@pytest.mark.parametrize("n", [2, 3])
def test_every_vertex_is_inside_and_nothing_far_from_them(n, rng):
    for size in (1e-3, 1.0, 1e4):
        points = size * (rng.normal(size=(12, n)) + 5)
        around = polytope_around(points)
        assert holds(around, points)
        own = vertices(around)
        gaps = np.linalg.norm(own[:, None] - points, axis=2).min(axis=1)
        assert gaps.max() < 1e-9 * size


@pytest.mark.parametrize(
    "points",
    [
        [[0.1, 0.3]],
        [[0.1, 0.3], [0.1, 0.3]],
        [[0.1, 0.3], [0.7, 0.9]],
        [[0.1, 0.2], [0.3, 0.6], [0.2, 0.4]],
        [[0, 0], [1, 1], [2, 2 + 1e-15]],
    ],
)
def test_in_the_plane_flat_is_fine(points):
    around = polytope_around(points)
    assert holds(around, points) and around.contains(np.array(points, float)).all()
    assert np.ptp(vertices(around), axis=0) == pytest.approx(np.ptp(points, axis=0), abs=1e-9)


def test_a_box_is_its_box():
    around = polytope_around(
        [[22.9665, -16.994], [27.2335, -16.994], [27.2335, -15.006], [22.9665, -15.006]]
    )
    assert sorted(zip(around.A.tolist(), around.b.tolist(), strict=True)) == [
        ([-1.0, 0.0], -22.9665),
        ([0.0, -1.0], 16.994),
        ([0.0, 1.0], -15.006),
        ([1.0, 0.0], 27.2335),
    ]


@pytest.mark.parametrize(
    ("points", "sentence"),
    [
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "here: expected a hull with volume"),
        ([[0.0], [1.0]], "here: expected points of the workspace"),
        ([[0.0, np.nan]], "here"),
        (np.zeros((0, 2)), "here: expected points of the workspace"),
    ],
)
def test_what_has_no_hull_is_refused(points, sentence):
    with pytest.raises(InputError, match=sentence):
        polytope_around(points, "here")
