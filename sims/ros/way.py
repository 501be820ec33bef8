"""Where a plan leads in the world."""

import numpy as np

from parc_jax.answer.path import NominalPath, nominal_path
from parc_jax.app.plot.shapes import in_world
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.problem.robust.pose import Pose


def predicted(asked: NominalProblem, p0: np.ndarray, k: np.ndarray) -> NominalPath:
    """The robot's own prediction of a plan; of one way to execute it where k is not all of its own,
    or a file has the ways that stand for what is uncertain alone.
    """
    own = asked.told.model
    return nominal_path(own if own.n_k == len(k) else asked.model, p0, k)


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
