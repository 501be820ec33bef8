"""Toy robots with several reference points: a bar or a box that moves and turns with k, in the
plane and in space, and scenes for them.
"""

import numpy as np
from toy_models import assumed

from parc_jax.common.sets.box import box
from parc_jax.learning.bound.error_set import DIRECTION_BITS, Faces, faces, short
from parc_jax.learning.bound.tube import fitted_tube, tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.body import Disc, Part, body_of, hull
from parc_jax.problem.problem import ReachAvoid, goal_of_points, reach_avoid

HIDDEN = (7, 6)


def points_model(
    rng,
    n_p: int = 2,
    m: int = 4,
    T: int = 4,
    bins=(2, 1),
    size: float = 0.02,
    n_q: int = 1,
    fitted: bool = False,
    around_zero: bool = False,
) -> TrajectoryModel:
    """m points about a random path over K = [-1, 1]^2 that ends about (2, ...), each with an offset
    that moves with k; the first is the reference. One random tube per bin, of boxes or between
    faces (fitted).
    """
    n_c = m * n_p
    path = np.linspace(0, 2, T + 1)[:, None, None] * np.ones(n_p)
    spread = rng.uniform(-0.3, 0.3, (m, n_p))
    spread[0] = 0
    at_zero = (path + spread).ravel()[n_p:]
    widths = [2, *HIDDEN]
    weights = [
        rng.normal(size=(n, w)) * np.sqrt(2 / w) for w, n in zip(widths, HIDDEN, strict=False)
    ]
    biases = [0.5 * rng.normal(size=n) for n in HIDDEN]
    grow = np.linspace(0, 1, T + 1)[:, None, None, None]
    moves = grow * rng.normal(size=(n_p, HIDDEN[-1])) * 0.3
    turns = (0.3 + grow) * rng.normal(size=(m, n_p, HIDDEN[-1])) * 0.08
    turns[:, 0] = 0
    last = (moves + turns).reshape(-1, HIDDEN[-1])[n_p:]
    last = np.concatenate([last, 0.2 * rng.normal(size=(n_q, HIDDEN[-1]))])
    net = relu_network([*weights, last], [*biases, np.concatenate([at_zero, np.zeros(n_q)])])
    n_bins = int(np.prod(bins))
    edges = [np.linspace(-1, 1, n + 1) for n in bins]
    during, at_end = (n_bins, T, n_c), (n_bins, n_c + n_q)
    if fitted:
        errors = fitted_tube(
            edges,
            random_faces(rng, (n_bins, T, m), n_p, size, around_zero),
            random_faces(rng, (n_bins,), n_c + n_q, size, around_zero, frames=True),
        )
    else:
        errors = tube(edges, rng.uniform(0, 2 * size, during), rng.uniform(0, 2 * size, at_end), m)
    return trajectory_model(net, assumed(net, errors, points=tuple(f"c{i}" for i in range(m))))


def random_faces(
    rng, lead: tuple[int, ...], n: int, size: float, around_zero: bool, frames: bool = False
) -> Faces:
    """Faces along the axes and along n directions more, about errors that are not about zero.
    around_zero: but hold it.
    """
    slanted = short(rng.normal(size=(*lead, n, n)), DIRECTION_BITS)
    directions = np.concatenate([np.broadcast_to(np.eye(n), slanted.shape), slanted], axis=-2)
    half = rng.uniform(0.3, 2, directions.shape[:-1]) * size
    middle = size * rng.uniform(-0.3, 0.3, (*lead, n))
    centre = (directions * middle[..., None, :]).sum(axis=-1)
    if around_zero:
        half = np.maximum(half, 1.1 * np.abs(centre))
    return faces(directions, centre, half, frames)


def points_problem(rng, model: TrajectoryModel, n_obstacles: int = 2, radius=0.05) -> ReachAvoid:
    """Two parts (the first half of the points as a hull, the last two grown by a disc) among boxes
    about the way, to a goal of the first point alone.
    """
    n_p, m = model.n_p, model.n_points
    half = max(1, m // 2)
    parts = [hull(*model.points[:half]), Part(model.points[-2:], Disc(radius))]
    lo, hi = np.full(n_p, -0.6), np.full(n_p, 0.6)
    goal = goal_of_points(
        model.points, {model.points[0]: box(lo, hi)}, box([-9.0] * model.n_q, [9.0] * model.n_q)
    )
    obstacles = []
    for _ in range(n_obstacles):
        middle = rng.uniform(-1.6, -0.4, n_p) + rng.choice([-1, 1], n_p) * rng.uniform(
            0.3, 0.7, n_p
        )
        size = rng.uniform(0.1, 0.3, n_p)
        obstacles.append(box(middle - size, middle + size))
    return reach_avoid(goal, obstacles, body_of(parts))
