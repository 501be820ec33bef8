"""Where points can be at all: bounds that hold for every plan, in one box as in many."""

import numpy as np
import pytest
from toy_models import random_model

from parc_jax.learning.network import rounding
from parc_jax.learning.network.predict import trajectories
from parc_jax.safe_set.separation import pruning


@pytest.mark.parametrize("boxes", [1, 64])
@pytest.mark.parametrize("seed", range(3))
def test_the_ways_of_all_plans_are_within_their_bounds(boxes, seed, monkeypatch):
    monkeypatch.setattr(pruning, "BOXES", boxes)
    rng = np.random.default_rng(seed)
    model = random_model(rng, bins=(1, 1))
    lo, hi = pruning.ways_of(model)
    k = rng.uniform(model.domain.lo, model.domain.hi, (5000, model.n_k))
    offsets, _ = trajectories(model.net, model.layout, k)
    places = offsets - offsets[:, -1:]
    assert (lo - 1e-12 <= places).all() and (places <= hi + 1e-12).all()


def test_bounds_of_an_affine_map_are_attained(rng):
    """No wider than needed, and no narrower: each is met at a corner of the box."""
    W, b = rng.normal(size=(5, 3)), rng.normal(size=5)
    lo = rng.normal(size=(4, 3))
    hi = lo + rng.uniform(0.1, 1, (4, 3))
    corners = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    at = (lo[:, None] + corners * (hi - lo)[:, None]) @ W.T + b
    least, most = rounding._affine(W, b, lo, hi)
    np.testing.assert_allclose(least, at.min(axis=1), atol=1e-12)
    np.testing.assert_allclose(most, at.max(axis=1), atol=1e-12)
