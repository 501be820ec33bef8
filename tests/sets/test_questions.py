"""Emptiness, membership, centres and boxes, against HiGHS, vertices and each other; both
answers of each.
"""

from fractions import Fraction

import numpy as np
import pytest
from random_polytopes import round_polytope
from scipy.optimize import linprog
from set_oracles import supports

from benchmarks.neuralparc import lp_solve as solve_module
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.sets.affine import find_point, is_proved_outside
from benchmarks.neuralparc.sets.vertices import vertices
from parc_jax.common.errors import InputError
from parc_jax.common.lp import solve as minimising
from parc_jax.common.sets.extent import bounding_box, chebyshev_center
from parc_jax.common.sets.hpolytope import HPolytope

FLAT = HPolytope(
    np.concatenate([np.eye(2), -np.eye(2)]), np.array([1.0, 0.0, 1.0, 0.0])
)  # a segment
EMPTY = HPolytope(np.concatenate([np.eye(2), -np.eye(2)]), np.array([1.0, 0.0, 1.0, -1e-3]))


@pytest.mark.soundness
def test_solver_trouble_is_neither_empty_nor_outside(monkeypatch):
    def trouble(lp):
        h = lp.A.shape[0] + 2 * lp.E.shape[0]
        return solve_module.Hint(
            "trouble", np.zeros(lp.n), np.zeros(h), np.zeros(len(lp.bound_rows()[1])), "MaxTime"
        )

    monkeypatch.setattr(solve_module, "clarabel_hint", trouble)
    assert find_point(EMPTY).status is LPStatus.UNKNOWN
    assert not is_proved_outside(FLAT, np.array([9.0, 9.0]))


def test_chebyshev_centre_is_the_deepest_point(rng):
    for n in (1, 2, 4):
        p = round_polytope(rng, n, 6)
        ball = chebyshev_center(p)
        length = np.linalg.norm(p.A, axis=1)
        rows = np.c_[p.A, length]
        theirs = linprog(
            np.r_[np.zeros(n), -1], rows, p.b, bounds=[(None, None)] * (n + 1), method="highs"
        )
        assert abs(ball.radius + theirs.fun) < 1e-6
        assert p.replace(b=p.b - length * (ball.radius - 1e-6)).contains(ball.center)
    assert 0 <= chebyshev_center(FLAT).radius < 1e-8
    assert chebyshev_center(EMPTY).radius == -np.inf
    assert chebyshev_center(HPolytope(np.eye(2), np.ones(2))).radius > 1.99


@pytest.mark.parametrize("lie", [0.0, 0.5, 2.0, np.nan, -1.0])
def test_a_lying_solver_makes_no_box_too_small_and_no_set_empty(monkeypatch, rng, lie):
    p = round_polytope(rng, 3, 8)
    corners, real = vertices(p), minimising.ask_clarabel

    def liar(*program):
        words, x, z = real(*program)
        return words, x, z * lie

    monkeypatch.setattr(minimising, "ask_clarabel", liar)
    around = bounding_box(p)
    assert (around.lo <= corners.min(axis=0) + 1e-12).all()
    assert (around.hi >= corners.max(axis=0) - 1e-12).all()
    assert chebyshev_center(p).radius != -np.inf


def test_bounding_box_contains_the_set_tightly(rng):
    p = round_polytope(rng, 3, 8)
    around, corners = bounding_box(p), vertices(p)
    np.testing.assert_allclose(around.lo, corners.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(around.hi, corners.max(axis=0), atol=1e-6)
    assert (around.lo <= corners.min(axis=0) + 1e-12).all()
    assert bounding_box(HPolytope(np.eye(2), np.ones(2))).lo.tolist() == [-np.inf, -np.inf]
    with pytest.raises(InputError, match="contradict"):
        bounding_box(EMPTY)


def test_bounding_box_of_pairs_of_coordinates_is_that_of_the_lps(rng):
    for _ in range(30):
        one = round_polytope(rng, 2, int(rng.integers(3, 9)))
        two = round_polytope(rng, 2, 5)
        n, m = len(one.b), len(two.b)
        A = np.zeros((n + m + 2, 5))
        A[:n, [0, 3]] = one.A
        A[n : n + m, [1, 4]] = two.A
        A[n + m :, 2] = [1.0, -2.0]
        p = HPolytope(A, np.concatenate([one.b, two.b, [0.5, 3.0]]))
        quick = bounding_box(p)
        slow = supports(p, np.concatenate([np.eye(5), -np.eye(5)]))
        np.testing.assert_allclose(quick.hi, slow[:5], atol=1e-6)
        np.testing.assert_allclose(-quick.lo, slow[5:], atol=1e-6)
        # exact: it contains every corner
        for rows, axes in ((slice(n), [0, 3]), (slice(n, n + m), [1, 4])):
            for x in rational_corners(p.A[rows][:, axes], p.b[rows]):
                for value, axis in zip(x, axes, strict=True):
                    assert Fraction(quick.lo[axis]) <= value <= Fraction(quick.hi[axis])


def rational_corners(A, b):
    """Corners of a polygon in exact arithmetic, found by trying all pairs of rows."""
    A = [[Fraction(x) for x in row] for row in A.tolist()]
    b = [Fraction(x) for x in b.tolist()]
    for (p, q), d in zip(A, b, strict=True):
        for (r, s), e in zip(A, b, strict=True):
            cross = p * s - q * r
            if cross:
                x = [(d * s - e * q) / cross, (p * e - r * d) / cross]
                if all(u * x[0] + v * x[1] <= f for (u, v), f in zip(A, b, strict=True)):
                    yield x
