"""The problem of every step of a loop: a scene as measured, and a goal that admits every end."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from parc_jax.answer.why import why_of
from parc_jax.common.arrays import once, slices
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.common.spelling import exact
from parc_jax.drive.loop.candidates import AT_ONCE
from parc_jax.drive.loop.commitment import require_shared
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import outputs
from parc_jax.learning.network.rounding import rounding_bound
from parc_jax.problem.body import Body, Disc, Polygon
from parc_jax.problem.problem import SAME, Span, reach_avoid
from parc_jax.problem.robust.nominal import Query
from parc_jax.problem.robust.pose import ROUNDING, Pose
from parc_jax.problem.robust.vertex_model import copied_problem
from parc_jax.problem.uncertainty import FREE, Uncertainty
from parc_jax.safe_set.verdict.infeasible import why_none
from parc_jax.safe_set.verdict.scene import ROOM, Scene, lowered, padded

CORNERS = 8  # of an obstacle in the plane: scenes are padded to as many, so none compiles anew


class Scenes:
    """Scenes of one model and body. end, uncertainty: of `Loop`; refused where they do not fit."""

    def __init__(
        self,
        model: TrajectoryModel,
        body: Body | Disc | Polygon | float,
        end: HPolytope | None,
        uncertainty: Uncertainty,
    ):
        self.model, self.body, self.end, self.uncertainty = model, body, end, uncertainty
        if uncertainty.k or uncertainty.given or uncertainty.unknown or uncertainty.goal:
            raise InputError(
                "uncertainty: expected that of start, heading, obstacles and sensing_eps; what is "
                "measured of k is given at every step, and a goal less by what it may be off."
            )
        if end is not None and end.n != model.n_c + model.n_q:
            raise InputError(
                f"end: expected a set over {model.n_c + model.n_q} coordinates, of all points and "
                f"then q, as the model has them; got {end.n}."
            )
        self._models: dict = {}  # under uncertainty, made once

    def scene(
        self,
        pose: Pose,
        obstacles: Sequence,
        spans: Sequence | None = None,
        goal: HPolytope | None = None,
        at: Fraction = Fraction(0),
        drifted: float = 0.0,
    ) -> Scene:
        """The scene at a pose of a moment [s]; the rest as of `Loop.step`. Raises InputError."""
        # given parameters are exact at every step: they come with the candidates
        uncertainty = replace(self.uncertainty, given={axis: FREE for axis in self.model.given})
        # a goal of one row, a placeholder until the problem is in the robot's frame
        row = np.eye(1, self.model.n_c + self.model.n_q)
        anything = hpolytope(row, [1e6]) if goal is None else goal
        # the model tells the workspace, which a goal of all points does not
        problem = reach_avoid(anything, obstacles, self.body, spans=spans)
        for j, span in enumerate(problem.all_spans):
            if span is not None:
                _require_now(f"span of obstacle {j}", span, at)
                if span.of is not None:
                    require_shared("drift", drifted)
        problem = replace(problem, uncertainty=uncertainty)
        nominal = Query(problem, self.model, pose).nominal(self._models)
        if goal is not None:  # one that `Query` has turned and shrunk
            return padded(lowered(nominal), ROOM, CORNERS)
        model, end = nominal.model, None
        if self.end is not None:  # of all vertex realisations
            copies = model.n_points // self.model.n_points
            end = copied_problem(reach_avoid(self.end, (), self.body), self.model, 1, copies).goal
        end = once(model, everywhere) if end is None else end
        # with its place all points of the robot move; less rounding
        rows = end.A[:, : model.n_c].reshape(-1, model.n_points, model.n_p)
        terms = np.abs(rows).sum(axis=(1, 2)) * np.abs(nominal.at).sum() + np.abs(end.b)
        ends = HPolytope(end.A, end.b + (rows @ nominal.at).sum(axis=1) - ROUNDING * terms)
        nominal = replace(nominal, problem=replace(nominal.problem, goal=ends))
        return padded(lowered(nominal), ROOM, CORNERS)

    def why_none(self, scene: Scene, k: np.ndarray, judged: np.ndarray) -> str:
        """A reason why none of k (b, n_k) is safe, and of the first ones judged (j, n_k) what the
        nearest lacks, as the end of a sentence; empty without one.
        """
        why = why_none(scene)
        if why is not None:
            return f": {why.words.rstrip('.')}"
        said = why_of(scene, listed=judged[:AT_ONCE]).sentences if len(judged) else ()
        return ". ".join([self._no_end(k), *(one.rstrip(".") for one in said)])

    def _no_end(self, k: np.ndarray) -> str:
        if self.end is None:
            return ""
        n = self.model.n_c + self.model.n_q
        rows = np.arange(self.model.net.n_out - n, self.model.net.n_out)
        parts = [outputs(self.model.net, k[some], rows) for some in slices(len(k), AT_ONCE)]
        # of the predictions alone: it explains, the verdicts above decided
        met = (np.concatenate(parts) @ self.end.A.T <= self.end.b).all(axis=1).any()
        return "" if met else ": none ends where a manoeuvre may end"


def _require_now(name: str, span: Span, at: Fraction) -> None:
    """Raises InputError for what was made for another moment, or is of what nobody drives now."""
    if span.at is None or not abs(span.at - float(at)) <= SAME:
        fault = "says none" if span.at is None else f"was made for {exact(span.at)} s"
    elif not (fault := span.void):
        return
    raise InputError(
        f"{name}: expected one for the moment of this pose, {exact(at)} s of the clock; it "
        f"{fault}. Make it anew at every step, with `at`, when all others have decided."
    )


def everywhere(model: TrajectoryModel) -> HPolytope:
    """A box that holds every end of a robot at the origin, with every error of the tube."""
    tube = model.tube
    widest = tube.final[tube.claimed].max(initial=0.0)
    far = 2.0 * (float(rounding_bound(model.net, model.domain).magnitude.max()) + widest)
    n = model.n_c + model.n_q
    return from_box(box([-far] * n, [far] * n))
