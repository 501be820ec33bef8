"""Corners of many polygons at once, against exact arithmetic."""

from fractions import Fraction

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.common.sets.hull import OFF, corners_of_many
from parc_jax.common.sets.rational import rational_vertices


def polygon(rng, n: int) -> HPolytope:
    """n rows around a place that may be far away, in any units and any order."""
    angle = rng.permutation((np.arange(n) + rng.uniform(0.2, 0.8, n)) * 2 * np.pi / n)
    A = np.stack([np.cos(angle), np.sin(angle)], axis=1) * 10.0 ** rng.uniform(-3, 3, (n, 1))
    return HPolytope(A, A @ rng.normal(size=2) * 10.0 ** rng.uniform(-1, 3) + np.abs(A).max(axis=1))


def test_corners_are_the_exact_ones_up_to_what_is_said_they_are_off():
    rng = np.random.default_rng(0)
    given = [polygon(rng, int(n)) for n in rng.integers(3, 9, 300)]
    found = corners_of_many(given)
    known = [(p, c) for p, c in zip(given, found, strict=True) if c is not None]
    assert len(known) > 100
    for p, corners in known:
        exact = np.array([[float(x) for x in v] for v in rational_vertices(p)])
        off = OFF * np.abs(corners).max()
        near = np.abs(corners[:, None] - exact[None]).max(axis=2) <= off
        assert near.any(axis=0).all() and near.any(axis=1).all()
        turned = np.roll(corners, -1, axis=0) - corners
        following = np.roll(turned, -1, axis=0)
        area = turned[:, 0] * following[:, 1] - turned[:, 1] * following[:, 0]
        assert (area > -off * np.abs(corners).max()).all()  # counter-clockwise


def test_boxes_have_their_own_corners_to_the_last_bit():
    rng = np.random.default_rng(1)
    lo = rng.normal(size=(50, 2)) * 10
    hi = lo + rng.uniform(0.01, 3, (50, 2))
    for a, b, corners in zip(
        lo, hi, corners_of_many([from_box(box(*x)) for x in zip(lo, hi, strict=True)]), strict=True
    ):
        assert {tuple(c) for c in corners} == {(x, y) for x in (a[0], b[0]) for y in (a[1], b[1])}


def test_what_floats_do_not_tell_is_left_to_exact_arithmetic():
    eye = np.eye(2)
    square = np.concatenate([eye, -eye])
    empty = hpolytope(square, [-1.0, 1.0, -1.0, 1.0])
    open_side = hpolytope(square[:3], [1.0, 1.0, 1.0])
    needless = hpolytope([*square, [1.0, 1.0]], [1.0, 1.0, 1.0, 1.0, 9.0])
    needle = hpolytope([[0.01, 1.0], [0.0, -1.0], [-1.0, 0.0]], [0.01, 0.0, 0.0])
    twice = hpolytope([*square, *square], [1.0] * 8)
    solid = from_box(box([0.0] * 3, [1.0] * 3))
    unknown = [empty, open_side, needless, needle, twice, solid]
    assert corners_of_many(unknown) == [None] * len(unknown)
    assert corners_of_many([]) == []


def test_a_row_that_cuts_a_corner_off_by_a_hair_leaves_a_larger_polygon():
    """Whatever is called a corner, no point of the polygon is outside of the hull of all."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        cut = 10.0 ** rng.uniform(-18, -10)
        rows = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]])
        p = hpolytope(rows, [1.0, 1.0, 1.0, 1.0, 2.0 + cut * rng.choice([-1, 1])])
        (corners,) = corners_of_many([p])
        if corners is None:
            continue
        for w in rng.normal(size=(20, 2)):
            exact = max(
                sum(Fraction(float(a)) * x for a, x in zip(w, v, strict=True))
                for v in rational_vertices(p)
            )
            assert float(exact) <= (corners @ w).max() + 2 * OFF * np.abs(w).sum()
