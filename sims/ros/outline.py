"""The outline of a robot in the plane, and whether a model was learned with it."""

from numbers import Real
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot.shapes import placed
from parc_jax.common.errors import InputError
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import trajectories
from parc_jax.problem.body import Body
from parc_jax.problem.world.outlines import Footprint

ROUNDED = 1e-6  # [m]
NETWORK = 0.01  # [m] by which it may be off where a manoeuvre begins, for all k alike
SIDES = 64  # of the polygon around a disc, for free space at the start


class Outline(NamedTuple):
    """corners (n, 2) [m] in the robot's frame that hold it; inner (n, 2) [m] that it holds; body as
    of `Loop`; points (m, 2) [m] of the model's reference points, the first at (0, 0).
    """

    corners: np.ndarray
    inner: np.ndarray
    body: Body | float
    points: np.ndarray

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

    def beside(self, model: TrajectoryModel, k: np.ndarray, heading: float) -> float:
        """[m] by which a reference point lies beyond the tube around where the model has it at the
        start, the farthest one for any of k (b, n_k). heading: [rad] by which the outline is turned
        from the frame of the model's runs.
        """
        return _farthest(self.away(model, k, heading), _tube(model, k))

    def away(self, model: TrajectoryModel, k: np.ndarray, heading: float | None) -> np.ndarray:
        """(b, m, 2) [m] from where the model has the reference points at the start, for k (b, n_k),
        to where they are. heading: as of `beside`; None: as it fits best, since k alone tells the
        heading of a robot whose runs begin with several.
        """
        knots, _ = trajectories(model.net, model.layout, k)
        starts = knots[:, 0].reshape(len(k), -1, 2)
        turned = np.full(len(k), heading or 0.0)
        if heading is None:
            x, y = self.points.T
            along = (x * starts[..., 0] + y * starts[..., 1]).sum(axis=1)
            turned = np.arctan2((x * starts[..., 1] - y * starts[..., 0]).sum(axis=1), along)
        c, s = np.cos(turned), np.sin(turned)
        turn = np.moveaxis(np.array([[c, s], [-s, c]]), -1, 0)
        return self.points @ turn - starts


def _tube(model: TrajectoryModel, k: np.ndarray) -> np.ndarray:
    """Half widths (b, m, 2) [m] of the tube at the start; between bins of the wider one."""
    width = model.tube.interval[model.tube.bins_of(k), 0].max(axis=1)
    return width.reshape(len(k), -1, 2)


def _farthest(away: np.ndarray, allowed: np.ndarray) -> float:
    """[m] beyond what is allowed along each axis."""
    return float(np.linalg.norm(np.maximum(np.abs(away) - allowed, 0.0), axis=-1).max())


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
        places = np.asarray(robot.places)
        return Outline(places[1:], places[1:], robot.body, places)
    if model.n_points != 1 or not (isinstance(robot, Real) and 0 < robot < np.inf):
        raise InputError(
            "pilot: expected a footprint, or of a model with one point a radius > 0 m; got "
            f"{robot!r:.40}."
        )
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    inner = robot * (1 - 1e-9) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # circumscribed: the polygon holds the disc, whatever its corners are rounded to
    corners = inner / np.cos(np.pi / SIDES) * (1 + 3e-9)
    return Outline(corners, inner, float(robot), np.zeros((1, 2)))


def require_outline(outline: Outline, model: TrajectoryModel, k: np.ndarray) -> None:
    """Raises InputError for an outline that is not the one that the model was learned with, for
    some of k (b, n_k).
    """
    away = outline.away(model, k, None if model.rotation is None else 0.0)
    # a tube is wide; how a network varies over k tells better what it may be off by
    if _farthest(away, np.minimum(_tube(model, k), np.ptp(away, axis=0) + NETWORK)) > ROUNDED:
        far = np.linalg.norm(away, axis=-1).max()
        raise InputError(
            "pilot: expected the footprint that the model was learned with; a point of this one is "
            f"{far:.3g} m from where the model has it at the start. Take that footprint, its "
            "corners in the same order, or learn a model of this one."
        )
