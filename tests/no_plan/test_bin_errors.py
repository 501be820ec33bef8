"""What bins allow together and apart, of boxes and between faces, against linear programs and
random errors in exact rows. [T30, T35]
"""

import itertools
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import linprog
from toy_bodies import points_model

from parc_jax.learning.bound.error_set import NO_CLAIM, ErrorBox, ErrorTemplate, Templates
from parc_jax.learning.bound.tube import fitted_tube
from parc_jax.learning.network.predict import by_point
from parc_jax.proof.absence.errors import BinErrors, as_template, bins_over, end_rows, holds

GOAL_A = np.array(
    [[1.0, 0.0, 0.0, 0.0, 0.0], [-0.5, 0.25, 0.0, 1.0, 0.0], [0.0] * 5, [0.0, 0.0, 0.0, 0.0, -2.0]]
)
WAYS = np.array([[1.0, 0.0], [0.6, -0.8]])


def model_with(rng, fitted):
    return points_model(rng, m=2, bins=(2, 3), fitted=fitted, around_zero=True)


def exact_rows(tube, bin, t, i):
    """Rows (a, b) of the errors of one point in one interval of a bin."""
    if tube.templates is not None:
        return tube.templates.interval.rows((bin, t, i))
    half = by_point(tube.interval[bin, t], tube.n_points)[i]
    unit = np.eye(tube.n_p)
    return [
        ([Fraction(x) for x in sign * unit[axis]], Fraction(half[axis]))
        for axis in range(tube.n_p)
        for sign in (1, -1)
    ]


def support(rows, w):
    A, b = ([list(map(float, a)) for a, _ in rows], [float(b) for _, b in rows])
    return -linprog(-w, A_ub=A, b_ub=b, bounds=(None, None)).fun


@pytest.mark.parametrize("fitted", [False, True])
def test_a_box_of_k_overlaps_bins_with_its_interior(rng, fitted):
    tube = model_with(rng, fitted).tube
    one, straddles = bins_over(tube, np.array([-1.0, -1.0]), np.array([0.0, tube.edges[1][1]]))
    assert one.tolist() == [0] and straddles.tolist() == [0, 0]
    some, straddles = bins_over(tube, np.array([-0.1, -0.5]), np.array([0.1, 0.0]))
    assert some.tolist() == [0, 1, 3, 4] and straddles.tolist() == [1, 1]


@pytest.mark.parametrize("fitted", [False, True])
def test_common_errors_are_errors_of_every_bin(rng, fitted):
    """Corners of what several bins allow keep to the exact rows of each; of one bin the support is
    that of its set.
    """
    model = model_with(rng, fitted)
    known = BinErrors(model.tube, GOAL_A)
    over = known.over(np.array([-0.5, -1.0]), np.array([0.5, 1.0]))
    assert isinstance(over.common, ErrorBox) and len(over.bins) == 6
    for bin, t, i in itertools.product(over.bins, range(4), range(2)):
        rows = exact_rows(model.tube, bin, t, i)
        for sign in itertools.product((1, -1), repeat=2):
            assert holds(rows, over.common.half[t, i] * sign)
    one = known.over(np.array([0.2, 0.4]), np.array([0.5, 1.0]))
    assert one.bins.tolist() == [5]
    for t, i, w in itertools.product(range(4), range(2), WAYS):
        found = one.common.support(np.broadcast_to(w, (4, 2, 2)))[t, i]
        assert found == pytest.approx(support(exact_rows(model.tube, 5, t, i), w))


@pytest.mark.parametrize("fitted", [False, True])
def test_errors_at_the_end_are_of_every_bin_and_of_one_the_farthest(rng, fitted):
    model = model_with(rng, fitted)
    tube = model.tube
    known = BinErrors(tube, GOAL_A)
    assert len(known.goal_entry(GOAL_A, 0, Fraction(1))) == 2 + fitted  # faces: with an error
    for lo, hi in (([-0.5, -1.0], [0.5, 1.0]), ([0.2, 0.4], [0.5, 1.0])):
        over = known.over(np.array(lo), np.array(hi))
        errors = known.at_end(over.bins)
        for row, error, lost in zip(GOAL_A, errors, over.goal_least, strict=True):
            assert lost == pytest.approx(row @ error) and lost >= 0
            assert not row.any() or lost > 0
            if fitted:
                assert all(holds(end_rows(tube.templates, bin), error) for bin in over.bins)
        assert (over.goal_most >= over.goal_least - 1e-12).all()
    if fitted:
        farthest = [support(end_rows(tube.templates, 5), row) for row in GOAL_A]
        np.testing.assert_allclose(over.goal_least, farthest, rtol=1e-6, atol=1e-12)


def test_a_bin_without_claim_allows_everything(rng):
    model = model_with(rng, True)
    during, at_end = model.tube.templates
    half = at_end.half.copy()
    half[2] = np.inf
    tube = fitted_tube(model.tube.edges, during, replace(at_end, half=half))
    assert not tube.claimed[2] and isinstance(tube.templates, Templates)
    known = BinErrors(tube, GOAL_A)
    over = known.over(np.array([-1.0, 0.4]), np.array([-0.5, 1.0]))
    assert over.bins.tolist() == [2] and over.goal_least[0] > 1e-3 * NO_CLAIM
    both = known.over(np.array([-1.0, 0.0]), np.array([-0.5, 1.0]))
    assert both.bins.tolist() == [1, 2] and (both.common.half < 1).all()


def test_a_box_as_a_template_is_the_same_set(rng):
    half = rng.uniform(0.1, 1, (3, 2))
    template = as_template(ErrorBox(half), 6)
    assert isinstance(template, ErrorTemplate) and template.half.shape == (3, 6, 2)
    for w in rng.normal(size=(10, 2)):
        np.testing.assert_allclose(template.support(w), ErrorBox(half).support(w), rtol=1e-15)
    assert as_template(template, 6) is template
