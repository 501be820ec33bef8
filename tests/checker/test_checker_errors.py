"""How far errors reach: templates against the corners of their polytopes, in fractions."""

import itertools
import random
import sys
from fractions import Fraction as F
from pathlib import Path

import pytest
from faces_of_errors import template_of

from parc_jax.checker import Rejected, integers
from parc_jax.checker.errors import Several, Widths

sys.path.insert(0, str(Path(__file__).parent / "compare"))

import bodies


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def random_rows(rng, n):
    """The axes both ways, and others; the offsets are not symmetric."""
    rows = []
    for axis in range(n):
        for sign in (1, -1):
            unit = [F(sign * int(axis == j)) for j in range(n)]
            rows.append((unit, F(rng.randint(1, 30), 7)))
    for _ in range(rng.randint(0, 5)):
        rows.append(([F(rng.randint(-9, 9), 4) for _ in range(n)], F(rng.randint(1, 20), 3)))
    return rows


@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_template_reaches_as_far_as_its_farthest_corner(n):
    rng = random.Random(n)
    for _ in range(25):
        rows = random_rows(rng, n)
        corners = bodies.vertices(rows, n)
        error = template_of(rows, n)
        for _ in range(8):
            w = [rng.randint(-9, 9) for _ in range(n)]
            assert error.support(w) == max(dot(w, x) for x in corners)
        for x in corners:
            assert error.contains(x) and not error.contains([2 * v for v in x])


def test_rows_along_the_axes_reach_as_far_as_widths():
    e = [F(1, 3), F(0), F(2)]
    unit = [[F(int(i == j)) for j in range(3)] for i in range(3)]
    rows = [(u, x) for u, x in zip(unit, e, strict=True)]
    rows += [([-v for v in u], x) for u, x in zip(unit, e, strict=True)]
    template, widths = template_of(rows, 3), Widths(*integers(e))
    for w in itertools.product((-2, 0, F(3, 5)), repeat=3):
        assert template.support(w) == widths.support(w) == dot(map(abs, w), e)
    assert widths.contains([F(-1, 3), F(0), F(2)]) and not widths.contains([F(0), F(1), F(0)])


def test_directions_that_no_rows_give_are_refused():
    half_open = template_of([([F(1), F(0)], F(1)), ([F(0), F(1)], F(1))], 2)
    assert half_open.support([1, 2]) == 3
    for w in ([-1, 0], [1, -1]):
        with pytest.raises(Rejected, match="no multipliers"):
            half_open.support(w)
    slab = template_of([([F(1), F(1)], F(1)), ([F(-1), F(-1)], F(1))], 2)
    with pytest.raises(Rejected, match="no multipliers"):
        slab.support([1, 0])


def test_in_more_dimensions_ways_are_needed_and_the_least_right_one_counts():
    rows = [([F(int(i == j)) for j in range(4)], F(i + 1)) for i in range(4)]
    rows.append(([F(1), F(1), F(0), F(0)], F(1)))
    w = [F(1), F(1), F(0), F(0)]
    ways = [[[(0, F(1)), (1, F(1))], [(4, F(1))]], [[(0, F(1))], [(4, F(-1))]], []]
    error = template_of(rows, 4, ways)
    assert error.support(w, 0) == 1
    for goal_row in (1, 2, None):  # wrong rows, a negative multiplier, none
        with pytest.raises(Rejected, match="no multipliers"):
            error.support(w, goal_row)


def test_several_bins_reach_as_far_as_the_farthest_or_as_all():
    """A diagonal: neither bin is as wide as both together, axis by axis."""
    sets = [Widths([1, 3], 1), Widths([3, 1], 1)]
    assert Several(sets, max).support([1, 1]) == 4
    assert Several(sets, max).support([1, 0]) == 3 and Several(sets, min).support([1, 0]) == 1
    assert not Several(sets, min).contains([F(2), F(0)])
    assert Several(sets, min).contains([F(1), F(1)])


def test_the_way_of_a_row_is_told_by_its_whole_numbers():
    """1/3 x <= 1/7, three times over: x <= 3/7."""
    rows = [([F(1, 3), F(0), F(0), F(0)], F(1, 7))]
    error = template_of(rows, 4, [[[(0, F(3))]]])
    assert error.support([F(1), F(0), F(0), F(0)], 0) == F(3, 7)


def test_long_numbers_cost_more():
    short = template_of([([F(1), F(0)], F(1))] * 4, 2)
    long = template_of([([F(1), F(0)], F(1, 1 << 8000))] * 4, 2)
    assert long.cost > 500 * short.cost
