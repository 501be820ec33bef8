"""What a loop asks at every step: a scene as the robot sees it, in which manoeuvres end where they
may.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from parc_jax.common.arrays import slices
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.drive.loop.ends import any_goal, everywhere, moved_goal
from parc_jax.drive.loop.outlook import AT_ONCE
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import outputs
from parc_jax.problem.body import Body, Disc, Polygon
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.robust.pose import Pose
from parc_jax.problem.robust.vertex_model import copied_problem
from parc_jax.problem.uncertainty import FREE, Uncertainty
from parc_jax.safe_set.verdict.infeasible import why_none
from parc_jax.safe_set.verdict.scene import ROOM, Scene, lowered, padded

CORNERS = 8  # of an obstacle in the plane, that scenes have room for without compiling anew


class Scenes:
    """Of one model and body. end, uncertainty: as of `Loop`. Raises InputError if they do not
    fit.
    """

    def __init__(
        self,
        model: TrajectoryModel,
        body: Body | Disc | Polygon | float,
        end: HPolytope | None,
        uncertainty: Uncertainty,
    ):
        self.model, self.body, self.end, self.uncertainty = model, body, end, uncertainty
        known = uncertainty.k or uncertainty.given or uncertainty.unknown
        if known or uncertainty.goal:
            raise InputError(
                "Loop: expected uncertainty of start and heading alone; what is measured of k is "
                "given at every step."
            )
        if end is not None and end.n != model.n_c + model.n_q:
            raise InputError(
                f"end: expected a set over {model.n_c + model.n_q} coordinates, of all points and "
                f"then q, as the model has them; got {end.n}."
            )
        self._known: dict = {}

    def seen(self, pose: Pose, obstacles: Sequence, spans: Sequence | None = None) -> Scene:
        """The scene as the robot sees it from a pose. Raises InputError."""
        # what is measured at the start comes with every step
        uncertainty = replace(self.uncertainty, given={axis: FREE for axis in self.model.given})
        goal = any_goal(self.model)
        problem = reach_avoid(goal, obstacles, self.body, spans=spans, uncertainty=uncertainty)
        asked = query(problem, self.model)
        asked = replace(asked, pose=pose).nominal(self._known)
        goal = moved_goal(self._end(asked.model), asked.model, asked.at)
        asked = replace(asked, problem=asked.problem.replace(goal=goal))
        return padded(lowered(asked), ROOM, CORNERS)

    def why_none(self, scene: Scene, k: np.ndarray) -> str:
        """What is known of why none of k (b, n_k) is safe, as the end of a sentence."""
        why = why_none(scene)
        if why is not None:
            return f": {why.words.rstrip('.')}"
        if self.end is None:
            return ""
        n = self.model.n_c + self.model.n_q
        rows = np.arange(self.model.net.n_out - n, self.model.net.n_out)
        parts = [outputs(self.model.net, k[some], rows) for some in slices(len(k), AT_ONCE)]
        met = (np.concatenate(parts) @ self.end.A.T <= self.end.b).all(axis=1).any()
        return "" if met else ": none ends where a manoeuvre may end"

    def _end(self, model: TrajectoryModel) -> HPolytope:
        """Where a manoeuvre may end, for the model under uncertainty: all its copies."""
        if self.end is None:
            return everywhere(model)
        copies = model.n_points // self.model.n_points
        return copied_problem(reach_avoid(self.end, (), self.body), self.model, 1, copies).goal
