"""Maps of cells: no cell is free that is not known to be."""

import numpy as np
import pytest
from needs import need

from parc_jax.common.errors import InputError
from parc_jax.problem.world.grid_map import GridMap, occupancy_grid

need("shapely")
import shapely  # noqa: E402

pytestmark = pytest.mark.soundness


def a_map(rng, shape=(9, 13), origin=(-3.1, 7.7, 0.0)) -> GridMap:
    data = rng.choice([0, 0, 0, 10, 50, 100, -1], shape)
    data[3:7, 2:9] = 100
    return occupancy_grid(data.astype(np.int8), 0.05, origin)


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_free_space_is_the_free_cells(yaw, rng):
    grid = a_map(rng, origin=(-3.1, 7.7, yaw))
    region = grid.free_space().region
    assert region.area == pytest.approx(grid.free.sum() * 0.05**2)
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    for (row, column), free in np.ndenumerate(grid.free):
        middle = 0.05 * np.array([column + 0.5, row + 0.5]) @ turn + grid.origin[:2]
        assert region.contains(shapely.Point(middle)) == free


def test_near_a_place_nothing_is_known_beyond():
    wide = occupancy_grid(np.zeros((100, 100), np.int8), 0.1, (0.0, 0.0, 0.3))
    pieces = wide.free_space((2.0, 5.0), 1.0).obstacles()
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
        (np.zeros((3, 3), int), {"origin": (0, 0, 90.0)}, "origin's yaw: .*got 90. Is it in deg"),
        (np.zeros((0, 3), int), {}, "rows of cells"),
        # a wall of ones would be occupied with 1 %
        (np.array([[0, 1, 0]]), {}, "expected percent, .*the largest number is 1"),
        (np.array([[0, 1, -1]]), {}, "Multiply a mask of 0 and 1 by 100"),
        (np.ma.array(np.zeros((2, 2), int), mask=[[1, 0], [0, 0]]), {}, "some of them masked"),
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
        a_map(rng).free_space((0.0, 0.0), 1.0)
    with pytest.raises(InputError, match="or neither"):
        a_map(rng).free_space((0.0, 0.0))
    with pytest.raises(InputError, match="map reach: expected numbers"):
        a_map(rng).free_space((0.0, 0.0), "a")
