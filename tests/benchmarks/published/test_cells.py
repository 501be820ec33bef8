"""Regions cut by bins: they tile the domain, keep the map, and come outward from the seed."""

import jax
import numpy as np
import pytest
from gap_model import HI, LO, arc_tube, gap_table

from benchmarks.neuralparc.cells import cells_outward
from benchmarks.neuralparc.sets.sampling import volume

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
