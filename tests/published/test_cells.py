"""Regions cut by bins: they tile the domain, keep the map, and come outward from the seed."""

import jax
import numpy as np
import pytest
from gap_model import HI, LO, arc_tube, gap_table

from parc_jax.common.errors import InputError
from parc_jax.neuralparc.cells import breadth_first, cells_outward, stack
from parc_jax.neuralparc.sets.volume import volume

TABLE = gap_table(4)


def all_cells(bins):
    return [
        p
        for region in cells_outward(TABLE, arc_tube(4, bins), np.array([5.0, 0.0]))
        for p in region
    ]


@pytest.mark.parametrize("bins", [(1, 1), (3, 2)])
def test_cells_tile_the_domain_and_carry_their_map(rng, bins):
    cells, tube = all_cells(bins), arc_tube(4, bins)
    total = sum(volume(p.vertices) for p in cells)
    assert abs(total - np.prod(HI - LO)) < 1e-8
    k = rng.uniform(LO, HI, (300, 2))
    hits = np.zeros(300, int)
    outputs = np.asarray(jax.jit(jax.vmap(TABLE.net))(k))
    for p in cells:
        inside = (k @ p.A.T < p.b).all(axis=1)
        hits += inside
        assert (tube.bin_of(k[inside]) == p.bin).all() and (
            TABLE.locate(k[inside]) == p.region
        ).all()
        for q, out in zip(k[inside][:3], outputs[inside], strict=False):
            np.testing.assert_allclose(p.C @ q + p.d, out, atol=1e-12)
        assert (
            (p.vertices >= p.lo - 2 * p.slip) & (p.vertices <= p.hi + 2 * p.slip)
        ).all() and p.slip.max() < 1e-10
    assert (hits == 1).all()
    assert len(cells) == TABLE.count if bins == (1, 1) else len(cells) > TABLE.count


def test_regions_come_outward_from_the_seed():
    seed = np.array([4.3, 0.3])
    order = [region[0].region for region in cells_outward(TABLE, arc_tube(4), seed)]
    assert order[0] == TABLE.locate(seed) and sorted(order) == list(range(TABLE.count))
    seen = {int(order[0])}
    for number in order[1:]:  # each one borders on one visited before
        mine = TABLE.neighbours[TABLE.facet_offsets[number] : TABLE.facet_offsets[number + 1]]
        assert seen & set(mine.tolist())
        seen.add(int(number))
    with pytest.raises(InputError, match="inside the domain"):
        next(cells_outward(TABLE, arc_tube(4), np.array([9.0, 0.0])))


def test_breadth_first_leaves_unreachable_items_alone():
    neighbours, offsets = np.array([1, 0, 2, 1, -1, 4, 3]), np.array([0, 1, 3, 5, 6, 7])
    assert list(breadth_first(neighbours, offsets, 0)) == [0, 1, 2]
    assert list(breadth_first(neighbours, offsets, 4)) == [4, 3]


def test_stacking_pads_without_changing_the_sets(rng):
    cells = all_cells((2, 1))
    stacked = stack(cells)
    k = rng.uniform(LO, HI, (50, 2))
    for i, p in enumerate(cells):
        np.testing.assert_array_equal(
            (k @ stacked.A[i].T <= stacked.b[i]).all(axis=1), (k @ p.A.T <= p.b).all(axis=1)
        )
        np.testing.assert_array_equal(
            np.unique(stacked.vertices[i], axis=0), np.unique(p.vertices, axis=0)
        )
        assert stacked.region[i] == p.region and stacked.bin[i] == p.bin
