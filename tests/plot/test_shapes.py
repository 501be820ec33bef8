"""Outlines: hulls of a turned body, what a goal over many points looks like, projections of
solids.
"""

import itertools

import numpy as np
import pytest
from drawn_bodies import CAR, CAR_AT, DRONE_AT, car, drone, turned

from parc_jax.app.plot import shapes
from parc_jax.app.plot.shapes import FRONT, SIDE, TOP, views_of
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope
from parc_jax.problem.body import Disc, Part
from parc_jax.problem.problem import goal_of_points


def area(outline) -> float:
    """Of a polygon (v, 2), counter-clockwise."""
    x, y = np.asarray(outline).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def test_corners_are_those_of_boxes_and_refused_where_there_are_none():
    for n in (2, 3, 4):
        cube = from_box(box(np.zeros(n), np.ones(n)))
        corners = {tuple(corner) for corner in shapes.corners_of(cube).round(9).tolist()}
        assert corners == set(itertools.product((0.0, 1.0), repeat=n))
        with pytest.raises(InputError, match="expected a bounded set"):
            shapes.corners_of(hpolytope(cube.A[1:], cube.b[1:]))
    flat = from_box(box(np.zeros(4), [1.0, 1.0, 1.0, 0.0]))
    with pytest.raises(InputError, match="with volume"):
        shapes.corners_of(flat)
    empty = hpolytope([[1.0, 0.0], [-1.0, 0.0]], [0.0, -1.0])
    assert shapes.corners_of(empty).shape == (0, 2)


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
@pytest.mark.parametrize("radius", [0.0, 0.25])
def test_a_part_is_its_hull_grown_by_the_disc(angle, radius):
    part = Part((0, 1, 2, 3), Disc(radius))
    got = area(shapes.part_outline(part, turned(CAR_AT, angle)))
    exact = 0.8 * 0.4 + 2 * (0.8 + 0.4) * radius + np.pi * radius**2
    assert exact <= got + 1e-12 and got == pytest.approx(exact, rel=2e-3)


def test_points_at_one_place_or_in_line_have_an_outline():
    one = shapes.part_outline(Part((0, 1), Disc(0.5)), np.zeros((2, 2)))
    assert area(one) == pytest.approx(np.pi / 4, rel=2e-3)
    capsule = shapes.part_outline(Part((0, 1), Disc(0.5)), np.array([[0.0, 0], [2, 0]]))
    assert area(capsule) == pytest.approx(np.pi / 4 + 2.0, rel=2e-3)
    bare = shapes.part_outline(Part((0, 1), Disc(0.0)), np.array([[0.0, 0], [2, 0]]))
    assert bare.min(axis=0).tolist() == [0, 0] and bare.max(axis=0).tolist() == [2, 0]


def test_a_solid_is_seen_from_three_sides():
    assert views_of(2) == (TOP,) and views_of(3) == (TOP, SIDE, FRONT)
    seen = [
        area(shapes.part_outline(Part(range(8), Disc(0.0)), DRONE_AT, v.axes)) for v in views_of(3)
    ]
    assert seen == pytest.approx([0.6 * 0.4, 0.6 * 0.2, 0.4 * 0.2])
    solid = from_box(box([0, 0, 0], [1, 2, 3]))
    assert [area(shapes.shadow(solid, v.axes)) for v in views_of(3)] == pytest.approx([2, 3, 6])


def test_the_goal_of_many_points_is_one_region_or_several():
    _, problem = car()
    ((points, (outline,)),) = shapes.goals(problem.goal, 2, 4)
    assert points == [0, 1, 2, 3] and area(outline) == pytest.approx(1.4**2)
    _, problem = drone()  # over 25 coordinates, far more than vertices can be found in
    ((points, outlines),) = shapes.goals(problem.goal, 3, 8, [v.axes for v in views_of(3)])
    assert points == list(range(8))
    assert [area(o) for o in outlines] == pytest.approx([1.4**2, 1.4, 1.4])
    own = {"front_left": box([0, 0], [1, 1]), "rear_left": box([0, 0], [2, 1])}
    found = shapes.goals(goal_of_points(CAR, own), 2, 4)
    assert [(points, area(outline)) for points, (outline,) in found] == [([0], 1.0), ([3], 2.0)]


def test_rows_that_link_coordinates_are_not_left_out():
    """|x| <= 1, y <= z, z <= x / 2, y >= -1: the rows of z bound y."""
    A = [[1, 0, 0], [-1, 0, 0], [0, 1, -1], [-0.5, 0, 1], [0, -1, 0], [0, 0, -1]]
    poly = hpolytope(A, [1, 1, 0, 0, 1, 5])
    part, at = shapes.linked(poly, (0, 1))
    assert part.n == 3 and at == [0, 1]
    assert area(shapes.shadow(poly)) == pytest.approx(2.0)
    loose = from_box(box([0, 0, 0, 0], [1, 2, 3, 4]))
    part, at = shapes.linked(loose, (3, 1))
    assert part.n == 2 and at == [1, 0] and len(part.b) == 4
