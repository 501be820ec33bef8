"""The outline of a robot in the plane, and whether a model was learned with it."""

from numbers import Real
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot.shapes import placed
from parc_jax.common.errors import InputError
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.body import Body
from parc_jax.problem.world.outlines import Footprint

SIDES = 64  # of the polygon around a disc, for free space at the start


class Outline(NamedTuple):
    """corners (n, 2) [m] in the robot's frame that hold it; inner (n, 2) [m] that it holds; body as
    of `Loop`.
    """

    corners: np.ndarray
    inner: np.ndarray
    body: Body | float

    @property
    def far(self) -> float:
        """[m] from the pose to the farthest corner."""
        return float(np.linalg.norm(self.corners, axis=1).max())

    def at(self, pose: np.ndarray) -> np.ndarray:
        """Corners (n, 2) [m] for a pose (x, y, heading)."""
        return placed(self.corners, pose[:2], pose[2])

    def inner_at(self, pose: np.ndarray) -> np.ndarray:
        """The same of those that the robot holds."""
        return placed(self.inner, pose[:2], pose[2])


def outline_of(model: TrajectoryModel, robot: Footprint | float) -> Outline:
    """The outline of a footprint, or of a radius [m]. Raises InputError for another model's."""
    if model.n_p != 2:
        raise InputError(f"pilot: expected a robot in the plane; got one in {model.n_p}-D.")
    if isinstance(robot, Footprint):
        if tuple(model.points) != robot.points:
            raise InputError(
                f"pilot: expected a model of the points {', '.join(robot.points)}; it has "
                f"{', '.join(model.points)}."
            )
        return Outline(robot.places[1:], robot.places[1:], robot.body)
    if model.n_points != 1 or not (isinstance(robot, Real) and 0 < robot < np.inf):
        raise InputError(
            "pilot: expected a footprint, or of a model with one point a radius > 0 m; got "
            f"{robot!r:.40}."
        )
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    inner = robot * (1 - 1e-9) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # circumscribed: the polygon holds the disc, whatever its corners are rounded to
    return Outline(inner / np.cos(np.pi / SIDES) * (1 + 3e-9), inner, float(robot))
