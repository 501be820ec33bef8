"""The worlds of the BARN challenge, as published: counts, places, measure, contact, and cells as
rectangles, which hold all cylinders in exact arithmetic.
"""

from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from needs import need

from sims import barn
from sims.barn.rectangles import GROW, rectangles
from sims.barn.worlds import CELL, RADIUS

SOME = barn.numbers()[::20]
BOX = (0.458, 0.416)  # [m] length and width of a robot


def test_two_hundred_worlds_with_as_many_cylinders_as_published():
    counts = [len(barn.world(number).cylinders) for number in barn.numbers()]
    assert len(counts) == 200 and len(set(barn.numbers())) == 200
    assert (min(counts), np.median(counts), max(counts)) == (181, 260, 365)


def test_the_measure_is_the_challenges():
    # optimal time 5 s: full marks up to 10 s, then their share, never less than an eighth
    assert barn.metric(True, 4.0, 10.0) == barn.metric(True, 10.0, 10.0) == 0.5
    assert barn.metric(True, 20.0, 10.0) == 0.25
    assert barn.metric(True, 90.0, 10.0) == 0.125
    assert barn.metric(False, 4.0, 10.0) == 0.0


def test_distances_against_points_on_the_outline():
    """The nearest of many points on the rectangle's outline is as near as said."""
    draw = np.random.default_rng(3)
    cylinders = draw.uniform(-1.5, 1.5, (40, 2))
    poses = np.column_stack([draw.uniform(-1, 1, (30, 2)), draw.uniform(-4, 4, 30)])
    side = np.linspace(-0.5, 0.5, 400)
    edge = np.full_like(side, 0.5)
    around = np.concatenate(
        [np.stack(p, 1) for p in ((side, edge), (side, -edge), (edge, side), (-edge, side))]
    )
    said = barn.distance_to_cylinders(poses, BOX, cylinders, 0.075)
    for pose, clear in zip(poses, said, strict=True):
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        outline = pose[:2] + around * BOX @ np.array([[cos, sin], [-sin, cos]])
        apart = np.linalg.norm(outline[:, None] - cylinders[None], axis=-1)
        if clear > -0.075:  # no middle inside
            assert apart.min() - 0.075 == pytest.approx(clear, abs=1e-3)
    assert (said < 0).any() and (said > 0).any()
    assert barn.distance_to_cylinders(poses, BOX, cylinders[:0], 0.075).tolist() == [np.inf] * 30


def exactly_held(cylinders, boxes) -> bool:
    """Does each cylinder lie in one rectangle, in exact arithmetic?"""
    radius = Fraction(RADIUS)
    boxes = [tuple(map(Fraction, row)) for row in boxes.tolist()]
    for x, y in cylinders.tolist():
        x, y = Fraction(x), Fraction(y)
        held = any(
            x0 <= x - radius and x + radius <= x1 and y0 <= y - radius and y + radius <= y1
            for x0, y0, x1, y1 in boxes
        )
        if not held:
            return False
    return True


@pytest.mark.parametrize("number", SOME[:4])
def test_rectangles_hold_every_cylinder_and_no_free_cell(number):
    world = barn.world(number)
    boxes = rectangles(world.occupied)
    assert exactly_held(world.cylinders, boxes)
    assert not exactly_held(world.cylinders, boxes[:-1])
    assert len(boxes) <= len(world.cylinders) / 2
    # back on the grid: whole cells, all of them occupied, and together all that are
    cells = np.round((boxes + np.array([1, 1, -1, -1]) * GROW) / CELL).astype(int)
    filled = np.zeros_like(world.occupied)
    for x0, y0, x1, y1 in cells.tolist():
        assert world.occupied[-x1:-x0, y0:y1].all()
        filled[-x1:-x0, y0:y1] = True
    np.testing.assert_array_equal(filled, world.occupied)


@pytest.mark.parametrize("number", SOME[:4])
def test_the_map_has_every_cylinder_and_nothing_stands_where_it_is_free(number):
    need("shapely")
    import shapely

    from sims.barn.sight import Mapped

    world = barn.world(number)
    look = Mapped(world, SimpleNamespace(pose=world.start)).look()
    assert exactly_held(world.cylinders, np.array([[*box.lo, *box.hi] for box in look.obstacles]))
    stands = shapely.buffer(shapely.points(world.cylinders), world.radius)
    assert not look.why and not shapely.intersects(look.free.region, stands).any()
    assert shapely.contains_xy(look.free.region, [world.start[:2], world.goal]).all()
    apart = np.linalg.norm(look.hits[:, None] - world.cylinders, axis=-1)
    assert (apart.min(axis=0) <= 3 * world.radius).mean() > 0.9  # guidance knows of nearly all
    assert apart.min(axis=1).max() <= 2 * world.radius  # and of nothing else
