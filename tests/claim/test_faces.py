"""Pairs of parallel faces: the box around them, those around a box, their exact rows, what is
refused.
"""

from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import pytest
from scipy.optimize import linprog

from parc_jax.common.errors import InputError
from parc_jax.learning.bound.error_set import DIRECTION_BITS, faces, short

pytestmark = pytest.mark.soundness


def random_faces(rng, n, lead=(3,), frames=False):
    more = short(rng.normal(size=(*lead, n, n)), DIRECTION_BITS)
    directions = np.concatenate([np.broadcast_to(np.eye(n), more.shape), more], axis=-2)
    centre = short(rng.normal(size=directions.shape[:-1]) * 0.1, 20)
    return faces(directions, centre, rng.uniform(0.2, 1.0, centre.shape), frames)


def farthest(given, index, w):
    """Largest w . e over one set, by a linear program."""
    rows = given.rows(index)
    A = np.array([[float(x) for x in a] for a, _ in rows])
    found = linprog(-w, A, [float(b) for _, b in rows], bounds=(None, None))
    return w @ found.x


@pytest.mark.parametrize(("n", "frames"), [(2, False), (3, False), (4, True)])
def test_the_support_is_a_bound_and_exact_where_all_bases_are_tried(rng, n, frames):
    given = random_faces(rng, n, frames=frames)
    for w in rng.normal(size=(20, n)):
        bound = given.errors.support(np.broadcast_to(w, (3, n)))
        exact = np.array([farthest(given, i, w) for i in range(3)])
        assert (bound >= exact - 1e-9).all()
        if not frames:
            np.testing.assert_allclose(bound, exact, atol=1e-9)


@pytest.mark.parametrize("n", [2, 3])
def test_the_box_holds_the_set_and_no_box_of_its_axes_is_smaller(rng, n):
    given = random_faces(rng, n)
    for axis in np.eye(n):
        for i in range(3):
            far = max(farthest(given, i, axis), farthest(given, i, -axis))
            assert given.box[i] @ axis >= far - 1e-9
    by_hand = np.abs(given.centre[:, :n]) + given.half[:, :n]
    assert (given.box >= by_hand).all() and np.allclose(given.box, by_hand, rtol=1e-15)


def test_the_reach_is_the_largest_over_the_corners_of_a_box(rng):
    given, size = random_faces(rng, 2), np.array([0.3, 0.7])
    corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * size
    by_hand = np.abs(given.directions @ corners.T).max(axis=-1)
    np.testing.assert_array_equal(given.half_around(size)[:, :2], np.broadcast_to(size, (3, 2)))
    assert (given.half_around(size) >= by_hand).all()
    np.testing.assert_allclose(given.half_around(size), by_hand, rtol=1e-13)


def test_no_number_is_a_negative_zero():
    """A fraction has none: read back from an answer, the tube would have another hash."""
    rounded = short(np.array([-1e-9, -0.0, 0.0, -1.0]), DIRECTION_BITS)
    assert rounded.tolist() == [0.0, 0.0, 0.0, -1.0]
    assert np.signbit(rounded).tolist() == [False, False, False, True]


def test_rows_are_exact_and_short(rng):
    given = random_faces(rng, 2)
    rows = given.rows(1)
    wanted = zip(given.directions[1], given.centre[1], given.half[1], strict=True)
    for (a, above), (b, below), (u, c, s) in zip(rows[::2], rows[1::2], wanted, strict=True):
        assert a == [Fraction(x) for x in u] and b == [-x for x in a]
        assert above + below == 2 * Fraction(s) and above - below == 2 * Fraction(c)
        assert all(x.denominator <= 2**DIRECTION_BITS for x in a)


def test_what_is_no_set_of_faces_is_refused(rng):
    given = random_faces(rng, 2)
    with pytest.raises(InputError, match="axes as first directions"):
        faces(given.directions[:, ::-1], given.centre, given.half)
    with pytest.raises(InputError, match="negative"):
        faces(given.directions, given.centre, -given.half)
    with pytest.raises(InputError, match="negative one or NaN"):
        faces(given.directions, given.centre, given.half * np.nan)
    with pytest.raises(InputError, match="for every direction"):
        faces(given.directions, given.centre[:, :2], given.half)
    with pytest.raises(InputError, match="finite"):
        faces(given.directions, given.centre * np.inf, given.half)


@pytest.mark.parametrize("n", [2, 3])
def test_the_inner_box_lies_inside_and_touches(rng, n):
    given = random_faces(rng, n)
    assert given.allow_none.all()
    for i in range(3):
        corners = given.inner_box[i] * np.array(list(product((1, -1), repeat=n)))
        rows = given.rows(i)
        for corner in corners:
            exact = [Fraction(float(x)) for x in corner]
            assert all(sum(x * y for x, y in zip(a, exact, strict=True)) <= b for a, b in rows)
        A = np.array([[float(x) for x in a] for a, _ in rows])
        room = np.array([float(b) for _, b in rows]) - (A @ corners.T).max(axis=1)
        assert room.min() < 1e-9


def test_faces_about_a_far_centre_leave_zero_out():
    far = faces(np.eye(2)[None], [[0.5, 0.0]], [[0.4, 0.3]])
    assert not far.allow_none[0] and not far.inner_box.any()
    open_ended = far.with_half(np.full((1, 2), np.inf))
    assert open_ended.allow_none[0] and np.isfinite(open_ended.inner_box).all()


def test_times_a_factor_sets_hold_zero_and_all_smaller_ones(rng):
    given = random_faces(rng, 2)
    sizes = [given.times(factor) for factor in (3.0, 1.0, 0.61, 0.61 - 1e-9, 0.05)]
    for large, small in pairwise(sizes):
        assert (large.centre + large.half >= small.centre + small.half).all()
        assert (large.centre - large.half <= small.centre - small.half).all()
    assert all(one.allow_none.all() for one in sizes)
    high, low = sizes[2].centre + sizes[2].half, sizes[2].centre - sizes[2].half
    np.testing.assert_allclose(high, 0.61 * np.maximum(given.centre + given.half, 0), atol=2e-6)
    np.testing.assert_allclose(low, 0.61 * np.minimum(given.centre - given.half, 0), atol=2e-6)
    lost = faces(given.directions, given.centre, np.full_like(given.half, np.inf)).times(0.5)
    assert np.isposinf(lost.half).all() and not lost.centre.any()
