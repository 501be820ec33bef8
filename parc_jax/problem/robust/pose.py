"""A scene of the world in the frame of a robot at a measured pose. [T22]

The robot starts at the origin of its frame with heading 0, as all runs do that the model was
learned from. Rows are rounded; obstacles grow and the goal shrinks by more than that can matter
where a robot of this model can be.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from parc_jax.common.arrays import as_float64, once
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.rounding import rounding_bound
from parc_jax.learning.system import TURNS
from parc_jax.problem.problem import Problem
from parc_jax.problem.world.outlines import Edge, require_turn

ROUNDING = 2.0**-44  # of the terms of a row: far more than the rounding of a few products


class Pose(NamedTuple):
    """A pose of the robot.

    place: (n_p,) [m] of its first reference point.
    heading: [rad] from that of the model's runs; None where nothing turns.
    """

    place: np.ndarray
    heading: float | None = None

    @property
    def values(self) -> np.ndarray:
        """x, y (and z), and the heading where there is one: as `pose_of` takes them."""
        return self.place if self.heading is None else np.append(self.place, self.heading)


def pose_of(at, model: TrajectoryModel, turns: int = 10) -> Pose:
    """A pose from x, y (and z), in the plane optionally followed by a heading.

    Raises InputError, also for a heading where the model's system declares no rotation, and for one
    of more turns: odometry counts them, degrees look so.
    """
    values = as_float64("at", at, (None,))
    n_p = model.n_p
    if len(values) == n_p:
        return Pose(values)
    if n_p != 2 or len(values) != 3:
        names = "x, y or x, y, heading" if n_p == 2 else f"{n_p} coordinates"
        raise InputError(f"at: expected {names}; got {len(values)} numbers.")
    require_rotation(model, "at")
    require_turn("at heading", values[2], turns)
    return Pose(values[:2], float(values[2]))


def require_rotation(model: TrajectoryModel, what: str) -> None:
    """Raises InputError for a system that declares no rotation."""
    if model.rotation is None or model.n_p != 2:
        raise InputError(
            f"{what}: expected a planar system that declares rotation invariance (`rotation`, a "
            f"word per goal state) for a heading; {model.system or 'this model'} does not."
        )


def from_here(problem: Problem, model: TrajectoryModel, pose: Pose) -> Problem:
    """The problem in the frame of a robot at this pose, without a start set: the start is the pose.

    Raises InputError for a pose outside of the start set.
    """
    start = problem.start
    if start is not None and not start.contains(pose.place):
        raise InputError(
            "at: expected a place within the start set of the scene, less the uncertainty of the "
            f"start; {', '.join(f'{x:g}' for x in pose.place)} is outside. Leave the start set out."
        )
    problem = replace(problem, start=None)
    if pose.heading is None:
        return problem
    require_rotation(model, "at")
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    n_c, body = model.n_c, max(float(part.shape.radius) for part in problem.parts)
    far = once(model, _farthest) + body
    rows = problem.goal.A[:, :n_c].reshape(-1, model.n_points, 2)
    further = problem.goal.A[:, n_c:]
    turned = (rows @ turn).reshape(-1, n_c)
    shift = (rows @ pose.place).sum(axis=1)
    angle = further @ (pose.heading * np.array([word == TURNS for word in model.rotation], float))
    terms = np.abs(rows).sum(axis=(1, 2)) * (far + np.abs(pose.place).sum())
    terms = terms + np.abs(problem.goal.b) + np.abs(further).sum(axis=1) * abs(pose.heading)
    bounds = problem.goal.b - shift - angle - ROUNDING * terms
    goal = HPolytope(np.concatenate([turned, further], axis=1), bounds)
    return replace(problem, goal=goal, obstacles=_turned(problem.obstacles, turn, pose.place, far))


def _farthest(model: TrajectoryModel) -> float:
    """[m] bound of the coordinates of all points of the robot, from its start."""
    tube = model.tube
    widest = max(w[tube.claimed].max(initial=0.0) for w in (tube.interval, tube.final))
    return float(rounding_bound(model.net, model.domain).magnitude.max()) + widest


def _turned(
    obstacles: tuple[HPolytope, ...], turn: np.ndarray, place: np.ndarray, far: float
) -> tuple[HPolytope, ...]:
    """All obstacles in the robot's frame. far: [m] bound of coordinates of the robot."""
    if not obstacles:
        return ()
    A = np.concatenate([o.A for o in obstacles])
    b = np.concatenate([o.b for o in obstacles])
    terms = np.abs(A).sum(axis=1) * (far + np.abs(place).sum()) + np.abs(b)
    bounds = b - A @ place + ROUNDING * terms
    last = np.cumsum([len(o.b) for o in obstacles])[:-1]
    own = zip(obstacles, np.split(A @ turn, last), np.split(bounds, last), strict=True)
    # a region is told in the world
    told = ((o, (None, o.width, o.told) if isinstance(o, Edge) else (), *rest) for o, *rest in own)
    return tuple(type(o)(rows, off, *lost) for o, lost, rows, off in told)
