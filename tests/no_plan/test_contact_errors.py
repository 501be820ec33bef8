"""Errors with which contacts are sought: all of them keep to the exact rows, and a way that lies
within is gone to its end. [T35]
"""

import numpy as np
import pytest
from toy_bodies import random_faces

from parc_jax.learning.bound.error_set import at
from parc_jax.proof.absence.errors import BetweenFaces, WithinWidths, corner_ways


def between(rng, n, weights):
    """Of so many points, each between faces of its own."""
    given = random_faces(rng, (len(weights),), n, 0.1, around_zero=True)
    rows = [given.rows(i) for i in range(len(weights))]
    return BetweenFaces(given.errors, rows, np.array(weights)), given


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("weights", [[1.0], [0.3, 0.7]])
def test_every_error_that_is_tried_is_exactly_admitted(rng, n, weights):
    errors, _ = between(rng, n, weights)
    assert not errors.candidates[0].any()
    assert all(errors.admits(tried) for tried in errors.candidates)
    ways = rng.normal(size=(30, n)) * 0.2
    assert all(errors.admits(found) for found in errors.towards(ways))
    assert not errors.admits(100 * errors.candidates[1])


@pytest.mark.parametrize("weights", [[1.0], [0.3, 0.7]])
def test_mixtures_go_all_the_way_within_and_to_the_border_beyond(rng, weights):
    errors, given = between(rng, 2, weights)
    mixed = np.einsum("i,cij->cj", weights, errors.candidates)
    within = rng.dirichlet(np.ones(len(mixed)), 30) @ mixed
    found = np.einsum("i,mij->mj", weights, errors.towards(within))
    np.testing.assert_allclose(found, within, atol=1e-6 * np.abs(mixed).max())
    for w in rng.normal(size=(10, 2)):
        far = sum(v * at(given.errors, i).support(w) for i, v in enumerate(weights))
        assert (mixed @ w).max() == pytest.approx(far, rel=1e-6)  # no corner is missing
        best = np.einsum("i,mij->mj", weights, errors.towards(100 * w[None]))
        assert best @ w <= far * (1 + 1e-9)


def test_within_widths_each_point_errs_by_the_same_share():
    half = np.array([[0.1, 0.05], [0.3, 0.0]])
    errors = WithinWidths(half, np.array([0.5, 0.5]))
    found = errors.towards(np.array([[0.1, 0.0], [9.0, -9.0]]))
    np.testing.assert_allclose(found, [[[0.05, 0], [0.15, 0]], [[0.1, -0.05], [0.3, 0]]])
    assert errors.admits(found[1]) and not errors.admits(2 * found[1])
    assert len(errors.candidates) == 9


def test_ways_to_corners_lie_between_neighbouring_normals():
    square = np.array([[1.0, 0.0], [0.0, 2.0], [-3.0, 0.0], [0.0, -1.0]])
    ways = {tuple(np.sign(w)) for w in corner_ways(square)}
    assert ways == {(1, 1), (-1, 1), (-1, -1), (1, -1)}
    assert len(corner_ways(np.eye(3))) == 3 + 26
