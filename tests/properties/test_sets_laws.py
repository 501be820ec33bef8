"""Laws of sets and LPs, for polytopes drawn by hypothesis."""

from fractions import Fraction

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_polytopes import points_around, round_polytope
from set_oracles import supports

from benchmarks.neuralparc import lp_solve as solving
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.sets import (
    affine,
    operations,
    sampling,
    vertices,
)
from parc_jax.common.lp import exact
from parc_jax.common.sets import extent, rational
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box

pytestmark = pytest.mark.property
ROUNDING = 1e-9


def law_hull_contains_both_ends_and_their_mixtures(rng, n, h):
    p, q = round_polytope(rng, n, h), round_polytope(rng, n, h)
    x, y = vertices.vertices(p)[0], vertices.vertices(q)[-1]
    both = affine.convex_hull(p, q)
    for share in (0.0, 0.3, 1.0):
        assert not affine.is_proved_outside(both, share * x + (1 - share) * y)


def law_hull_is_no_larger_than_both_supports(rng, n, h):
    p, q, w = round_polytope(rng, n, h), round_polytope(rng, n, h), rng.normal(size=(3, n))
    farthest = np.maximum(supports(p, w), supports(q, w))
    assert (supports(affine.convex_hull(p, q), w) <= farthest + 1e-6).all()


def law_shrink_then_perturb_stays_inside(rng, n, h):
    p, e = round_polytope(rng, n, h), rng.uniform(0, 0.2, n)
    x = points_around(rng, p, 200)
    kept = x[operations.shrink(p, e).contains(x)]
    assert (
        p.replace(b=p.b + ROUNDING).contains(kept + e * rng.choice([-1.0, 1.0], kept.shape)).all()
    )


def law_grown_set_contains_every_perturbation(rng, n, h):
    p, e = round_polytope(rng, n, h), rng.uniform(0, 0.2, n)
    corners = vertices.vertices(p)
    grown = operations.grow(p, e)
    assert (
        grown.replace(b=grown.b + ROUNDING)
        .contains(corners + e * rng.choice([-1.0, 1.0], corners.shape))
        .all()
    )


def law_supports_of_a_sum_add(rng, n, h):
    p, q, w = round_polytope(rng, n, h), round_polytope(rng, n, h), rng.normal(size=(2, n))
    parts = supports(p, w) + supports(q, w)
    np.testing.assert_allclose(supports(operations.minkowski_sum(p, q), w), parts, atol=1e-6)


def law_vertices_span_the_set(rng, n, h):
    p, w = round_polytope(rng, n, h), rng.normal(size=(4, n))
    corners = vertices.vertices(p)
    assert p.replace(b=p.b + ROUNDING).contains(corners).all()
    np.testing.assert_allclose((corners @ w.T).max(axis=0), supports(p, w), atol=1e-6)


def law_volumes_add_scale_and_ignore_translation(rng, n, h):
    p = round_polytope(rng, n, h)
    corners = vertices.vertices(p)
    whole = sampling.volume(corners)
    w = rng.normal(size=n)
    level = float(w @ corners.mean(axis=0))
    halves = [HPolytope(np.vstack([p.A, s * w]), np.r_[p.b, s * level]) for s in (1.0, -1.0)]
    np.testing.assert_allclose(
        sum(sampling.volume(vertices.vertices(q)) for q in halves), whole, rtol=1e-9
    )
    np.testing.assert_allclose(sampling.volume(3.0 * corners + w), whole * 3.0**n, rtol=1e-9)


def law_row_order_changes_nothing(rng, n, h):
    p = round_polytope(rng, n, h)
    order = rng.permutation(len(p.b))
    q = HPolytope(p.A[order] * 4.0, p.b[order] * 4.0)
    np.testing.assert_allclose(extent.bounding_box(q).hi, extent.bounding_box(p).hi, atol=1e-6)
    np.testing.assert_allclose(
        sampling.volume(vertices.vertices(q)), sampling.volume(vertices.vertices(p)), rtol=1e-9
    )


def law_chebyshev_ball_fits_and_none_is_larger(rng, n, h):
    p = round_polytope(rng, n, h)
    ball = extent.chebyshev_center(p)
    length = np.linalg.norm(p.A, axis=1)
    assert (p.A @ ball.center + length * ball.radius <= p.b + ROUNDING).all()
    x = points_around(rng, p, 200)
    assert (((p.b - x @ p.A.T) / length).min(axis=1) <= ball.radius + 1e-6).all()


def law_lower_bound_is_below_every_point(rng, n, h):
    p, c = round_polytope(rng, n, h), rng.normal(size=n)
    found = solving.solve(c, p.A, p.b)
    assert found.status is LPStatus.OPTIMAL
    assert found.lower <= (vertices.vertices(p) @ c).min() + ROUNDING and found.lower > -np.inf


def law_multipliers_give_a_bound_whatever_they_are(rng, n, h):
    p, c, mu = round_polytope(rng, n, h), rng.normal(size=n), rng.normal(size=h + 2 * n)
    lo, hi = vertices.vertices(p).min(axis=0) - 1, vertices.vertices(p).max(axis=0) + 1
    assert exact.dual_bound(c, p.A, p.b, mu, lo, hi) <= (vertices.vertices(p) @ c).min() + ROUNDING


def law_more_rows_never_fill_an_empty_set(rng, n, h):
    p = round_polytope(rng, n, h)
    w = rng.normal(size=n)
    beyond = float((vertices.vertices(p) @ w).max()) + 0.01
    empty = HPolytope(np.vstack([p.A, -w]), np.r_[p.b, -beyond])
    more = HPolytope(
        np.vstack([empty.A, rng.normal(size=(2, n))]), np.r_[empty.b, rng.normal(size=2)]
    )
    assert solving.feasible(empty.A, empty.b).status is LPStatus.INFEASIBLE
    assert solving.feasible(more.A, more.b).status is LPStatus.INFEASIBLE


def law_rational_vertices_satisfy_their_rows_exactly(rng, n, h):
    p = round_polytope(rng, 2, h)
    rows = [
        (Fraction(float(a)), Fraction(float(c)), Fraction(float(b)))
        for (a, c), b in zip(p.A, p.b, strict=True)
    ]
    corners = rational.rational_vertices(p)
    for x, y in corners:
        slack = [b - a * x - c * y for a, c, b in rows]
        assert min(slack) == 0 and sum(s == 0 for s in slack) >= 2
    assert rational.area(corners) > 0


def law_samples_stay_inside(rng, n, h):
    p = round_polytope(rng, 3, 6)
    start = extent.chebyshev_center(p).center
    key = jax.random.split(jax.random.key(int(rng.integers(1 << 30))), 1)
    assert p.contains(
        sampling.sample_polytopes(key, p.A[None], p.b[None], start[None], 64, 2)
    ).all()


LAWS = (
    law_hull_contains_both_ends_and_their_mixtures,
    law_hull_is_no_larger_than_both_supports,
    law_shrink_then_perturb_stays_inside,
    law_grown_set_contains_every_perturbation,
    law_supports_of_a_sum_add,
    law_vertices_span_the_set,
    law_volumes_add_scale_and_ignore_translation,
    law_row_order_changes_nothing,
    law_chebyshev_ball_fits_and_none_is_larger,
    law_lower_bound_is_below_every_point,
    law_multipliers_give_a_bound_whatever_they_are,
    law_more_rows_never_fill_an_empty_set,
    law_rational_vertices_satisfy_their_rows_exactly,
    law_samples_stay_inside,
)
drawn = given(seed=st.integers(0, 2**31 - 1), n=st.integers(1, 4), h=st.integers(1, 6))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@settings(derandomize=True, deadline=None, max_examples=8, print_blob=True)
@drawn
def test_law(law, seed, n, h):
    law(np.random.default_rng(seed), n, h)


def test_boxes_are_polytopes(rng):
    """The box forms and the polytope forms of one set agree."""
    b = box(-rng.uniform(0.1, 1, 3), rng.uniform(0.1, 1, 3))
    w = rng.normal(size=(20, 3))
    furthest = np.where(w > 0, w * b.hi, w * b.lo).sum(axis=1)
    np.testing.assert_allclose(supports(from_box(b), w), furthest, atol=1e-6)
    assert exact.round_up(Fraction(1, 3)) > exact.round_down(Fraction(1, 3))
