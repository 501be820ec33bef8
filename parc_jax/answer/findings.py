"""What a query found, and the question that it answers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from parc_jax.answer.looks import Looks
from parc_jax.common.status import Ended, Status
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem, goal_box
from parc_jax.problem.robust.nominal import NominalProblem, Query
from parc_jax.problem.robust.pose import Pose
from parc_jax.problem.robust.realisations import Robustness
from parc_jax.proof.absence.prove_no_plan import PROVED, NoPlan
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.found import Cover, Progress
from parc_jax.safe_set.corridors.kept import KeptPlans
from parc_jax.safe_set.corridors.place import Place
from parc_jax.safe_set.corridors.plan_set import PlanSet
from parc_jax.safe_set.corridors.polytope import SafePolytope
from parc_jax.safe_set.corridors.stopping import Coverage
from parc_jax.safe_set.corridors.union import SafeUnion
from parc_jax.safe_set.verdict.scene import Scene, volume_of_all


@dataclass(frozen=True, eq=False, repr=False)
class Findings:
    """The record behind an `Answer`, which explains its fields.

    cover: what the search found. spelled: certificates of the samples, or what writes them.
    told_whole: `whole` as a file tells it. solve: how a question is answered, of `Planner`.
    """

    scene: Scene
    cover: Cover
    samples: np.ndarray
    spelled: list[dict] | Callable[[], list[dict]]
    proved: bool = False
    refused: int = 0
    timings: dict[str, float] = field(default_factory=dict)
    no_plan: NoPlan | None = None
    looks: Looks = field(default_factory=Looks)
    told_whole: float | None = None
    solve: Callable[..., Any] | None = None

    @cached_property
    def _corridors(self) -> Corridors:
        return Corridors(self.model.tube, self.cover.corridors)

    @cached_property
    def _plans(self) -> PlanSet:
        """What plans are drawn from: the polytopes; without any all that the corridors hold."""
        if len(self.cover.polytopes):
            return SafeUnion(self.scene, list(self.cover.polytopes))
        return self._kept

    @cached_property
    def _kept(self) -> KeptPlans:
        """All plans that the corridors hold."""
        return KeptPlans(self.scene, self._corridors, self.cover.within)

    @cached_property
    def sample_parts(self) -> list[dict]:
        """The certificates of the samples, written when they are first asked for."""
        return self.spelled() if callable(self.spelled) else self.spelled

    @property
    def asked(self) -> NominalProblem:
        """The plain question."""
        return self.scene.nominal

    @property
    def model(self) -> TrajectoryModel:
        """What the plain question is asked of."""
        return self.asked.model

    @property
    def problem(self) -> Problem:
        """The plain problem; `query` has it as it was asked."""
        return self.asked.problem

    @property
    def query(self) -> Query | None:
        """The query as it was asked; None where a file tells the plain one alone."""
        return self.asked.query

    @property
    def uncertainty(self) -> Robustness | None:
        """What every plan withstands."""
        return self.asked.uncertainty

    @cached_property
    def whole(self) -> float:
        """Volume of all plans that were asked about, before tube or uncertainty take anything off:
        of K times the goal's box, or of K alone where there is one start.
        """
        if self.told_whole is not None:
            return self.told_whole
        if self.uncertainty is None or self.query is None:
            return volume_of_all(self.scene)
        volume = self.uncertainty.volume_of_k(self.model.domain)
        if self.scene.at is not None:
            return volume
        lo, hi = goal_box(self.query.problem.goal, self.query.model.layout)
        return volume * float(np.prod((hi - lo)[: self.model.n_p]))

    @property
    def pose(self) -> Pose | None:
        """Where the robot is, where that was asked."""
        return self.asked.pose

    @property
    def found(self) -> bool:
        """A safe plan exists and is in hand."""
        return len(self.samples) + len(self.corridors) + len(self.polytopes) > 0

    @property
    def status(self) -> Status:
        """What is known: safe plans proved or bounded, none exists (proved), or none found."""
        if self.found:
            return Status.PROVED if self.proved else Status.BOUNDED
        absent = self.no_plan is not None and self.no_plan.kind == PROVED
        return Status.NO_PLAN if absent else Status.NOT_FOUND

    @property
    def ended(self) -> Ended | None:
        """What ended the search: its target, its work, or the limit in seconds above it, which is
        told wherever it cut something off. None of a file that does not tell.
        """
        draws = self.cover.ended
        proof = None if self.no_plan is None else self.no_plan.ended
        if Ended.SECONDS in (draws, proof):
            return Ended.SECONDS
        return draws if self.found or proof is None else proof

    @property
    def corridors(self) -> Sequence[Corridor]:
        """One separating direction per obstacle and interval each: every plan that keeps to one and
        ends in the shrunken goal is safe, whatever its region. The safe polytopes are their
        intersections with the cells."""
        return self._corridors.all

    @property
    def polytopes(self) -> list[SafePolytope]:
        """The safe polytopes: pattern, bin, corridor and inner point each. None unless the query
        cut them (`Settings.polytopes`); `with_polytopes` cuts them later."""
        return list(self.cover.polytopes)

    @property
    def history(self) -> Sequence[Progress]:
        """Progress of the search at every fresh draw: seconds from its start, corridors and
        polytopes so far, shares that they cover.
        """
        return self.cover.history

    @property
    def coverage(self) -> Coverage:
        """Share of the model's safe set inside `polytopes`: estimate, lower confidence bound,
        counts behind them.
        """
        return self.cover.coverage

    @property
    def corridor_coverage(self) -> Coverage:
        """Share of the model's safe set that keeps to some of `corridors`, as in `coverage`."""
        return self.cover.kept

    @property
    def _held(self) -> Coverage:
        """Coverage of what `sample` draws from."""
        return self.coverage if len(self.polytopes) else self.corridor_coverage

    @property
    def counts(self) -> dict[str, int]:
        """Points drawn uniformly over all that could reach the goal shrunken by the tube, how many
        of them do, how many are safe.
        """
        return {
            "drawn": self.cover.drawn,
            "reaching": self.cover.reaching,
            "safe": self.cover.safe,
        }

    @property
    def around(self) -> Place | None:
        """Where safe plans are too rare for draws from everywhere, the place around what a search
        found that was drawn from instead; counts, coverage and volume are of it then.
        """
        return self.cover.within
