"""One plan chosen from an answer, its tests, its local claim, and the sentences (D). [T23]"""

from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property

import jax
import numpy as np

from parc_jax.answer.looks import Look, Looks, fresh_key
from parc_jax.answer.risk import measured_of
from parc_jax.common.arrays import Sealed, read_only
from parc_jax.common.errors import InputError, check_count
from parc_jax.common.keys import Stage
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import exact, rounded_down, rounded_up
from parc_jax.drive.local.localise import (
    Driven,
    Local,
    LocalRuns,
    Near,
    answered_near,
    bounded_near,
    checked_local,
    key_of_trial,
    require_begins,
)
from parc_jax.drive.local.safe_box import SafeBox, box_around, safe_box, sides_of
from parc_jax.drive.local.trials import ledger_of_tests, run_once
from parc_jax.learning.bound.counts import (
    NoStatement,
    Risk,
    as_probability,
    clopper_pearson,
    required_runs,
)
from parc_jax.learning.bound.settings import intersample_of
from parc_jax.learning.bound.start_gap import ALIKE, declared_gap, trial_of, try_starts
from parc_jax.learning.bound.statement import AS_RECORDED, assumes, confidence_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.fit import fit
from parc_jax.learning.runs.law import law_of
from parc_jax.learning.system import System
from parc_jax.problem.world.moving import require_under_way
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.scene import Scene, unpruned_scene
from parc_jax.statement import about_obstacles, about_points, about_pose, about_scene


@dataclass(frozen=True)
class FreshRuns:
    """Results of fresh runs of one plan.

    n, failures: runs, and those that missed the goal, touched something or ended in NaN.
    eps: bound on the probability of failure with confidence 1 - delta, delta this look's share.
    assumed: what this rests on. law: system and disturbances of the runs, in words. of: the plan.
    """

    n: int
    failures: int
    eps: Fraction
    look: Look
    assumed: tuple[str, ...]
    law: str
    of: Driven | None = field(default=None, compare=False, repr=False)

    def details(self) -> str:
        """The sentence (D i)."""
        during = f" in its {exact(self.of.scene.model.time.t_f)} s" if self.of else ""
        return (
            f"This very plan: {self.failures} of {self.n:,} fresh runs made after it was chosen "
            "failed (missed the goal, touched something, or did not return), all of "
            f"{self.law}. With confidence {self.look.sure} a new run of it fails{during} "
            f"with probability at most {rounded_up(self.eps)}{self.look.numbered(', look')}. "
            f"Assumes: {', '.join(self.assumed)}."
        )


@dataclass(frozen=True, eq=False)
class Choice(Sealed):
    """The plan to drive. Made by `Answer.choose`.

    plan (n_p + n_k,): start and parameters, in the frame of `scene`, a plan of the proved safe set.
    value: its objective. looks: tests that may be made of it, the account of its answer.
    tested, near: results of fresh runs, where there are any; `test` and `localise` return a choice
    that has them. unchecked: of its answer. Raises InputError for results of another plan, or in
    another scene.
    """

    plan: np.ndarray
    value: float
    scene: Scene = field(repr=False)
    looks: Looks = field(repr=False)
    tested: FreshRuns | None = None
    near: Near | None = None
    unchecked: str = ""

    def __post_init__(self) -> None:
        # written over, it would be told as tested
        object.__setattr__(self, "plan", read_only(np.array(self.plan)))
        if not self.model.domain.contains(self.k):
            raise InputError(
                f"choice: expected a plan with k in {self.model.domain.text}; got "
                f"{', '.join(map(exact, self.k))}."
            )
        for runs in filter(None, (self.tested, self.near)):
            if not runs.of or runs.of.scene is not self.scene or runs.of.plan != self.driven.plan:
                raise InputError(
                    "choice: expected results of this very plan in this scene; got those of "
                    "another. Choose it anew (tested=None, near=None), then test or localise it."
                )

    @property
    def driven(self) -> Driven:
        """The plan in its scene."""
        return Driven(self.scene, tuple(self.plan.tolist()))

    @property
    def model(self) -> TrajectoryModel:
        """The model of its answer."""
        return self.scene.model

    @property
    def p0(self) -> np.ndarray:
        """(n_p,) its start."""
        return self.plan[: self.model.n_p]

    @property
    def k(self) -> np.ndarray:
        """(n_k,) its parameters."""
        return self.plan[self.model.n_p :]

    @cached_property
    def safe_box(self) -> SafeBox | None:
        """A box of k around the plan, every plan of it from this start proved safe under the tube
        over K, without new runs; None where no box was proved. [T21]
        """
        return safe_box(self.scene, self.p0, self.k, Box(self.scene.k_lo, self.scene.k_hi))

    def risk(self) -> Risk | NoStatement:
        """P(a run leaves the tube), k uniform on `safe_box`: eps / its share of K. [T5, T23]"""
        if self.safe_box is None:
            return NoStatement("no box around the plan was proved safe")
        if none := measured_of(self.model):
            return none
        claim = self.model.claim
        if claim.kind == "pac" and claim.law.k_law != "uniform":
            law = claim.law.k_law
            return NoStatement(f"the claim is about k drawn by {law!r}, not uniformly over K")
        return claim.risk(share=self.safe_box.share)

    def test(
        self,
        system: System,
        key: jax.Array,
        *,
        eps: Fraction | float | str = 1e-3,
        n: int | None = None,
        quiet: bool = True,
    ) -> "Choice":
        """Run exactly this plan afresh and bound its probability of failure; spends one look. [T6]

        Where the claim has not tried, on this plant, how much the start matters, that comes first.
        system: the black box of the model. key: only its DRIVEN stream is used.
        eps: bound to reach when no run fails. n: runs; None for as many as eps takes at this look's
        share of delta (6,905 for 1e-3 at 1e-3).
        Returns the choice with `tested`. Raises InputError, also when all looks are spent.
        """
        require_begins("test", system, self.model)
        require_under_way(self.scene.problem.all_spans)
        eps = as_probability("eps", eps)
        if n is not None:
            check_count("test: n", n, 1, "None for as many runs as eps takes")
        start = trial_of(self.model.claim, system, key_of_trial(key))
        look = self.looks.take()
        n = required_runs(float(eps), float(look.delta)) if n is None else n
        # all obstacles: a run outside of the tube may touch those that the query pruned
        scene, fresh = unpruned_scene(self.scene), fresh_key(key, look, self.p0, self.k)
        plans = np.broadcast_to(self.plan, (n, len(self.plan)))
        failed, lost, alike = run_once(system, scene, fresh, Stage.VALIDATE, plans, quiet, start)
        failures = int(failed.sum())
        bound = clopper_pearson(failures, n, float(look.delta))
        told = ledger_of_tests(self.model.claim, lost, start=start)
        assumed = (*(x for x in told if alike or not x.startswith(ALIKE)), *look.ledger)
        law = law_of(system, "given by the plan").describe()
        return replace(self, tested=FreshRuns(n, failures, bound, look, assumed, law, self.driven))

    def localise(
        self,
        system: System,
        key: jax.Array,
        local: Local | None = None,
        *,
        settings: Settings | None = None,
        quiet: bool = True,
    ) -> "Choice":
        """Bound the error on a small box of k around the plan, from runs on that box alone, and
        prove the same problem, start set and pose again under it; spends one look. [T23]

        system: the black box of the model. key: only its DRIVEN stream is used.
        local: sizes; by default 0.02 % of K and eps = 1e-3. settings: of the query under the claim.
        Returns the choice with `near`. Raises InputError, also when all looks are spent, and for an
        answer from a file that lacks the problem in the world's frame.
        """
        local = checked_local("localise", system, self.model, local)
        if self.model.claim.law.box != "K":
            raise InputError(
                "localise: expected a plan of an answer over all of K; this one is of a local "
                "claim. Localise the first plan with a smaller share."
            )
        query = self.scene.nominal.query
        if query is None:
            raise InputError(
                "localise: expected an answer that knows its question; a file that was told in "
                "the robot's frame does not. Solve the scene again, with the same `at`."
            )
        require_under_way(query.problem.all_spans)
        whole = self.model.domain
        box = box_around(self.k, float(local.share) ** (1 / whole.n), whole)
        gap = max(local.gap, declared_gap(self.model.claim))
        start = try_starts(system, key_of_trial(key), gap, whole)
        look = self.looks.take()  # spent, also where its runs fail
        fresh = fresh_key(key, look, self.plan, box.lo, box.hi)
        runs = LocalRuns(system, fresh, local.rollouts, None, quiet, box)
        between = intersample_of(query.model.claim.assumptions)
        train = runs.train()
        net = fit(train, local, fresh)
        there = bounded_near(net, runs, train, look.delta, local, start, between)
        near = answered_near(query, there, look, self.looks, fresh, settings)
        return replace(self, near=replace(near.around(self.p0, self.k), of=self.driven))

    def details(self) -> str:
        """The sentences (D), about the plan to drive and nothing else."""
        start, k = (", ".join(map(exact, values)) for values in (self.p0, self.k))
        problem, unrun = self.scene.nominal.problem, "not run since it was chosen, so no statement."
        lines = [
            f"The plan chosen: p0 = ({start}), k = ({k}).",
            about_pose(self.scene.nominal.pose, self.model),
            about_scene(self.scene.nominal.pose, problem, self.model),
            about_points(problem),
            about_obstacles(problem, self.model.time),
            self.tested.details() if self.tested else f"This very plan: {unrun}",
            self.near.details() if self.near else "",
            self._about_box(),
            self.unchecked,
        ]
        if self.looks.taken:
            lines.append(
                f"Looks: {self.looks.taken} of {self.looks.planned} taken, delta = "
                f"{rounded_up(self.looks.delta, 10)} split over them."
            )
        return "\n".join(f"(D) {line}" for line in lines if line)

    def _about_box(self) -> str:
        risk = self.risk()
        if self.safe_box is None and self.near is not None and self.near.proved is not None:
            # a refined plan need not be safe under the tube over K: that is no fault to report
            return (
                "Perturbation without new runs: no statement under the tube over all of K, which "
                "leaves no box around this plan; under the local tube, what is said above of S."
            )
        if isinstance(risk, NoStatement):
            return f"Perturbation without new runs: no statement, since {risk.reason}."
        share, box = rounded_down(100 * self.safe_box.share), self.model.claim.law.box
        p, bound = self.model.claim.premises, rounded_up(risk.bound)
        worth = " (no promise at all: test the plan, or localise it)" if risk.bound >= 1 else ""
        return (
            "Perturbation without new runs: from this start, k drawn uniformly from the box "
            f"{sides_of(self.model.labels.k, self.safe_box)} around it, {share} % of {box} and "
            f"proved safe throughout{AS_RECORDED * ('rows' in p)}, leaves the tube with "
            f"probability at most {bound}{worth}, by the claim over {box}, which has confidence "
            f"{confidence_of(p)}. {assumes(p)}"
        )
