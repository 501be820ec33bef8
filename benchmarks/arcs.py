"""Robots of any number of parameters, networks of any width, horizons of any length: what cost
grows with.

The first two parameters say where the robot goes; all of them bend the path on its way, through a
random network whose outputs are smooth over time. Nothing is learned: the network is the robot, and
the tube is declared.
"""

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.learning.bound.declared import declared_claim
from parc_jax.learning.bound.tube import tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.system import time_grid
from parc_jax.problem.problem import Problem, reach_avoid

WAVES = 4  # half waves over time, along which hidden neurons bend a path
BEND = 0.6  # [m] how far they do, about
WIDTH = 0.05  # [m] of the tube at the end of the first bin


def bending_arcs(
    n_k: int,
    hidden: tuple[int, ...] = (64, 64),
    n_steps: int = 50,
    bins: tuple[int, ...] = (),
    seed: int = 0,
) -> TrajectoryModel:
    """The model: K = [-1, 1]^n_k, one second, the last state is the heading along the chord.

    bins: of the tube along the first axes of K, 1 along the others.
    """
    rng = np.random.default_rng(seed)
    weights, biases = [], []
    # two layers of pairs of neurons carry k_0 and k_1 through, max(x, 0) and max(-x, 0)
    width = n_k
    for layer, n in enumerate(hidden):
        W = rng.normal(size=(n, width)) * np.sqrt(2 / width)
        W[:4] = 0.0
        if layer == 0:
            W[[0, 1, 2, 3], [0, 0, 1, 1]] = 1.0, -1.0, 1.0, -1.0
        else:
            W[np.arange(4), np.arange(4)] = 1.0
        b = 0.5 * rng.normal(size=n)
        b[:4] = 0.0
        weights.append(W)
        biases.append(b)
        width = n
    s = np.arange(1, n_steps + 1) / n_steps
    waves = np.sin(np.pi * np.arange(1, WAVES + 1) * s[:, None]) / np.arange(1, WAVES + 1)
    bend = rng.normal(size=(2, WAVES, width)) * BEND / np.sqrt(width)
    bend[:, :, :4] = 0.0
    paths = np.einsum("tw,awn->tan", waves, bend)
    paths[:, 0, 0], paths[:, 0, 1] = 2.0 * s, -2.0 * s
    paths[:, 1, 2], paths[:, 1, 3] = 2.0 * s, -2.0 * s
    at_zero = np.stack([6.0 * s, 0.0 * s], axis=1)
    last = np.concatenate([paths.reshape(-1, width), np.zeros((1, width))])
    last[-1, 2:4] = 0.3, -0.3
    net = relu_network([*weights, last], [*biases, np.append(at_zero.ravel(), 0.0)])
    counts = (*bins, *[1] * (n_k - len(bins)))
    edges = [np.linspace(-1.0, 1.0, n + 1) for n in counts]
    wider = 1 + 0.1 * np.arange(np.prod(counts)) / np.prod(counts)
    grows = WIDTH * (0.2 + 0.8 * s)[:, None] * np.ones(2)
    end = np.array([WIDTH, WIDTH, 0.02])
    widths = tube(edges, wider[:, None, None] * grows, wider[:, None] * end)
    time = time_grid(1.0 / n_steps, 1.0)
    claim = declared_claim(widths, "the network is the robot", net, time, system="bending arcs")
    return trajectory_model(net, claim)


def between_blocks(gap: float = 1.6, more: int = 0) -> Problem:
    """To the right through a gap [m] between two blocks, for a disc of 0.3 m. more: further blocks
    of 0.6 m on both sides of the way, near enough to matter.
    """
    goal = box([7.5, -0.8, -1.0], [8.5, 0.8, 1.0])
    blocks = [
        box([4.0, gap / 2], [5.0, gap / 2 + 3.0]),
        box([4.0, -gap / 2 - 3.0], [5.0, -gap / 2]),
    ]
    rng = np.random.default_rng(1)
    for i in range(more):
        side = 1.0 if i % 2 else -1.0
        corner = np.array([rng.uniform(0.0, 6.5), side * rng.uniform(1.6, 3.0) - 0.3])
        blocks.append(box(corner, corner + 0.6))
    return reach_avoid(goal, blocks, 0.3)
