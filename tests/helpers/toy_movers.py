"""A model of movers, declared."""

import numpy as np

import parc_jax as pj
from parc_jax.learning.bound.tube import tube

GRID = pj.learning.time_grid(0.1, 1.2, 0.05)


def straight(wide: float = 0.05) -> pj.types.TrajectoryModel:
    """Movers that go straight on, off by at most so many metres, whatever they did before."""
    ahead = np.outer(0.1 * np.arange(1, 13), [1.0, 0.0]).reshape(-1, 1)
    net = pj.learning.relu_network([np.hstack([ahead, 0 * ahead])], [np.zeros(24)])
    K = [[0.0, 2.0], [-3.15, 3.15]]
    held = tube(K, np.full((1, 12, 2), wide), np.full((1, 2), wide))
    named = {
        "k": ("speed over 0.1 s [m/s]", "turned in 0.1 s [rad]"),
        "p": ("ahead [m]", "left [m]"),
    }
    claim = pj.learning.declared_claim(held, "this test declares it", net, GRID, labels=named)
    return pj.learning.trajectory_model(net, claim)
