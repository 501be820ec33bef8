"""Robots with a shape: a car that turns in the plane, with a trailer's part behind it, and a box
that turns and climbs in space; networks by interpolation, no training.
"""

import itertools
from types import SimpleNamespace

import numpy as np
from toy_models import assumed

from parc_jax.common.sets.box import box
from parc_jax.learning.bound.tube import tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.problem.body import Disc, Part, body_of, hull
from parc_jax.problem.problem import Problem, goal_of_points, reach_avoid
from parc_jax.problem.robust.nominal import NominalProblem

T = 8
NODES = np.linspace(-1.0, 1.0, 9)  # of k_1, between which the networks are straight
CAR = ("front_left", "front_right", "rear_right", "rear_left")
CAR_AT = np.array([[0.4, 0.2], [0.4, -0.2], [-0.4, -0.2], [-0.4, 0.2]])
DRONE = tuple(f"corner{i}" for i in range(8))
DRONE_AT = np.array(list(itertools.product([-0.3, 0.3], [-0.2, 0.2], [-0.1, 0.1])))


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    """Points (m, n) turned about the upright axis by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    out = points.copy()
    out[:, :2] = points[:, :2] @ np.array([[c, s], [-s, c]])
    return out


def straight_between(outputs, n_k: int, tail) -> ReLUNetwork:
    """The network k -> outputs(k_1) (n_out,), straight between NODES, plus tail (n_out, n_k) k."""
    values = np.array([outputs(node) for node in NODES])
    slopes = np.diff(values, axis=0) / np.diff(NODES)[:, None]
    bends = np.concatenate([slopes[:1], np.diff(slopes, axis=0)])
    along = np.eye(n_k)
    hidden = np.concatenate([np.tile(along[1], (len(bends), 1)), along])
    shift = np.concatenate([-NODES[: len(bends)], np.ones(n_k)])  # k > -1: these are always on
    last = np.concatenate([bends.T, tail], axis=1)
    return relu_network([hidden, last], [shift, values[0] - tail.sum(axis=1)])


def model_of_points(at: np.ndarray, points, travel, e: float) -> TrajectoryModel:
    """A robot that moves by (t / T) (travel + k along the axes but the second) and turns by (t / T)
    k_1; q is its heading. All widths e.
    """
    n_points, n_p = at.shape
    n_k = n_p
    share = np.arange(T + 1) / T

    def outputs(turn):
        poses = np.array([turned(at, s * turn) + s * np.asarray(travel) - at[0] for s in share])
        return np.append(poses.ravel()[n_p:], turn)

    moves = np.diag([1.0, 0.0, 1.0][:n_p])
    tail = np.kron(share[:, None], np.tile(moves, (n_points, 1)))[n_p:]
    tail = np.concatenate([tail, np.zeros((1, n_k))])
    n_c = n_points * n_p
    edges = [[-1.0, 1.0]] * n_k
    widths = tube(edges, np.full((1, T, n_c), e), np.full((1, n_c + 1), e), n_points)
    net = straight_between(outputs, n_k, tail)
    return trajectory_model(net, assumed(net, widths, points=points))


def car(e: float = 0.01, parts: int = 1) -> tuple[TrajectoryModel, Problem]:
    """A car of 0.8 m by 0.4 m that turns into the gap between two walls, and the scene: all of it
    is to end in the goal. Two parts: its body, and a bumper between the front corners.
    """
    model = model_of_points(CAR_AT, CAR, [2.0, 0.0], e)
    body = hull(*CAR)
    if parts == 2:
        body = body_of([*body.parts, Part(CAR[:2], Disc(0.05))])
    goal = goal_of_points(CAR, box([-0.7, -0.7], [0.7, 0.7]), box([-1.0], [1.0]))
    walls = [box([-1.2, 0.35], [-0.6, 0.9]), box([-1.2, -0.9], [-0.6, -0.35])]
    return model, reach_avoid(goal, walls, body, spans=[None, (0, 5)])


def drone(e: float = 0.01) -> tuple[TrajectoryModel, Problem]:
    """A box of 0.6 m by 0.4 m by 0.2 m that flies between a wall and a beam, and the scene."""
    model = model_of_points(DRONE_AT, DRONE, [2.0, 0.0, 0.5], e)
    goal = goal_of_points(DRONE, box([-0.7, -0.7, -0.5], [0.7, 0.7, 0.5]), box([-1.0], [1.0]))
    blocks = [box([-1.2, -0.9, -0.9], [-0.8, 0.9, -0.4]), box([-1.0, -0.9, 0.3], [-0.7, 0.9, 0.5])]
    return model, reach_avoid(goal, blocks, hull(*DRONE, radius=0.02))


def bare_answer(model: TrajectoryModel, problem: Problem, plans) -> SimpleNamespace:
    """What pictures of plans (n, n_p + n_k) read of an Answer, without any proof."""
    scene = SimpleNamespace(nominal=NominalProblem(problem, model), at=None, box_of_k="K")
    return SimpleNamespace(model=model, problem=problem, scene=scene, samples=np.array(plans))
