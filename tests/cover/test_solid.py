"""Vertices, volumes and uniform samples of bounded polytopes with a known inner point."""

import math

import numpy as np
import pytest
from random_polytopes import round_polytope
from scipy.stats import chisquare

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope
from parc_jax.common.sets.hull import sample_solid, solid


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_boxes_and_simplices_have_their_volume(n, rng):
    lo = rng.uniform(-1, 0, n)
    shape = solid(from_box(box(lo, lo + np.arange(1, n + 1))), lo + 0.3)
    assert shape.volume == pytest.approx(math.factorial(n)) and len(shape.vertices) == 2**n
    corner = hpolytope(np.concatenate([-np.eye(n), np.ones((1, n))]), np.append(np.zeros(n), 1.0))
    shape = solid(corner, np.full(n, 1 / (2 * n)))
    assert shape.volume == pytest.approx(1 / math.factorial(n)) and len(shape.vertices) == n + 1
    assert shape.weights.tolist() == [1.0]


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e3])
def test_scales_of_the_axes_do_not_matter(scale):
    size = np.array([1.0, scale, 1.0, 1 / scale])
    shape = solid(from_box(box(-size, size)), 0.3 * size)
    assert shape.volume == pytest.approx(16.0, rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_vertices_are_on_the_rows_and_redundant_rows_are_gone(seed):
    rng = np.random.default_rng(seed)
    poly = round_polytope(rng, 4, 12)
    many = hpolytope(
        np.concatenate([poly.A, 2 * poly.A, poly.A]),
        np.concatenate([poly.b, 2 * poly.b, poly.b + 5]),
    )
    inner = np.linalg.lstsq(poly.A, poly.b - 0.3, rcond=None)[0]
    if not (many.A @ inner < many.b).all():
        inner = np.mean(own_vertices(poly), axis=0)
    shape = solid(many, inner)
    room = many.b - shape.vertices @ many.A.T
    assert (room > -1e-9).all() and (np.abs(room) < 1e-9).sum(axis=1).min() >= 4
    assert len(shape.polytope.b) <= 2 * len(poly.b)
    x = rng.uniform(-3, 3, (4000, 4)) + inner
    np.testing.assert_array_equal(shape.polytope.contains(x), poly.contains(x))


def own_vertices(poly):
    from benchmarks.neuralparc.sets.vertices import vertices

    return vertices(poly)


def test_thin_or_empty_sets_have_no_solid():
    cube = from_box(box(np.zeros(3), np.ones(3)))
    assert solid(cube, np.array([2.0, 0.5, 0.5])) is None
    flat = hpolytope(cube.A, np.array([1.0, 1, 1e-320, 0, 0, 0]))
    assert solid(flat, np.array([0.5, 0.5, 0.0])) is None


def test_samples_are_uniform(rng):
    corner = hpolytope(np.concatenate([-np.eye(3), np.ones((1, 3))]), np.append(np.zeros(3), 1.0))
    cut = hpolytope(np.concatenate([corner.A, [[1.0, 0, 0]]]), np.append(corner.b, 0.5))
    x = sample_solid(solid(cut, np.full(3, 0.1)), rng, 8000)
    assert cut.contains(x - 1e-12).all()
    other = rng.uniform(0, 1, (200_000, 3))
    other = other[cut.contains(other)]
    edges = [np.quantile(other[:, axis], [0.25, 0.5, 0.75]) for axis in range(3)]

    def number(y):
        return sum(np.searchsorted(edges[a], y[:, a]) * 4**a for a in range(3))

    expected = np.bincount(number(other), minlength=64).astype(float)
    keep = expected > 100
    got = np.bincount(number(x), minlength=64)[keep]
    assert chisquare(got, expected[keep] / expected[keep].sum() * got.sum()).pvalue > 1e-5
    lopsided = solid(cut, np.full(3, 0.1))._replace(
        weights=np.full(len(solid(cut, np.full(3, 0.1)).simplices), np.nan)
    )
    lopsided = lopsided._replace(
        weights=np.eye(len(lopsided.simplices))[0]
    )  # only one simplex: seen at once
    if len(lopsided.simplices) > 1:
        got = np.bincount(number(sample_solid(lopsided, rng, 8000)), minlength=64)[keep]
        assert chisquare(got, expected[keep] / expected[keep].sum() * got.sum()).pvalue < 1e-5
