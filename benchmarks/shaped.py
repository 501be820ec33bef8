"""The drift model with other bodies and tubes, for what these cost: the same network, the same safe
set but for a little, more points.
"""

import time
from dataclasses import replace

import jax
import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.error_set import ErrorBox, Faces, faces
from parc_jax.learning.bound.tube import fitted_tube, tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.body import hull
from parc_jax.problem.problem import ReachAvoid, reach_avoid
from parc_jax.problem.robust.question import Plain
from parc_jax.safe_set.corridors.search import cover, draw_safe_plans
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.settings import work_of
from parc_jax.safe_set.verdict.near import near_scene

CORNERS = ("front_left", "front_right", "rear_right", "rear_left")
DIAGONALS = np.array([[1.0, 1.0], [1.0, -1.0]])  # with the axes: four pairs of faces, six bases


def with_corners(model: TrajectoryModel, at: np.ndarray) -> TrajectoryModel:
    """The model of one point with further points at fixed offsets (m, n_p) from it, the first of
    which is zero; every point with the tube of the first.
    """
    n_points, n_p = at.shape
    net, old = model.net, model.tube
    W, b = net.weights[-1], net.biases[-1]
    split = model.layout.n_offsets
    steps = model.time.n_steps
    moves = np.concatenate([np.zeros((n_p, W.shape[1])), W[:split]]).reshape(steps + 1, 1, n_p, -1)
    places = np.concatenate([np.zeros(n_p), b[:split]]).reshape(steps + 1, 1, n_p) + at[None]
    moves = np.broadcast_to(moves, (steps + 1, n_points, n_p, W.shape[1]))
    last = np.concatenate([moves.reshape(-1, W.shape[1])[n_p:], W[split:]])
    bias = np.concatenate([places.ravel()[n_p:], b[split:]])
    net = relu_network([*net.weights[:-1], last], [*net.biases[:-1], bias])
    final = np.concatenate([np.tile(old.final[:, :n_p], (1, n_points)), old.final[:, n_p:]], axis=1)
    wide = tube(old.edges, np.tile(old.interval, (1, 1, n_points)), final, n_points)
    points = CORNERS if n_points == len(CORNERS) else tuple(f"corner{i}" for i in range(n_points))
    subject = replace(model.claim.subject, points=points, rotation=None)
    claim = derived(model.claim, tube=wide, network=net.hash, subject=subject)
    return model.replace(net=net, claim=claim)


def fitted(model: TrajectoryModel) -> TrajectoryModel:
    """The model with faces along the diagonals besides those of its boxes, which cut no more than
    a little off them.
    """
    old = model.tube
    assert isinstance(old.errors, ErrorBox)
    n_p, n_end = old.n_p, old.final.shape[1]
    interval = old.interval.reshape(*old.interval.shape[:2], old.n_points, n_p)
    during = _faces(np.concatenate([np.eye(n_p), DIAGONALS]), interval)
    at_end = _faces(np.eye(n_end), old.final, frames=True)
    tube_of_faces = fitted_tube(old.edges, during, at_end)
    return model.replace(claim=derived(model.claim, tube=tube_of_faces))


def _faces(directions: np.ndarray, half: np.ndarray, frames: bool = False) -> Faces:
    """Faces around boxes of half widths (..., n), the ones across a little closer than corners."""
    n = half.shape[-1]
    across = 0.9 * half @ np.abs(directions[n:]).T
    halves = np.concatenate([half, across], axis=-1)
    everywhere = np.broadcast_to(directions, (*half.shape[:-1], *directions.shape))
    return faces(everywhere, np.zeros(halves.shape), halves, frames)


def as_rectangle(model: TrajectoryModel, problem: ReachAvoid) -> tuple[TrajectoryModel, ReachAvoid]:
    """A rectangle of four points inside the disc of the problem, about the disc's centre, with
    model and goal to match.
    """
    radius = problem.body.radius
    side = radius * np.array([[0.8, 0.6], [0.8, -0.6], [-0.8, -0.6], [-0.8, 0.6]])
    at = side - side[0]
    n_p, n_points = model.n_p, len(at)
    goal = problem.goal
    A = np.zeros((len(goal.b), n_p * n_points + model.n_q))
    A[:, :n_p] = goal.A[:, :n_p]
    A[:, n_p * n_points :] = goal.A[:, n_p:]
    moved = HPolytope(A, goal.b + goal.A[:, :n_p] @ side[0])
    shaped = with_corners(model, at)
    return shaped, problem.replace(goal=moved, body=hull(*CORNERS))


def far_away(problem: ReachAvoid, n: int, first: float = 60.0) -> ReachAvoid:
    """The problem with n further boxes of 2 m, in a grid that begins `first` [m] away."""
    n_p = problem.goal.n if not problem.obstacles else problem.obstacles[0].n
    side = int(np.ceil(n ** (1 / n_p)))
    cells = np.stack(np.meshgrid(*[np.arange(side)] * n_p, indexing="ij"), axis=-1)
    corners = first + 4.0 * cells.reshape(-1, n_p)[:n]
    more = reach_avoid(problem.goal, [box(c, c + 2.0) for c in corners], problem.body).obstacles
    spans = (*problem.all_spans, *(None for _ in more))
    return problem.replace(obstacles=(*problem.obstacles, *more), spans=spans)


def processor_times(scenes: dict, n_first: int, n_corridors: int) -> dict:
    """Of named (model, problem), by turns: processor times [s] to a first safe plan (n_first,) and
    to certified corridors (n_corridors,), and how many of these there were.
    """
    for model, problem in scenes.values():  # compiles
        for seed in (100, 101):
            _first(model, problem, seed)
            _corridors(model, problem, seed)
    out = {name: ([], [], []) for name in scenes}
    for seed in range(n_first):
        for name, scene in scenes.items():
            out[name][0].append(_first(*scene, seed)[0])
    for seed in range(n_corridors):
        for name, scene in scenes.items():
            spent, found = _corridors(*scene, seed)
            out[name][1].append(spent)
            out[name][2].append(len(found.corridors))
    return {name: tuple(np.array(x) for x in lists) for name, lists in out.items()}


def _first(model: TrajectoryModel, problem: ReachAvoid, seed: int):
    begin = time.process_time()
    key, rng = jax.random.PRNGKey(seed), np.random.default_rng(seed)
    found = draw_safe_plans(near_scene(Plain(problem, model)), key, rng, 1, 0.99, Limit(600.0))
    return time.process_time() - begin, found


def _corridors(model: TrajectoryModel, problem: ReachAvoid, seed: int):
    begin = time.process_time()
    scene, rng = near_scene(Plain(problem, model)), np.random.default_rng(seed)
    asked = {"target": 0.01, "confidence": 0.99, "work": work_of(1.0), "limit": Limit(600.0)}
    found = cover(scene, rng, **asked)
    return time.process_time() - begin, found
