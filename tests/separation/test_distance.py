"""A part of a body against an obstacle, in the plane and in space: the gap is the distance, the
direction proves it, and contact is never called a gap.
"""

from fractions import Fraction

import jax
import numpy as np
import pytest
from exact_hulls import corners_between, differences, squared_distance
from one_interval import separation
from scipy.optimize import nnls

from parc_jax.common.arrays import x64
from parc_jax.learning.bound.error_set import ErrorBox, template
from parc_jax.safe_set.separation import distance

N = 64
PLANE_AND_SPACE = [2, pytest.param(3, marks=pytest.mark.slow)]


separations = jax.jit(jax.vmap(separation))


def separate(*pairs):
    with x64():
        return [np.asarray(x) for x in separations(*pairs)]


def near(points):
    """Distance of the origin from conv(points (n, d)) by a quadratic program."""
    A = np.concatenate([points.T, np.ones((1, len(points)))])
    share, _ = nnls(A, np.eye(len(A))[-1], maxiter=10000)
    return np.linalg.norm(points.T @ (share / share.sum()))


def on_a_grid(rng, n):
    """Points on a grid of few places: they coincide, lie on lines and in planes, and touch."""
    far = 4 - n  # in space fewer meet
    a = rng.integers(-1, 2, (N, 2, n)) + rng.integers(-far, far + 1, (N, 1, n))
    b = a + rng.integers(-1, 2, (N, 1, n))
    vertices = rng.integers(-2, 3, (N, 3, n))
    return a / 4, b / 4, vertices / 4


def random_pairs(rng, n):
    """Hulls of two to four points that move, and obstacles of up to eight corners, some flat."""
    vertices = rng.normal(size=(N, 8, n)) * rng.uniform(0.1, 1.5, (N, 1, 1))
    vertices[: N // 4, :, -1] = 0.25
    vertices[N // 4 : N // 3, 3:] = vertices[N // 4 : N // 3, 2:3]
    a = 1.5 * rng.normal(size=(N, 1, n)) + rng.normal(size=(N, 4, n)) * rng.uniform(0, 1, (N, 1, 1))
    b = a + 0.3 * rng.normal(size=(N, 1, n)) + 0.05 * rng.normal(size=(N, 4, n))
    return a, b, vertices


@pytest.mark.soundness
@pytest.mark.parametrize(
    ("n", "seed"), [(2, 0), (2, 1), pytest.param(3, 0, marks=pytest.mark.slow)]
)
def test_on_a_grid_the_gap_is_the_exact_distance(n, seed):
    rng = np.random.default_rng(seed)
    a, b, vertices = on_a_grid(rng, n)
    nothing = np.zeros(a.shape)
    gap, w = separate(a, b, ErrorBox(nothing), vertices, np.zeros(N))
    both = np.concatenate([a, b], axis=1)
    hulls = [(p[:, None] - v[None]).reshape(-1, n) for p, v in zip(both, vertices, strict=True)]
    some = N if n == 2 else N // 2
    exact = np.array([squared_distance(hull) for hull in hulls[:some]])
    gap, w = gap[:some], w[:some]
    meet = exact == 0
    assert meet.sum() >= 4 and (~meet).sum() > 10
    assert (gap[meet] <= 1e-15).all()
    np.testing.assert_allclose(gap[~meet], np.sqrt(exact[~meet].astype(float)), atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0, atol=1e-15)


@pytest.mark.parametrize("n", PLANE_AND_SPACE)
@pytest.mark.parametrize("seed", range(2))
def test_with_boxes_of_errors_the_gap_is_the_distance(n, seed):
    rng = np.random.default_rng(seed)
    a, b, vertices = random_pairs(rng, n)
    half = rng.uniform(0, 0.1, a.shape)
    radius = rng.choice([0.0, 0.05, 0.4], N)
    gap, _ = separate(a, b, ErrorBox(half), vertices, radius)
    both, twice = np.concatenate([a, b], axis=1), np.concatenate([half, half], axis=1)
    true = np.array([near(differences(*x)) for x in zip(both, twice, vertices, strict=True)])
    apart = true > 1e-9
    assert 10 < apart.sum() < N
    np.testing.assert_allclose(gap[apart], (true - radius)[apart], atol=1e-9)
    assert (gap[~apart] <= 1e-14 - radius[~apart]).all()


@pytest.mark.parametrize("n", PLANE_AND_SPACE)
def test_with_templates_of_errors_the_gap_is_the_distance(n):
    rng = np.random.default_rng(n)
    a, b, vertices = random_pairs(rng, n)
    directions = np.concatenate([np.eye(n), rng.normal(size=(2, n))])
    half = rng.uniform(0.05, 0.2, (N, 4, n + 2))
    errors = template(directions, 0.3 * half, half)
    gap, _ = separate(a, b, errors, vertices, np.zeros(N))
    for i in range(0, N, 4):
        around = [corners_between(directions, 0.3 * half[i, j], half[i, j]) for j in range(4)]
        points = [p[j] + around[j] for p in (a[i], b[i]) for j in range(4)]
        points = np.concatenate(points)[:, None] - vertices[i][None]
        true = near(points.reshape(-1, n))
        assert gap[i] == pytest.approx(true, abs=1e-9) if true > 1e-9 else gap[i] <= 1e-14


@pytest.mark.soundness
@pytest.mark.parametrize("n", PLANE_AND_SPACE)
def test_the_direction_is_a_proof_in_exact_arithmetic(n):
    rng = np.random.default_rng(n)
    a, b, vertices = random_pairs(rng, n)
    half, radius = rng.uniform(0, 0.1, a.shape), rng.uniform(0, 0.3, N)
    gap, w = separate(a, b, ErrorBox(half), vertices, radius)
    proved = np.flatnonzero(gap > 1e-12)
    assert len(proved) > 15
    for i in proved:
        way = [Fraction(x) for x in w[i].tolist()]
        size = [abs(c) for c in way]
        lost = [exactly(size, e) for e in half[i]]
        least = [
            exactly(way, p) - e for ends in (a[i], b[i]) for p, e in zip(ends, lost, strict=True)
        ]
        room = min(least) - max(exactly(way, v) for v in vertices[i])
        assert room > 0 and room**2 > Fraction(radius[i]) ** 2 * sum(c * c for c in way)


def exactly(way, x):
    return sum(c * Fraction(v) for c, v in zip(way, x.tolist(), strict=True))


@pytest.mark.parametrize("n", PLANE_AND_SPACE)
def test_touching_is_not_a_gap_and_the_next_place_is(n):
    """A cube against points, edges and faces that touch it, repeated and whole."""
    corners = np.array(np.meshgrid(*[[0.0, 1.0]] * n)).reshape(n, -1).T
    cases = [
        np.ones((4, n)),  # a corner, all points equal
        np.concatenate([np.full((2, n), 1.0), np.eye(n)[:1] + 1, np.eye(n)[:1] * 3 + 1]),  # a line
        corners[:4] + np.eye(n)[0],  # whole faces
        corners[-4:] - 1,  # a corner from below
    ]
    points = np.stack(cases)
    away = np.stack([np.ones(n), np.ones(n), np.eye(n)[0], -np.ones(n)]) * 2.0**-40
    half, vertices = np.zeros(points.shape), np.stack([corners] * len(cases))
    still = separate(points, points, ErrorBox(half), vertices, np.zeros(len(cases)))[0]
    assert (np.abs(still) <= 1e-15).all()
    moved = points + away[:, None]
    gap = separate(moved, moved, ErrorBox(half), vertices, np.zeros(len(cases)))[0]
    np.testing.assert_allclose(gap, np.linalg.norm(away, axis=1), rtol=1e-3)
    ball = separate(
        moved + 1.0 * away[:, None] * 2.0**39,
        moved + away[:, None] * 2.0**39,
        ErrorBox(half),
        vertices,
        np.linalg.norm(away, axis=1) * (1 + 2.0**39),
    )[0]
    assert (np.abs(ball) <= 1e-11).all()


@pytest.mark.slow
@pytest.mark.parametrize("n", PLANE_AND_SPACE)
def test_where_both_have_one_middle_there_is_still_a_direction(n):
    """The steps meet the origin at once: nothing is nearest, and nothing is no direction."""
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * n)).reshape(n, -1).T
    points = np.stack([np.zeros((2, n)), np.eye(n)[:1] * [[1], [-1]], 2 * corners[[0, -1]]])
    half, vertices = np.zeros(points.shape), np.stack([corners] * len(points))
    gap, w = separate(points, points, ErrorBox(half), vertices, np.full(len(points), 0.1))
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0, atol=1e-15)
    assert (gap <= -1.1 + 1e-15).all()


@pytest.mark.soundness
@pytest.mark.parametrize("n", PLANE_AND_SPACE)
def test_nothing_undefined_is_separated_and_no_claim_is_no_gap(n):
    rng = np.random.default_rng(0)
    a, b, vertices = random_pairs(rng, n)
    half, radius = np.zeros(a.shape), np.zeros(N)
    one = np.zeros(a.shape)
    one[:, 1, 0] = np.nan
    wide = half.copy()
    wide[:, 2] = np.inf
    assert (separate(a, b, ErrorBox(half), vertices, radius)[0] > 0).sum() > 15
    broken = [
        (a + one, b, half, vertices, radius),
        (a, b + one, half, vertices, radius),
        (a, b, half + one, vertices, radius),
        (a, b, half, vertices + one[:, 1:2], radius),
        (a, b, half, vertices, radius * np.nan),
        (a, b, wide, vertices, radius),
        (a, b, half + np.inf, vertices, radius),
    ]
    for a_, b_, half_, vertices_, radius_ in broken:
        gap, _ = separate(a_, b_, ErrorBox(half_), vertices_, radius_)
        assert not (gap > 0).any()


@pytest.mark.parametrize("n", PLANE_AND_SPACE)
@pytest.mark.parametrize("power", [-1060, -700, -500, 200])
def test_no_size_overstates_the_gap(n, power):
    rng = np.random.default_rng(1)
    tiny = rng.normal(size=(N, 4, n)) * 2.0**power
    a = tiny[:, :1] + 5.0 * rng.normal(size=(N, 1, n)) * 2.0 ** max(power, 0)
    gap, _ = separate(a, a, ErrorBox(np.zeros(a.shape)), tiny, np.zeros(N))
    distance = np.array(
        [near((p - v) / 2.0 ** max(power, 0)) for p, v in zip(a, tiny, strict=True)]
    )
    np.testing.assert_allclose(gap, distance * 2.0 ** max(power, 0), rtol=1e-9)


@pytest.mark.soundness
def test_steps_that_end_at_an_overlap_say_which_pairs_touch_and_nothing_else():
    """Of the intervals of one pair: where none overlaps all gaps are as they were, bit by bit;
    where one does the least is not positive; intervals that do not count end nothing. Where all
    gaps are larger than is asked for, they are less than they were, and no less than that.
    """
    a, b, vertices = random_pairs(np.random.default_rng(4), 2)
    errors = ErrorBox(np.full((8, 4, 2), 0.01))
    search = jax.jit(distance.separations)
    apart = sooner = 0
    with x64():
        for i in range(0, N, 8):
            for obstacle in vertices[i : i + 8]:
                pair = a[i : i + 8], b[i : i + 8], errors, obstacle, 0.0
                whole, _ = search(*pair)
                until, _ = search(*pair, (np.ones(8, bool), np.float64(np.inf)))
                best = int(whole.argmax())
                if whole[best] > 0:
                    only, _ = search(*pair, (np.arange(8) == best, np.float64(np.inf)))
                    assert only[best] == whole[best]
                assert (until.min() > 0) == (whole.min() > 0)
                assert (until <= whole).all()
                if whole.min() > 0:
                    apart += 1
                    np.testing.assert_array_equal(until, whole)
                    least, _ = search(*pair, (np.ones(8, bool), whole.min()))
                    np.testing.assert_array_equal(least, whole)
                    near, _ = search(*pair, (np.ones(8, bool), whole.min() / 2))
                    assert (near > whole.min() / 2).all() and (near <= whole).all()
                    sooner += int((near < whole).any())
    assert sooner > 4
    assert 4 < apart < N - 4
