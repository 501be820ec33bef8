"""One segment against one grown polygon: the gap is the distance, and the direction proves it."""

from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from dense_oracle import convex_hull, distance
from dropping_nan import dropping_nan

from parc_jax.safe_set.separation import segment
from parc_jax.safe_set.separation.segment import separation

separate = jax.jit(jax.vmap(separation, in_axes=(0, 0, 0, 0)))
N, M = 512, 9


def polygons(rng, n=N, m=M):
    """(n, m, 2) counter-clockwise polygons of 1 to m distinct corners, padded by repeating the
    last.
    """
    out = np.zeros((n, m, 2))
    for i in range(n):
        h = convex_hull(rng.normal(size=(rng.integers(1, m + 1), 2)) * rng.uniform(0.05, 1))
        out[i] = np.concatenate([h, np.broadcast_to(h[-1:], (m - len(h), 2))])
    return out


def segment_distance(pa, pb, corners):
    """Exact distance (n,) of segments to polygons; <= 0 when they meet (then only the sign means
    something).
    """
    ends = np.minimum(distance(corners, pa), distance(corners, pb))
    along = (pb - pa)[:, None]
    length2 = (along**2).sum(-1)
    share = np.clip(
        ((corners - pa[:, None]) * along).sum(-1) / np.where(length2 > 0, length2, 1), 0, 1
    )
    tips = np.sqrt(((pa[:, None] + share[..., None] * along - corners) ** 2).sum(-1)).min(-1)
    other = np.roll(corners, -1, axis=1)
    crossing = (
        (side(pa, pb, corners) * side(pa, pb, other) < 0) & (side2(corners, other, pa, pb) < 0)
    ).any(axis=1)
    return np.where(crossing, -1.0, np.minimum(ends, tips))


def side(pa, pb, x):
    """Which side of the segments (n, 2) the points x (n, m, 2) are on: (n, m)."""
    u, v = (pb - pa)[:, None], x - pa[:, None]
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def side2(a, b, pa, pb):
    """Negative where both ends of a segment are on different sides of the edges a (n, m, 2) to
    b.
    """
    u, v, w = b - a, pa[:, None] - a, pb[:, None] - a
    return (u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]) * (
        u[..., 0] * w[..., 1] - u[..., 1] * w[..., 0]
    )


def random_case(seed):
    rng = np.random.default_rng(seed)
    corners = polygons(rng)
    pa = 1.2 * rng.normal(size=(N, 2))
    pb = pa + rng.normal(size=(N, 2)) * rng.choice([0.0, 0.01, 1.0, 3.0], (N, 1))
    radius = rng.choice([0.0, 0.05, 0.4], N)
    return pa, pb, corners, radius


@pytest.mark.parametrize("seed", range(4))
def test_gap_is_the_distance_when_disjoint_and_not_positive_when_in_contact(seed):
    pa, pb, corners, radius = random_case(seed)
    gap, w = (np.asarray(x) for x in separate(pa, pb, corners, radius))
    true = segment_distance(pa, pb, corners)
    apart, meet = true > 1e-6, true < -1e-6
    assert apart.sum() > 50 and meet.sum() > 50
    np.testing.assert_allclose(gap[apart], (true - radius)[apart], atol=1e-13)
    assert (gap[meet] <= 1e-14).all()
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0, atol=1e-15)


def test_the_direction_is_a_proof_in_exact_arithmetic():
    pa, pb, corners, radius = random_case(9)
    gap, w = (np.asarray(x) for x in separate(pa, pb, corners, radius))
    for i in np.flatnonzero(gap > 1e-12)[:60]:
        wx, wy = map(Fraction, w[i].tolist())
        along = [
            wx * Fraction(x) + wy * Fraction(y)
            for x, y in [*corners[i].tolist(), pa[i].tolist(), pb[i].tolist()]
        ]
        room = min(along[-2:]) - max(along[:-2])
        assert room > 0 and room**2 > Fraction(radius[i]) ** 2 * (wx**2 + wy**2)


def test_touching_is_not_a_gap():
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])[None]
    square = np.concatenate([square, np.broadcast_to(square[:, -1:], (1, M - 4, 2))], axis=1)
    cases = [
        ((1, -1), (1, 2)),
        ((1, 1), (2, 2)),
        ((0.5, 1), (0.5, 3)),
        ((-1, 1), (1, -1)),
        ((1.0, 0.3), (1.0, 0.3)),
    ]
    pa, pb = (np.array([c[i] for c in cases], float) for i in (0, 1))
    corners = np.broadcast_to(square, (len(cases), M, 2))
    pad = lambda x: np.resize(x, (N, *x.shape[1:]))  # noqa: E731  (one compiled shape)
    gap = np.asarray(separate(pad(pa), pad(pb), pad(corners), np.zeros(N))[0])[: len(cases)]
    assert (gap <= 1e-15).all() and (gap >= -1e-15).all()
    gap = np.asarray(
        separate(pad(pa + 2.0**-40), pad(pb + 2.0**-40), pad(corners), np.zeros(N))[0]
    )[: len(cases)]
    assert (gap[[0, 1, 2, 4]] > 0).all()
    beside = pad(np.array([[1.5, 0.5]]))
    assert (
        np.asarray(separate(beside, beside, pad(square), np.full(N, 0.5))[0])[0] == 0.0
    )  # a disc that touches


def test_nothing_undefined_is_separated():
    pa, pb, corners, radius = random_case(2)
    assert not (np.asarray(separate(pa * np.nan, pb, corners, radius)[0]) > 0).any()
    assert not (np.asarray(separate(pa, pb, corners * np.nan, radius)[0]) > 0).any()
    assert not (np.asarray(separate(pa, pb, corners, radius * np.nan)[0]) > 0).any()


def test_one_pair_on_the_host_is_the_same_kernel():
    pa, pb, corners, radius = random_case(1)
    gap, w = (np.asarray(part) for part in separate(pa, pb, corners, radius))
    host = [
        segment.separation(*(np.asarray(x[i]) for x in (pa, pb, corners, radius)), np)
        for i in range(len(gap))
    ]
    np.testing.assert_allclose([h[0] for h in host], gap, atol=1e-12)
    np.testing.assert_allclose([h[1] for h in host], w, atol=1e-9)
    assert all(type(h[1]) is np.ndarray for h in host) and 0 < (gap > 0).sum() < len(gap)


@pytest.mark.slow
@pytest.mark.soundness
@pytest.mark.parametrize("power", [-500, -510, -530, -537, -538, -1000, -1074])
@pytest.mark.parametrize("xp", [np, jnp])
def test_tiny_directions_never_overstate_the_gap(power, xp):
    """Squares of these edges are subnormal: a length taken from them may be far too small. NumPy
    keeps subnormal numbers, whatever the compiler does.
    """
    rng = np.random.default_rng(-power)
    for _ in range(20):
        tiny = rng.uniform(1, 4, (3, 2)) * 2.0**power * [[1, 0], [0, 1], [1, 1]]
        corners = np.array([[0.0, 0.0], tiny[0], tiny[2], tiny[1]])
        pa, pb = np.array([5.0, 0.1]), np.array([5.0, 3.0])
        with jax.enable_x64(True):
            gap, w = separation(*map(xp.asarray, (pa, pb, corners)), 0.0, xp)
            gap, w = float(gap), np.asarray(w)
        distance = np.hypot(*pa)
        assert gap <= distance * (1 + 1e-14)
        assert gap > 0.99 * distance and np.hypot(*w) == pytest.approx(1, abs=1e-14)


def test_a_corner_that_is_none_keeps_no_distance_even_where_the_largest_loses_nan():
    """By day; of all kernels so: `tests/soundness/test_undefined.py`, at the gate."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    a, b = np.array([3.0, -1.0]), np.array([3.0, 2.0])
    with dropping_nan(anew=False):
        assert jax.jit(lambda x: jnp.max(x))(np.full((1000, 16), np.nan)) == -np.inf
        apart = jax.jit(lambda corners: segment.separation(a, b, corners, 0.0)[0])
        assert apart(square) > 0
        for corner in range(4):
            holed = square.copy()
            holed[corner] = np.nan
            assert not apart(holed) > 0
