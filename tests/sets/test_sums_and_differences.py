"""Minkowski sums and Pontryagin differences by definition, with their directions of rounding."""

from fractions import Fraction

import numpy as np
import pytest
from random_polytopes import round_polytope
from set_oracles import supports

from benchmarks.neuralparc.sets.operations import (
    grow,
    minkowski_sum,
    shrink,
    with_axis_rows,
)
from benchmarks.neuralparc.sets.sampling import volume
from benchmarks.neuralparc.sets.vertices import vertices
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.rational import rational_vertices


def breaks(p, e, x, signs):
    """Share of points kept by the shrunken set whose box leaves P (plus rounding)."""
    kept = shrink(p, e).contains(x)
    assert 0 < kept.sum() < len(x)
    return [not p.replace(b=p.b + 1e-12).contains(x[kept] + e * s).all() for s in signs]


def test_shrunken_goal_absorbs_the_error(rng):
    p, e = round_polytope(rng, 3, 6), np.array([0.05, 0.1, 0.15])
    x = rng.uniform(vertices(p).min(axis=0), vertices(p).max(axis=0), (512, 3))
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    assert not any(breaks(p, e, x, signs))


@pytest.mark.soundness
def test_offsets_round_towards_safety(rng):
    """Exact arithmetic: the shrunken offset is never above b - |A| e, the grown one never below b +
    |A| e.
    """
    for _ in range(50):
        p, e = HPolytope(rng.normal(size=(4, 3)), rng.normal(size=4) * 10), rng.exponential(size=3)
        down, up = shrink(p, e).b, grow(p, e).b
        for i in range(4):
            loss = sum(
                abs(Fraction(float(a))) * Fraction(float(r)) for a, r in zip(p.A[i], e, strict=True)
            )
            assert Fraction(float(down[i])) <= Fraction(float(p.b[i])) - loss
            assert Fraction(float(up[i])) >= Fraction(float(p.b[i])) + loss


def test_growing_a_polygon_with_axis_rows_is_the_sum(rng):
    p, e = round_polytope(rng, 2, 5), np.array([0.3, 0.1])
    w = rng.normal(size=(30, 2))
    total = supports(p, w) + supports(box(-e, e), w)
    grown = grow(with_axis_rows(p), e)
    np.testing.assert_allclose((vertices(grown) @ w.T).max(axis=0), total, atol=1e-6)
    # Without the axis rows the corners are cut too late: the set is larger, on the safe side for an
    # obstacle.
    triangle = HPolytope(np.array([[-1.0, -0.5], [0.3, -1.0], [0.5, 1.0]]), np.ones(3))
    assert (
        volume(vertices(grow(triangle, e)))
        > volume(vertices(grow(with_axis_rows(triangle), e))) + 0.01
    )


def test_sums_refuse_what_they_cannot_do(rng):
    p = round_polytope(rng, 2, 4)
    empty = HPolytope(
        np.array([[1.0, 0], [-1.0, 0], [0, 1.0], [0, -1.0]]), np.array([0.0, -1.0, 1.0, 1.0])
    )
    assert rational_vertices(empty) == []
    with pytest.raises(InputError, match="is empty"):
        with_axis_rows(empty)
    with pytest.raises(InputError, match="one dimension"):
        minkowski_sum(p, box([0.0], [1.0]))
