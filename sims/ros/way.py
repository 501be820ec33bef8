"""Where a plan leads in the world."""

import numpy as np

from parc_jax.answer.path import NominalPath, nominal_path
from parc_jax.app.plot.shapes import in_world
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.problem.robust.pose import Pose


def model_of(asked: NominalProblem) -> TrajectoryModel:
    """The model whose path is shown: the robot's own; of the ways that stand for what is uncertain
    where plans choose not all of its k, or a file has no other.
    """
    own = asked.told.model
    return own if own.n_k == asked.model.n_k else asked.model


def drawn_of(model: TrajectoryModel) -> str:
    """What a shown path is, to follow a statement, where it is not the robot's prediction."""
    copies = "network_of_runs" in model.claim.evidence
    return "\nDrawn: one possible run of the model, of those that are uncertain." * copies


def predicted(asked: NominalProblem, p0: np.ndarray, k: np.ndarray) -> NominalPath:
    """The prediction of a plan that is shown, of `model_of`."""
    return nominal_path(model_of(asked), p0, k)


def way_of(path: NominalPath, pose: Pose | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (T + 1,) [s], places (T + 1, 3) [m] of the first reference point and headings (T + 1,)
    [rad] at the knots of a predicted path.
    """
    return path.times, in_world(path.places[:, 0], pose), _headings(path.places, pose)


def _headings(places: np.ndarray, pose: Pose | None) -> np.ndarray:
    """(T + 1,) [rad] by which the points (T + 1, m, n_p) of a body have turned, from the pose's;
    one point alone has no heading, and is drawn with that of the start.
    """
    begin = 0.0 if pose is None or pose.heading is None else pose.heading
    if places.shape[1] < 2 or places.shape[2] != 2:
        return np.full(len(places), begin)
    turned = places - places.mean(axis=1, keepdims=True)
    x, y = turned[0, :, 0], turned[0, :, 1]
    across = (x * turned[..., 1] - y * turned[..., 0]).sum(axis=1)
    along = (x * turned[..., 0] + y * turned[..., 1]).sum(axis=1)
    return begin + np.arctan2(across, along)
