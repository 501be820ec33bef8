"""One plan chosen from an answer, and the three honest sentences about it. [T23]"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import jax
import numpy as np

from parc_jax.answer.looks import Look, Looks, fresh_key
from parc_jax.common.errors import InputError, expected
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.drive.local.local_model import Local, local_model, tried_first
from parc_jax.drive.local.near import Near, narrowing
from parc_jax.drive.local.safe_box import SafeBox, box_around, safe_box, share_of
from parc_jax.drive.local.tested import Tested, run_plan
from parc_jax.learning.bound.counts import NoStatement, Risk, as_probability
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.system import System, check_system
from parc_jax.problem.robust.nominal import Query
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.scene import Scene, unpruned_scene
from parc_jax.statement import about_pose

# how a question is answered: (question, key, settings, looks) -> Answer


@dataclass(frozen=True, eq=False)
class Choice:
    """The plan that is driven. From `Answer.choose`.

    plan (n_p + n_k,): start and parameters, a plan of the proved safe set. value: of the objective.
    scene: of whose answer it is; the plan is told in its frame.
    looks: tests that may be made of it, the account of its answer. tested, near: what fresh runs
    showed, where any were made; `run` and `claim_near` give a choice that has them.
    """

    plan: np.ndarray
    value: float
    scene: Scene
    looks: Looks
    solve: Callable[..., Any] | None = field(default=None, repr=False)
    tested: Tested | None = None
    near: Near | None = None

    @property
    def model(self) -> TrajectoryModel:
        """Of whose plans it is one."""
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
    def jitter(self) -> SafeBox | None:
        """A box of k around the plan, each of them proved safe from its start under the tube in
        hand: no new runs. None where no box was proved.
        """
        return safe_box(self.scene, self.p0, self.k, self.model.domain)

    def jitter_risk(self) -> Risk | NoStatement:
        """P(a run leaves the tube), k uniform on the box of `jitter`: eps / its share. [T5, T23]"""
        if self.jitter is None:
            return NoStatement("no box around the plan was proved safe")
        claim = self.model.claim
        if claim.kind == "pac" and claim.law.k_law != "uniform":
            law = claim.law.k_law
            return NoStatement(f"the claim is about k drawn by {law!r}, not uniformly over K")
        return claim.risk(share=self.jitter.share)

    def run(
        self,
        system: System,
        key: jax.Array,
        *,
        eps: Fraction | float | str = 1e-3,
        n: int | None = None,
        quiet: bool = True,
    ):
        """The choice with `tested`: fresh runs of this very plan, one look. [T6]

        eps: bound asked for when no run fails; n: runs, None = as many as that takes at this look's
        share of delta (6,905 for 1e-3 at 1e-3). Runs are of the plan in hand: choose first, then
        run. Uses streams of `key` that nothing else uses. Raises InputError, also when all looks
        are spent.
        """
        check_system(system)
        require_same(system, self.model)
        eps = as_probability("eps", eps)
        if n is not None and n < 1:
            raise InputError(f"run: expected at least one run; got {n}.")
        look = self.looks.take()
        # all obstacles, those too that no run inside the tube comes near
        scene = unpruned_scene(self.scene)
        seen = run_plan(system, scene, self.p0, self.k, key, look, eps, n, quiet)
        return replace(self, tested=seen)

    def claim_near(
        self,
        system: System,
        key: jax.Array,
        asked: Local | None = None,
        *,
        settings: Settings | None = None,
        quiet: bool = True,
    ):
        """The choice with `near`: a claim about a small box of k around the plan, from runs made on
        that box alone, and everything proved again under it, one look. What is proved is an answer
        to the question as it was asked, with its start set and pose. [T23]

        asked: sizes, by default those of `Local`: 0.02 % of K, 1e-3. settings: of the query with
        the local model. Uses streams of `key` that nothing else uses. Raises InputError, also
        when all looks are spent, and for an answer whose file does not tell the question.
        """
        check_system(system)
        require_same(system, self.model)
        asked = Local() if asked is None else asked
        if not isinstance(asked, Local):
            raise InputError(expected("claim_near", "a Local", asked, "pj.Local(share=1e-3)"))
        question = self.scene.nominal.query
        if question is None or self.solve is None:
            raise InputError(
                "claim_near: expected an answer that knows its question; a file that was told in "
                "the robot's frame does not. Solve the scene again, with the same `at`."
            )
        start = tried_first(system, key, asked)
        look = self.looks.take()
        whole = self.model.domain
        box = box_around(self.k, float(asked.share) ** (1 / whole.n), whole)
        own = fresh_key(key, look, self.plan, box.lo, box.hi)
        model = local_model(system, start, box, own, look.delta, asked, quiet)
        return replace(self, near=near_of(self, question.of(model), look, own, settings))

    def statement(self) -> str:
        """The sentences (D): what is known of the plan that is driven, and of nothing else."""
        start = ", ".join(f"{x:.4f}" for x in self.p0)
        k = ", ".join(f"{x:.6g}" for x in self.k)
        lines = [f"The plan chosen: p0 = ({start}), k = ({k})."]
        if self.scene.nominal.pose is not None:
            lines.append(about_pose(*self.scene.nominal.pose))
        if self.tested is None:
            lines.append("This very plan: not run since it was chosen, so no statement.")
        else:
            lines.append(self.tested.statement())
        if self.near is not None:
            lines.append(self.near.statement())
        lines.append(self._about_jitter())
        if self.looks.taken:
            lines.append(
                f"Looks: {self.looks.taken} of {self.looks.planned} taken, delta = "
                f"{rounded_up(self.looks.delta, 10)} split over them."
            )
        return "\n".join(f"(D) {line}" for line in lines)

    def _about_jitter(self) -> str:
        risk = self.jitter_risk()
        if self.jitter is None and self.near is not None and self.near.proved is not None:
            return (
                "Jitter without new runs: no statement under the tube over all of K, which leaves "
                "no box around this plan; under the local tube, what is said above of S."
            )
        if isinstance(risk, NoStatement):
            return f"Jitter without new runs: no statement, since {risk.reason}."
        half = ", ".join(rounded_down(x, 3) for x in self.jitter.half)
        share = rounded_down(100 * self.jitter.share)
        bound = rounded_up(risk.bound)
        worth = " (no promise at all: run the plan, or claim near it)" if risk.bound >= 1 else ""
        return (
            f"Jitter without new runs: from this start, k drawn uniformly within ±({half}) of the "
            f"middle of a box around it, {share} % of K and proved safe throughout, leaves the "
            f"tube with probability at most {bound}{worth}."
        )


def near_of(
    choice: Choice, question: Query, look: Look, key: jax.Array, settings: Settings | None = None
) -> Near:
    """What the choice's question, asked of the local model of this look, proves around the plan."""
    model, answer = question.model, None
    if model.tube.claimed.any():
        answer = choice.solve(question, key, settings, choice.looks)
    return near_by(choice, model, answer, look)


def near_by(choice: Choice, model: TrajectoryModel, answer: Any, look: Look) -> Near:
    """What the answer under a local model, None where it has no claim, proves around the plan."""
    proved = None if answer is None else safe_box(answer.scene, choice.p0, choice.k, model.domain)
    share = share_of(model.domain, choice.model.domain)
    widths = narrowing(choice.model.tube, model.tube, model.domain)
    return Near(model, answer, share, proved, widths, look)
