"""Maps of cells: in exact arithmetic every cell that is not known to be free is covered."""

from fractions import Fraction

import numpy as np
import pytest
from exact_cover import left_over
from needs import need

from parc_jax.common.errors import InputError
from parc_jax.problem.world.grid_map import GridMap, occupancy_grid

need("shapely")
import shapely  # noqa: E402

pytestmark = pytest.mark.soundness
TURN = (Fraction(3, 5), Fraction(4, 5))  # cosine and sine of an angle that floats only nearly have


def squares(grid: GridMap, turn=(Fraction(1), Fraction(0))):
    """(row, column), free or not, and the exact corners of every cell and of a frame around."""
    x, y, r = (Fraction(v) for v in (*grid.origin[:2], grid.resolution))
    c, s = turn
    rows, columns = grid.free.shape
    for i in range(-1, rows + 1):
        for j in range(-1, columns + 1):
            inside = 0 <= i < rows and 0 <= j < columns
            ends = [(j, i), (j + 1, i), (j + 1, i + 1), (j, i + 1)]
            corners = [(x + r * (c * u - s * v), y + r * (s * u + c * v)) for u, v in ends]
            yield (i, j), bool(inside and grid.free[i, j]), corners


def a_map(rng, shape=(9, 13), origin=(-3.1, 7.7, 0.0)) -> GridMap:
    data = rng.choice([0, 0, 0, 10, 50, 100, -1], shape)
    data[3:7, 2:9] = 100
    return occupancy_grid(data.astype(np.int8), 0.05, origin)


@pytest.mark.parametrize(
    "turn", [pytest.param(None, marks=pytest.mark.slow), TURN], ids=["straight", "turned"]
)
def test_all_that_is_not_free_is_covered_exactly(turn, rng):
    yaw = 0.0 if turn is None else float(np.arctan2(4, 3))
    grid = a_map(rng, origin=(-3.1, 7.7, yaw))
    pieces = grid.obstacles()
    for _, free, corners in squares(grid, turn or (Fraction(1), Fraction(0))):
        middle = np.array([[float(x) for x in c] for c in corners]).mean(axis=0)
        if free:
            assert not any(piece.contains(middle) for piece in pieces)
        else:
            held = [bool(piece.contains(middle)) for piece in pieces]
            near = [piece for piece, here in zip(pieces, held, strict=True) if here]
            far = [piece for piece, here in zip(pieces, held, strict=True) if not here]
            assert left_over([corners], near) == []
            assert left_over([corners], far)


def test_free_space_is_the_free_cells(rng):
    for origin in ((-3.1, 7.7, 0.0), (1.0, 2.0, 0.7)):
        grid = a_map(rng, origin=origin)
        region = grid.free_space().region
        assert region.area == pytest.approx(grid.free.sum() * 0.05**2)
        for piece in grid.obstacles():
            assert not piece.contains(np.array(region.representative_point().coords[0]))


def test_near_a_place_the_frame_comes_along():
    wide = occupancy_grid(np.zeros((100, 100), np.int8), 0.1, (0.0, 0.0, 0.3))
    pieces = wide.obstacles((2.0, 5.0), 1.0)
    assert len(pieces) == 4
    turns = np.linspace(0, 2 * np.pi, 40)
    ring = np.array([2.0, 5.0]) + 0.99 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    assert not any(piece.contains(q) for piece in pieces for q in ring)
    free = wide.free_space((2.0, 5.0), 1.0).region
    assert free.contains(shapely.Point(2.0, 5.0).buffer(0.99)) and free.area < 5.0


@pytest.mark.parametrize(
    ("data", "options", "sentence"),
    [
        (np.full((3, 3), np.nan), {}, "whole numbers .*; got float64"),
        (np.zeros(9, np.int8), {}, r"of shape \(9,\)"),
        (np.full((3, 3), 254), {}, "254 is one of an inflated costmap"),
        (np.array([[0, 40, 99, 100]]), {}, "99 is one of an inflated costmap"),
        (np.full((3, 3), 300), {}, "expected values -1 ... 100; got 300"),
        (np.zeros((3, 3), int), {"resolution": 0.0}, "resolution > 0"),
        (np.zeros((3, 3), int), {"resolution": np.nan}, "resolution"),
        (np.zeros((3, 3), int), {"origin": (0, 0)}, "origin"),
        (np.zeros((3, 3), int), {"origin": (1e6, 0, 0)}, "within 100000 m"),
        (np.zeros((3, 3), int), {"free_thresh": 1.5}, r"free_thresh in \[0, 1\]"),
        (np.zeros((0, 3), int), {}, "rows of cells"),
    ],
)
def test_what_is_no_map_is_refused_in_one_sentence(data, options, sentence):
    with pytest.raises(InputError, match=sentence):
        occupancy_grid(data, **{"resolution": 0.05} | options)


def test_99_may_be_declared_a_probability_and_255_is_unknown():
    data = np.array([[0, 40, 99, 100]])
    assert occupancy_grid(data, 0.1, inflated=False).free.tolist() == [[True, False, False, False]]
    unsigned = np.array([[0, 255, 19, 20]], np.uint8)
    assert occupancy_grid(unsigned, 0.1).free.tolist() == [[True, False, True, False]]


def test_a_place_off_the_map_is_refused(rng):
    with pytest.raises(InputError, match="expected a place on the map"):
        a_map(rng).obstacles((0.0, 0.0), 1.0)
    with pytest.raises(InputError, match="or neither"):
        a_map(rng).obstacles((0.0, 0.0))
