"""The yardstick of the comparison with peers: exact ranges over boxes, and rows that refuse bounds
that are wrong.
"""

import numpy as np
import pytest
from toy_models import toy_case

from benchmarks.peers.__main__ import boxes, exact, rows


def test_ranges_hold_all_samples_and_are_attained(rng):
    model, _ = toy_case(4)
    lo, hi = boxes(model, 3)
    whole = np.prod(model.domain.hi - model.domain.lo)
    assert len(lo) == 3**model.n_k and np.prod(hi - lo, axis=1).sum() == pytest.approx(whole)
    below, above = exact(model, lo, hi)
    for i in range(len(lo)):
        k = rng.uniform(lo[i], hi[i], (4000, model.n_k))
        for W, b in zip(model.net.weights[:-1], model.net.biases[:-1], strict=True):
            k = np.maximum(k @ W.T + b, 0)
        y = k @ model.net.weights[-1].T + model.net.biases[-1]
        assert (y.min(axis=0) >= below[i] - 1e-9).all() and (y.max(axis=0) <= above[i] + 1e-9).all()
        assert (np.ptp(y, axis=0) >= 0.8 * (above[i] - below[i])).all()


def test_a_peer_whose_bounds_are_too_small_is_refused():
    width = np.ones((2, 3))
    right = {"name0": "ours", "lower0": -width, "upper0": width, "cold0": 1.0, "warm0": [1.0]}
    wide = right | {"lower0": -2 * width}
    assert [row["width"] for row in rows([right, wide])] == [1.0, 1.5]
    with pytest.raises(SystemExit, match="inside of what the network attains"):
        rows([right, right | {"upper0": 0.9 * width}])
