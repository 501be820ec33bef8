"""Minkowski sums and Pontryagin differences by definition, with their directions of rounding."""

from fractions import Fraction

import numpy as np
import pytest
from random_polytopes import round_polytope

from parc_jax.common.errors import InputError
from parc_jax.common.lp.status import LPStatus
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box
from parc_jax.common.sets.rational import rational_vertices
from parc_jax.common.sets.vertices import vertices
from parc_jax.neuralparc.sets import pontryagin
from parc_jax.neuralparc.sets.affine import image
from parc_jax.neuralparc.sets.membership import membership
from parc_jax.neuralparc.sets.minkowski import grow, minkowski_sum, polygon_sum, with_axis_rows
from parc_jax.neuralparc.sets.pontryagin import pontryagin_difference, shrink
from parc_jax.neuralparc.sets.support import support
from parc_jax.neuralparc.sets.volume import volume


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


def test_shrinking_without_absolute_values_is_caught(rng, monkeypatch):
    p, e = round_polytope(rng, 3, 6), np.array([0.05, 0.1, 0.15])
    x = rng.uniform(vertices(p).min(axis=0), vertices(p).max(axis=0), (512, 3))
    monkeypatch.setattr(pontryagin, "np", _NumpyWithoutAbs())
    assert any(breaks(p, e, x, np.array([[-1, -1, -1], [1, 1, 1], [1, -1, 1]])))


class _NumpyWithoutAbs:
    """NumPy whose abs forgets the sign rule: the mutant."""

    def __getattr__(self, name):
        return (lambda a: a) if name == "abs" else getattr(np, name)


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


def test_bins_of_errors_give_one_offset_row_each(rng):
    p, e = round_polytope(rng, 2, 4), rng.exponential(size=(3, 5, 2)) * 0.1
    assert shrink(p, e).b.shape == grow(p, e).b.shape == (3, 5, len(p.b))
    np.testing.assert_array_equal(shrink(p, e).b[1, 2], shrink(p, e[1, 2]).b)


def test_general_difference_equals_the_box_form_and_the_vertex_form(rng):
    p = round_polytope(rng, 2, 6)
    q = box([-0.1, 0.05], [0.2, 0.15])
    closed = pontryagin_difference(p, q)
    by_lp = pontryagin_difference(p, from_box(q))
    np.testing.assert_allclose(closed.b, by_lp.b, atol=1e-7)
    exact = p.b - (p.A @ vertices(from_box(q)).T).max(axis=1)
    assert (closed.b <= exact + 1e-15).all() and (by_lp.b <= exact + 1e-15).all()
    shadow = image(round_polytope(rng, 3, 4), 0.05 * rng.normal(size=(2, 3)), np.zeros(2))
    most = (p.A @ (vertices(shadow.base) @ shadow.G.T).T).max(axis=1)
    np.testing.assert_allclose(pontryagin_difference(p, shadow).b, p.b - most, atol=1e-7)
    with pytest.raises(InputError, match="bounded along every row"):
        pontryagin_difference(p, HPolytope(np.array([[1.0, 0.0]]), np.ones(1)))


def test_difference_may_be_empty():
    gone = shrink(from_box(box([0.0], [1.0])), np.array([0.6]))
    assert not gone.contains(np.linspace(-2, 2, 101)[:, None]).any()


def test_sum_contains_every_pair_and_its_supports_add(rng):
    p, q = round_polytope(rng, 2, 4), round_polytope(rng, 2, 3)
    total = minkowski_sum(p, q)
    pairs = [vertices(p)[i] + vertices(q)[j] for i in range(3) for j in range(3)]
    assert all(membership(total, x).status is LPStatus.FEASIBLE for x in pairs)
    w = rng.normal(size=(10, 2))
    np.testing.assert_allclose(
        support(total, w).upper, support(p, w).upper + support(q, w).upper, atol=1e-6
    )


def test_sum_of_boxes_is_a_box_rounded_outward():
    total = minkowski_sum(box([0.1, 0.0], [0.2, 1.0]), box([0.2, -1.0], [0.3, 1.0]))
    assert Fraction(total.lo[0]) <= Fraction(0.1) + Fraction(0.2)
    np.testing.assert_allclose(total.hi, [0.5, 2.0])


def test_polygon_sum_is_the_sum_and_not_larger(rng):
    p, q = round_polytope(rng, 2, 4), round_polytope(rng, 2, 3)
    total = polygon_sum(p, q)
    corners = (vertices(p)[:, None] + vertices(q)[None]).reshape(-1, 2)
    assert total.replace(b=total.b + 1e-12).contains(corners).all()  # corners are rounded
    w = rng.normal(size=(20, 2))
    np.testing.assert_allclose(
        (vertices(total) @ w.T).max(axis=0), (corners @ w.T).max(axis=0), atol=1e-9
    )


def test_growing_a_polygon_with_axis_rows_is_the_sum(rng):
    p, e = round_polytope(rng, 2, 5), np.array([0.3, 0.1])
    grown, total = grow(with_axis_rows(p), e), polygon_sum(p, from_box(box(-e, e)))
    w = rng.normal(size=(30, 2))
    np.testing.assert_allclose(
        (vertices(grown) @ w.T).max(axis=0), (vertices(total) @ w.T).max(axis=0), atol=1e-9
    )
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
        polygon_sum(p, empty)
    with pytest.raises(InputError, match="is empty"):
        with_axis_rows(empty)
    with pytest.raises(InputError, match="one dimension"):
        minkowski_sum(p, box([0.0], [1.0]))
