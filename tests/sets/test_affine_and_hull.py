"""Images, preimages, projections, products, intersections and hulls against membership by
definition.
"""

import numpy as np
import pytest
from random_polytopes import points_around, round_polytope

from parc_jax.common.errors import InputError
from parc_jax.common.lp.status import LPStatus
from parc_jax.common.sets.box import Box, box
from parc_jax.common.sets.hpolytope import HPolytope, from_box
from parc_jax.common.sets.vertices import vertices
from parc_jax.neuralparc.sets.affine import (
    convex_hull,
    image,
    intersection,
    preimage,
    product,
    projection,
)
from parc_jax.neuralparc.sets.ahpolytope import ahpolytope, as_ah
from parc_jax.neuralparc.sets.membership import find_point, is_proved_outside, membership

BAND = 1e-7  # points this close to a boundary may be decided either way by a float LP


def status_of(s, points):
    return np.array([membership(s, x).status for x in points])


def test_preimage_is_membership_of_the_image_point(rng):
    p, C, d = round_polytope(rng, 2, 5), rng.normal(size=(2, 4)), rng.normal(size=2)
    x = 2 * rng.normal(size=(400, 4))
    inside = preimage(p, C, d).contains(x)
    assert 0 < inside.sum() < 400
    np.testing.assert_array_equal(inside, p.contains(x @ C.T + d))


def test_preimages_of_many_maps_are_a_loop(rng):
    p, C, d = round_polytope(rng, 2, 5), rng.normal(size=(3, 2, 4)), rng.normal(size=(3, 2))
    many = preimage(p, C, d)
    for r in range(3):
        np.testing.assert_allclose(many.A[r], preimage(p, C[r], d[r]).A, atol=1e-14)
        np.testing.assert_allclose(many.b[r], preimage(p, C[r], d[r]).b, atol=1e-14)


def test_image_of_a_flattening_map_is_the_hull_of_mapped_vertices(rng):
    p, C, d = round_polytope(rng, 3, 4), rng.normal(size=(2, 3)), rng.normal(size=2)
    s, corners = image(p, C, d), vertices(p) @ C.T + d
    weight = rng.dirichlet(np.ones(len(corners)), 20)
    assert (status_of(s, weight @ corners) == LPStatus.FEASIBLE).all()
    centre = corners.mean(axis=0)
    beyond = centre + 1.01 * (corners[np.argmax(corners @ np.array([1.0, 0.3]))] - centre)
    assert is_proved_outside(s, beyond + np.array([BAND, 0.3 * BAND]))


def test_projection_keeps_exactly_the_shadow():
    triangle = HPolytope(np.array([[-1.0, 0], [0, -1.0], [1.0, 1.0]]), np.array([0.0, 0.0, 1.0]))
    shadow = projection(triangle, [1])
    assert membership(shadow, np.array([0.999])).status is LPStatus.FEASIBLE
    assert is_proved_outside(shadow, np.array([1.001])) and is_proved_outside(
        shadow, np.array([-0.001])
    )
    with pytest.raises(InputError, match="between 0 and 1"):
        projection(triangle, [2])


@pytest.mark.parametrize("kinds", ["bb", "hh", "ha", "ab"])
def test_product_and_intersection_by_definition(rng, kinds):
    def draw(kind):
        if kind == "b":
            return box(-np.ones(2), rng.uniform(0.5, 1, 2))
        p = round_polytope(rng, 2, 3)
        return p if kind == "h" else image(p, rng.normal(size=(2, 2)), np.zeros(2))

    s, t = draw(kinds[0]), draw(kinds[1])
    x = rng.normal(size=(60, 2)) * 0.8
    in_s, in_t = (status_of(u, x) == LPStatus.FEASIBLE for u in (s, t))
    np.testing.assert_array_equal(
        status_of(intersection(s, t), x) == LPStatus.FEASIBLE, in_s & in_t
    )
    pair = np.concatenate([x, x[::-1]], axis=1)
    np.testing.assert_array_equal(
        status_of(product(s, t), pair) == LPStatus.FEASIBLE, in_s & in_t[::-1]
    )
    assert isinstance(
        product(s, t), Box if kinds == "bb" else type(as_ah(s)) if "a" in kinds else HPolytope
    )
    with pytest.raises(InputError, match="one dimension"):
        intersection(s, box([0.0], [1.0]))


def test_hull_contains_both_ends_and_everything_between_and_nothing_else(rng):
    s, t = (
        round_polytope(rng, 2, 4),
        image(round_polytope(rng, 3, 3), rng.normal(size=(2, 3)), np.array([6.0, 0.0])),
    )
    corners = np.concatenate([vertices(s), vertices(t.base) @ t.G.T + t.c])
    h = convex_hull(s, t)
    between = rng.dirichlet(np.ones(len(corners)), 30) @ corners
    assert (status_of(h, between) == LPStatus.FEASIBLE).all()
    for w in rng.normal(size=(10, 2)):
        farthest = (corners @ w).max() / (w @ w)
        assert is_proved_outside(h, (farthest + 1e-6) * w)


def test_hull_with_an_empty_bounded_set_is_the_other_set(rng):
    p = round_polytope(rng, 2, 4)
    empty = HPolytope(np.concatenate([np.eye(2), -np.eye(2)]), np.array([0.0, 1.0, -1.0, 1.0]))
    x = points_around(rng, p, 40)
    for h in (convex_hull(p, empty), convex_hull(empty, p)):
        assert set(status_of(h, x)) == {LPStatus.FEASIBLE, LPStatus.INFEASIBLE}
        np.testing.assert_array_equal(status_of(h, x) == LPStatus.FEASIBLE, p.contains(x))


def test_hull_without_shares_would_be_caught():
    """The guard bites: if one set is not scaled by its share the hull becomes a sum, and the test
    above fails.
    """
    s, t = from_box(box([0.0, 0.0], [1.0, 1.0])), from_box(box([3.0, 0.0], [4.0, 1.0]))
    h = convex_hull(s, t)
    A, b = h.A.copy(), h.b.copy()
    A[:4, -1], b[:4] = 0.0, s.b
    broken, far = h.replace(A=A, b=b), np.array([4.5, 0.5])
    assert is_proved_outside(h, far) and not is_proved_outside(broken, far)


def test_bounds_on_base_points_are_implied_by_the_rows(rng):
    s = round_polytope(rng, 2, 3)
    t = box(*(find_point(s).x + np.array([[-0.5], [1.0]])))
    for built in (as_ah(t), convex_hull(s, t), product(s, as_ah(t)), intersection(as_ah(s), t)):
        free = HPolytope(built.A, built.b)
        assert (built.lo <= vertices(free).min(axis=0) + BAND).all()
        assert (built.hi >= vertices(free).max(axis=0) - BAND).all()


def test_ahpolytope_is_validated():
    s = ahpolytope(np.eye(2), np.zeros(2), np.concatenate([np.eye(2), -np.eye(2)]), np.ones(4))
    assert (s.hi > 1).all() and (s.hi < 1 + 1e-15).all() and s.n == s.m == 2
    with pytest.raises(InputError, match="expected shape"):
        ahpolytope(np.eye(2), np.zeros(3), np.eye(2), np.ones(2))
    with pytest.raises(InputError, match="AH-polytope lo"):
        ahpolytope(np.eye(2), np.zeros(2), np.eye(2), np.ones(2), lo=[0.0])
