"""How far errors reach along a direction: boxes and templates against linear programs."""

import itertools
from fractions import Fraction

import jax
import numpy as np
import pytest
from scipy.optimize import linprog

from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.error_set import ErrorBox, template


def rows_of(directions, centre, half):
    """(A, b) of the set."""
    return np.concatenate([directions, -directions]), np.concatenate([centre + half, half - centre])


def farthest(directions, centre, half, w):
    A, b = rows_of(directions, centre, half)
    found = linprog(-w, A, b, bounds=(None, None))
    assert found.status == 0
    return -found.fun


def random_template(rng, n, n_rows):
    """Directions with repetitions and axes among them, a set that is never empty."""
    directions = rng.normal(size=(n_rows, n))
    directions[:n] = np.eye(n)
    directions[-1] = 2.0 * directions[0]
    half = rng.uniform(0.1, 1.0, n_rows)
    inside = 0.3 * rng.normal(size=n)
    return directions, directions @ inside + half * rng.uniform(-0.9, 0.9, n_rows), half


def directions_to_ask(rng, n, directions):
    """Random ones, the axes, and the normals of all faces, where several corners are farthest."""
    axes = np.concatenate([np.eye(n), -np.eye(n)])
    return np.concatenate([rng.normal(size=(10, n)), axes, directions, -directions])


@pytest.mark.soundness
@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_support_and_vertex_are_those_of_the_linear_program(n, seed):
    rng = np.random.default_rng(seed)
    directions, centre, half = random_template(rng, n, n + 3)
    errors = template(directions, centre, half)
    A, b = rows_of(directions, centre, half)
    for w in directions_to_ask(rng, n, directions):
        expected = farthest(directions, centre, half, w)
        assert errors.support(w) == pytest.approx(expected, abs=1e-8)
        vertex = errors.vertex(w)
        assert (A @ vertex <= b + 1e-9).all()
        assert w @ vertex == pytest.approx(errors.support(w), abs=1e-12)


@pytest.mark.soundness
@pytest.mark.parametrize("alike", [True, False])
def test_one_that_holds_two_reaches_as_far_as_either(alike):
    """Of equal directions, or of a pair and one without claim, and of others by their axes."""
    rng = np.random.default_rng(alike)
    (u, *one), (v, *other) = random_template(rng, 2, 5), random_template(rng, 2, 5)
    pair = template(u, *one), template(u if alike else v, *other)
    wide, none = pair[0].wider(pair[1]), template(u, np.zeros(5), np.full(5, np.inf))
    for w in directions_to_ask(rng, 2, u):
        both = max(x.support(w) for x in pair)
        assert both <= wide.support(w) <= (4.0 if alike else 8.0)
        assert pair[0].wider(none).support(w) == np.inf
    assert (ErrorBox(np.r_[1.0, 2]).wider(ErrorBox(np.r_[2.0, 1])).half == 2.0).all()


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_a_box_reaches_to_its_corners(n):
    rng = np.random.default_rng(n)
    half = rng.uniform(0, 1, n)
    corners = np.array(list(itertools.product((-1, 1), repeat=n))) * half
    for w in [*rng.normal(size=(20, n)), *np.eye(n)]:
        assert ErrorBox(half).support(w) == pytest.approx((corners @ w).max(), abs=1e-15)
        assert w @ ErrorBox(half).vertex(w) == pytest.approx(ErrorBox(half).support(w), abs=1e-15)


@pytest.mark.soundness
@pytest.mark.parametrize("xp", ["numpy", "jax"])
def test_without_claim_errors_reach_infinitely_far_along_every_direction(xp):
    everywhere = np.full(2, np.inf)
    sets = [
        ErrorBox(everywhere),
        template(np.array([[1.0, 0], [0, 1], [1, 1]]), np.zeros(3), np.full(3, np.inf)),
    ]
    with x64():
        compiled = jax.jit(lambda e, w: e.support(w))
        ask = compiled if xp == "jax" else lambda e, w: e.support(w)
        for errors, w in itertools.product(sets, np.array([[1.0, 0], [0, -2], [0.3, 1e-300]])):
            assert ask(errors, w) == np.inf
            assert ask(errors, 0 * w) == 0
            assert (errors.vertex(w) == 0).all()


def test_directions_that_depend_on_each_other_are_left_out_and_never_nan():
    directions = np.array([[1.0, 0], [1, 1e-9], [0, 1], [2, 0]])
    errors = template(directions, np.zeros(4), np.array([1.0, 1.0, 2.0, 1.0]))
    for w in np.array([[1.0, 0], [0, 1], [1, 1], [1, -1]]):
        assert errors.support(w) == pytest.approx(abs(w) @ [0.5, 2.0], abs=1e-8)
        assert np.isfinite(errors.vertex(w)).all()
    flat = template(np.array([[1.0, 0], [1, 1e-9]]), np.zeros(2), np.ones(2))
    assert flat.support(np.array([1.0, 0.0])) == np.inf  # bounded along x, not along y: no claim
    with pytest.raises(InputError, match="expected at least 2 directions; got 1"):
        template(np.ones((1, 2)), np.zeros(1), np.ones(1))


def test_leading_axes_broadcast_on_host_and_device_alike():
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(4, 2))
    half = rng.uniform(0.5, 1, (5, 3, 4))
    errors = template(directions, np.zeros(4), half)
    w = rng.normal(size=(3, 2))
    host = errors.support(w), errors.vertex(w)
    assert host[0].shape == (5, 3) and host[1].shape == (5, 3, 2)
    for i, j in np.ndindex(5, 3):
        one = template(directions, np.zeros(4), half[i, j])
        assert one.support(w[j]) == host[0][i, j]
        assert (one.vertex(w[j]) == host[1][i, j]).all()
    with x64():
        device = jax.jit(lambda e, w: (e.support(w), e.vertex(w)))(errors, w)
    np.testing.assert_allclose(device[0], host[0], atol=1e-14)
    np.testing.assert_allclose(device[1], host[1], atol=1e-14)


def exact_support(directions, centre, half, w) -> Fraction:
    """The least support over all bases of a set in the plane, in rationals."""
    best = None
    for i, j in itertools.combinations(range(len(directions)), 2):
        (a, b), (c, d) = ([Fraction(x) for x in directions[r]] for r in (i, j))
        det = a * d - b * c
        if det == 0:
            continue
        x, y = (Fraction(v) for v in w)
        mu = (x * d - y * c) / det, (a * y - b * x) / det
        support = sum(
            m * Fraction(centre[r]) + abs(m) * Fraction(half[r])
            for m, r in zip(mu, (i, j), strict=True)
        )
        best = support if best is None else min(best, support)
    return best


def test_rounding_never_hides_more_of_a_support_than_the_slack_pays_for(rng):
    """Faces that are nearly parallel have long multipliers: the float support may be too small by
    rounding, but by no more than 8,192 units of `largest`. [T11]
    """
    worst = 0.0
    for _ in range(300):
        angle = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.choice([0.051, 0.06, 0.3, 1.0], 4))
        directions = np.round(np.stack([np.cos(angle), np.sin(angle)], axis=1) * 1024) / 1024
        centre, half = rng.normal(size=4), rng.uniform(0, 1, 4)
        w = rng.normal(size=2)
        found = template(directions, centre, half)
        short = float(
            exact_support(directions, centre, half, w) - Fraction(float(found.support(w)))
        )
        worst = max(worst, short / (float(found.largest) * np.abs(w).sum() * 2.0**-53))
    assert worst < 8192 / 16
