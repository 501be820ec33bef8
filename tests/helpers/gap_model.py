"""A small trajectory model with a gap to drive through: random ReLU features, last layer fitted to
curved arcs.
"""

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.learning.bound.tube import tube
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.regions.subdivide import enumerate_regions

LO, HI = np.array([4.0, -0.4]), np.array([6.0, 0.4])  # k = speed [m/s], final heading [rad]


def arcs(k, T):
    """Offsets c_1 ... c_T (m) of arcs of one second, time-major, then the final heading: (N, 2T +
    1).
    """
    s = np.arange(1, T + 1) / T
    heading = k[:, 1:] * s
    path = (
        k[:, :1, None] * s[None, :, None] * np.stack([np.cos(heading), np.sin(heading) * s], axis=2)
    )
    return np.concatenate([path.reshape(len(k), -1), k[:, 1:]], axis=1)


def arc_network(T=6, hidden=(6, 5), seed=0):
    """A ReLU network near `arcs`: random hidden layers, least-squares output layer."""
    rng = np.random.default_rng(seed)
    k = rng.uniform(LO, HI, (2000, 2))
    weights, biases, x = [], [], (k - LO) / (HI - LO)
    scale, shift = np.diag(1 / (HI - LO)), -LO / (HI - LO)
    for width in hidden:
        W, b = rng.normal(size=(width, x.shape[1])), 0.3 * rng.normal(size=width)
        x = np.maximum(x @ W.T + b, 0)
        weights.append(W)
        biases.append(b)
    solution = np.linalg.lstsq(np.c_[x, np.ones(len(x))], arcs(k, T), rcond=None)[0]
    weights.append(solution[:-1].T)
    biases.append(solution[-1])
    biases[0], weights[0] = biases[0] + weights[0] @ shift, weights[0] @ scale
    return relu_network(weights, biases)


def arc_tube(T=6, bins=(1, 1), size=0.02):
    """A tube whose width differs between bins, intervals and axes."""
    n_bins = bins[0] * bins[1]
    edges = [np.linspace(LO[i], HI[i], bins[i] + 1) for i in range(2)]
    grow = 1 + 0.1 * np.arange(n_bins)
    interval = (
        size
        * grow[:, None, None]
        * (0.5 + np.arange(1, T + 1)[None, :, None] / T)
        * np.array([1.0, 0.7])
    )
    return tube(edges, interval, size * grow[:, None] * np.array([1.0, 1.0, 0.5]))


def gap_problem(gap=1.6, start=None):
    """Goal near (10, 0) with heading within 0.25 rad; two blocks at x = 8 leave a gap [m] about y =
    0; disc body.
    """
    goal = box([9.5, -0.5, -0.25], [10.5, 0.5, 0.25])
    blocks = [box([7.5, gap / 2], [8.5, gap / 2 + 2]), box([7.5, -gap / 2 - 2], [8.5, -gap / 2])]
    return reach_avoid(goal, blocks, 0.3, start)


def gap_table(T=6, hidden=(6, 5)):
    """All regions of the arc network."""
    return enumerate_regions(arc_network(T, hidden), box(LO, HI))
