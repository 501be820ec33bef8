"""Samplers: inside, uniform by moments and by counts, and independent of their neighbours in a
batch.
"""

import jax
import numpy as np
import pytest
from random_polytopes import round_polytope

from benchmarks.neuralparc.sets.sampling import (
    sample_polytope,
    sample_polytopes,
    simplex_volumes,
    triangulate,
)
from benchmarks.neuralparc.sets.vertices import vertices
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.extent import chebyshev_center
from parc_jax.common.sets.hpolytope import from_box

COUNT = 4000


def assert_uniform(p, points):
    """The mean agrees with the centroid of a triangulation to 5 sigma."""
    simplices = triangulate(vertices(p))
    share = simplex_volumes(simplices) / simplex_volumes(simplices).sum()
    centroid = share @ simplices.mean(axis=1)
    deviation = points.std(axis=0) / np.sqrt(len(points))
    assert (np.abs(points.mean(axis=0) - centroid) < 5 * deviation).all()


def test_hit_and_run_is_inside_and_uniform_for_every_polytope_of_a_batch(rng):
    many = [round_polytope(rng, 3, 6) for _ in range(3)]
    A, b = np.stack([p.A for p in many]), np.stack([p.b for p in many])
    start = np.stack([chebyshev_center(p).center for p in many])
    keys = jax.random.split(jax.random.key(3), 3)
    points = sample_polytopes(keys, A, b, start, COUNT, 12)
    for p, found in zip(many, points, strict=True):
        assert p.contains(found).all()
        assert_uniform(p, found)
    b[1] += 0.5
    other = sample_polytopes(keys, A, b, start, COUNT, 12)
    np.testing.assert_array_equal(points[[0, 2]], other[[0, 2]])
    assert not (points[1] == other[1]).all()


def test_flat_sets_are_refused():
    with pytest.raises(InputError, match="with interior"):
        sample_polytope(jax.random.key(0), from_box(box([0.0, 0.0], [1.0, 0.0])), 3)
