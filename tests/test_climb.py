"""Climbing: the best stay, children close in, what is not known is dropped."""

import numpy as np

from parc_jax.common.climb import Ranked, climb, ranked


def hill(x):
    return -((x - 0.3) ** 2).sum(axis=1)


def test_it_ends_near_the_top_and_keeps_as_many_as_asked(rng):
    begin = ranked(np.ones((1, 2)), hill(np.ones((1, 2))))
    near = lambda best, spread: best.x[0] + spread * rng.uniform(-1, 1, (50, 2))  # noqa: E731
    found = climb(begin, near, hill, 0.5 ** np.arange(20), kept=3)
    assert len(found.value) == 3 and (np.diff(found.value) <= 0).all()
    assert np.abs(found.x[0] - 0.3).max() < 1e-3 and (found.value == hill(found.x)).all()
    assert len(climb(begin, near, hill, [1.0, 1.0]).value) == 101


def test_equal_ones_stay_in_order_and_unknown_ones_are_dropped():
    begin = ranked((np.array([5, 6]), np.zeros((2, 3))), np.array([1.0, 1.0]))
    children = lambda best, spread: (np.array([7, 8, 9]), np.ones((3, 3)))  # noqa: E731
    value = lambda x: np.array([1.0, np.nan, -np.inf])  # noqa: E731
    found = climb(begin, children, value, [1.0])
    assert found.x[0].tolist() == [5, 6, 7] and found.x[1].shape == (3, 3)


def test_a_round_without_children_changes_nothing():
    begin = Ranked(np.zeros((1, 2)), np.array([-np.inf]))
    none = lambda best, spread: np.zeros((0, 2))  # noqa: E731
    assert climb(begin, none, None, [1.0, 0.5]) is begin
