"""One plan chosen from an answer, its tests, its local claim, and the sentences (D). [T23]"""

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import Look, Looks, fresh_key
from parc_jax.common.errors import InputError, expected
from parc_jax.common.keys import Stage
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.drive.local.localise import Local, LocalAnswer, localise, start_trial
from parc_jax.drive.local.safe_box import SafeBox, box_around, safe_box, share_of
from parc_jax.learning.bound.counts import (
    NoStatement,
    Risk,
    as_probability,
    clopper_pearson,
    required_runs,
)
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.system import System, check_system
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.outcomes import outcomes
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.scene import Scene, unpruned_scene
from parc_jax.statement import about_pose

CHUNK = 256  # runs per compiled call, as in large collections: nothing is compiled for one plan
ALIKE = 1e-12  # [m, .] largest difference of runs that the sentences call equal
NARROWER = 1.05  # [1] least factor by which a tube that is called narrower is so


@dataclass(frozen=True)
class FreshRuns:
    """Results of fresh runs of one plan.

    n, failures: runs, and those that missed the goal, touched something or ended in NaN.
    alike: all runs were equal, which proves nothing: a rare gust leaves a thousand runs equal, and
    a program that was traced twice to the same result may give another one the third time.
    eps: bound on the probability of failure with confidence 1 - delta, delta this look's share.
    clearance: [m] smallest distance from an obstacle in any run.
    """

    n: int
    failures: int
    alike: bool
    eps: Fraction
    look: Look
    clearance: float

    def details(self) -> str:
        """The sentence (D i)."""
        equal = (
            " All of them were alike; that the system has no disturbance is not shown, and not "
            "used."
            if self.alike and self.n > 1
            else ""
        )
        sure = rounded_down(1 - self.look.delta, 10)
        return (
            f"This very plan: {self.failures} of {self.n:,} fresh runs made after it was chosen "
            f"failed. With confidence {sure} a new run of it fails with probability at most "
            f"{rounded_up(self.eps)}{_numbered(self.look, ', look')}.{equal}"
        )


@dataclass(frozen=True, eq=False)
class Near:
    """A claim about a box N around the plan alone, and the problem proved again under it. [T23]

    model: of N alone. answer: to the same problem under its tube; None where the tube has no claim.
    look: the one that was spent. share: exact, of K that N takes. proved: a large box in N
    of plans from the start, all proved safe under the local tube, or None.
    at_end, on_the_way: geometric mean factors by which the local tube is narrower than that over K;
    infinite where the latter has no claim.
    """

    model: TrajectoryModel
    answer: Answer | None
    look: Look
    share: Fraction
    proved: SafeBox | None
    at_end: float
    on_the_way: float

    @property
    def held(self) -> Fraction:
        """Exact share of N that the proved box takes; 0 without one."""
        return Fraction(0) if self.proved is None else self.proved.share

    def risk(self) -> Risk | NoStatement:
        """P(a run leaves the local tube), k uniform on the proved box: eps / its share of N; every
        run of such a k inside the tube succeeds. [T5, T23]
        """
        if self.proved is None:
            return NoStatement("no box around the plan was proved safe under the local tube")
        return self.model.claim.risk(share=self.held)

    @property
    def is_narrower(self) -> bool:
        """Whether the local claim gains anything: at the end or on the way."""
        return max(self.at_end, self.on_the_way) >= NARROWER

    def details(self) -> str:
        """The sentence (D ii)."""
        claim, domain = self.model.claim, self.model.domain
        sides = " x ".join(
            f"{name} in [{lo:.6g}, {hi:.6g}]"
            for name, lo, hi in zip(self.model.labels.k, domain.lo, domain.hi, strict=True)
        )
        where = f"k in N = {sides}, {100 * float(self.share):.2g} % of K"
        if not claim.tube.claimed.any():
            return f"Near it: {where}. {claim.details()}"
        lines = [
            f"Near it: {where}. With confidence {rounded_down(1 - claim.delta, 10)}"
            f"{_numbered(self.look, ' (look', ')')} over "
            f"{claim.n:,} fresh runs made on N alone after N was chosen, a new run with k uniform "
            f"on N leaves the local tube with probability at most {rounded_up(claim.eps, 10)}.",
            self._about_width(),
        ]
        risk = self.risk()
        if isinstance(risk, NoStatement):
            lines.append(f"Of driving near this plan: no statement, since {risk.reason}.")
        else:
            held = "all" if self.held == 1 else f"{rounded_down(100 * self.held, 3)} %"
            lines.append(
                f"From this start every k of a box S that takes {held} of N is proved safe under "
                "the local tube. Driven with k uniform on S, the run fails with probability at "
                f"most {rounded_up(risk.bound)}."
            )
        return " ".join(lines)

    def _about_width(self) -> str:
        at_end, on_the_way = (
            "infinity" if np.isinf(x) else rounded_down(x) for x in (self.at_end, self.on_the_way)
        )
        if not self.is_narrower:
            return (
                "The local tube is NOT narrower than the one over all of K "
                f"({at_end} at the end, {on_the_way} on the way): this claim gains "
                "nothing but a law of k near the plan."
            )
        return (
            f"The local tube is narrower than the one over all of K by a factor of {at_end} "
            f"at the end and {on_the_way} on the way."
        )


@dataclass(frozen=True, eq=False)
class Choice:
    """The plan to drive. Made by `Answer.choose`.

    plan (n_p + n_k,): start and parameters, in the frame of `scene`, a plan of the proved safe set.
    value: its objective. looks: tests that may be made of it, the account of its answer.
    tested, near: results of fresh runs, where there are any; `test` and `localise` return a choice
    that has them.
    """

    plan: np.ndarray
    value: float
    scene: Scene
    looks: Looks
    tested: FreshRuns | None = None
    near: Near | None = None

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
        return safe_box(self.scene, self.p0, self.k, self.model.domain)

    def risk(self) -> Risk | NoStatement:
        """P(a run leaves the tube), k uniform on `safe_box`: eps / its share of K. [T5, T23]"""
        if self.safe_box is None:
            return NoStatement("no box around the plan was proved safe")
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

        system: the black box of the model. key: only its DRIVEN stream is used.
        eps: bound to reach when no run fails. n: runs; None for as many as eps takes at this look's
        share of delta (6,905 for 1e-3 at 1e-3).
        Returns the choice with `tested`. Raises InputError, also when all looks are spent.
        """
        check_system(system)
        require_same(system, self.model)
        eps = as_probability("eps", eps)
        if n is not None and n < 1:
            raise InputError(f"test: expected at least one run; got {n}.")
        look = self.looks.take()
        # all obstacles: a run outside of the tube may touch those that the query pruned
        scene = unpruned_scene(self.scene)
        tested = run_plan(system, scene, self.p0, self.k, key, look, eps, n, quiet)
        return replace(self, tested=tested)

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
        check_system(system)
        require_same(system, self.model)
        local = Local() if local is None else local
        if not isinstance(local, Local):
            raise InputError(expected("localise", "a Local", local, "pj.drive.Local(share=1e-3)"))
        question = self.scene.nominal.query
        if question is None:
            raise InputError(
                "localise: expected an answer that knows its question; a file that was told in "
                "the robot's frame does not. Solve the scene again, with the same `at`."
            )
        whole = self.model.domain
        box = box_around(self.k, float(local.share) ** (1 / whole.n), whole)
        start = start_trial(system, key, local)
        found = localise(
            question, system, start, box, key, self.looks, local, settings, self.plan, quiet
        )
        return self.under(found)

    def under(self, found: LocalAnswer) -> "Choice":
        """The choice with `near`: the box around it that is proved under a local claim."""
        model, answer, whole = found.model, found.answer, self.model
        proved = None
        if answer is not None:
            proved = safe_box(answer.scene, self.p0, self.k, model.domain)
        share = share_of(model.domain, whole.domain)
        factors = _narrowing(whole.tube, model.tube, model.domain)
        return replace(self, near=Near(model, answer, found.look, share, proved, *factors))

    def details(self) -> str:
        """The sentences (D), about the plan to drive and nothing else."""
        start = ", ".join(f"{x:.4f}" for x in self.p0)
        k = ", ".join(f"{x:.6g}" for x in self.k)
        lines = [f"The plan chosen: p0 = ({start}), k = ({k})."]
        if self.scene.nominal.pose is not None:
            lines.append(about_pose(*self.scene.nominal.pose))
        if self.tested is None:
            lines.append("This very plan: not run since it was chosen, so no statement.")
        else:
            lines.append(self.tested.details())
        if self.near is not None:
            lines.append(self.near.details())
        lines.append(self._about_box())
        if self.looks.taken:
            lines.append(
                f"Looks: {self.looks.taken} of {self.looks.planned} taken, delta = "
                f"{rounded_up(self.looks.delta, 10)} split over them."
            )
        return "\n".join(f"(D) {line}" for line in lines)

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
        half = ", ".join(rounded_down(x, 3) for x in self.safe_box.half)
        share = rounded_down(100 * self.safe_box.share)
        bound = rounded_up(risk.bound)
        worth = " (no promise at all: test the plan, or localise it)" if risk.bound >= 1 else ""
        return (
            f"Perturbation without new runs: from this start, k drawn uniformly within ±({half}) "
            f"of the middle of a box around it, {share} % of K and proved safe throughout, leaves "
            f"the tube with probability at most {bound}{worth}."
        )


def _numbered(look: Look, begin: str, end: str = "") -> str:
    """The number of a look in a sentence, empty where one alone was declared."""
    return f"{begin} {look.number} of {look.planned}{end}" if look.planned > 1 else ""


def _narrowing(whole: Tube, local: Tube, box: Box) -> tuple[float, float]:
    """Geometric mean factors at the end and on the way by which `local` is narrower on a box.

    whole: the tube over K, its widest of the bins that meet the box.
    """
    corners = (whole.bin_box(number) for number in range(whole.n_bins))
    bins = [b for b, (lo, hi) in enumerate(corners) if ((lo <= box.hi) & (hi >= box.lo)).all()]
    path, end = whole.widest(np.array(bins))
    local_path, local_end = local.widest()
    return _factor(end, local_end), _factor(path, local_path)


def _factor(wide: np.ndarray, narrow: np.ndarray) -> float:
    if not np.isfinite(wide).all():
        return float("inf")
    if not np.isfinite(narrow).all():
        return 0.0
    return float(np.exp(np.mean(np.log(wide / narrow))))


def run_plan(
    system: System,
    scene: Scene,
    p0: np.ndarray,
    k: np.ndarray,
    key: jax.Array,
    look: Look,
    eps: Fraction,
    n: int | None,
    quiet: bool,
) -> FreshRuns:
    """Run the plan p0 (n_p,), k (n_k,) n times; None for as many as bound failures by eps when
    there are none. Runs begin at the origin and are moved to p0, as those behind the claim.
    """
    if n is None:
        n = required_runs(float(eps), float(look.delta))
    failures = 0
    alike = True
    first = None
    fresh = fresh_key(key, look, p0, k)
    for batch in stream_rollouts(system, fresh, n, Stage.VALIDATE, k=k, chunk=CHUNK, quiet=quiet):
        if first is None:
            first = batch.select([0])
            (fails,), nearest = _judged(scene, first, p0)
        # without a disturbance all runs equal the first to the last bit: judged once, all counted
        same = _equal(batch, first)
        failures += int(same.sum()) * int(fails)
        others = batch.select(~same)
        if others.n:
            failed, near = _judged(scene, others, p0)
            failures += int(failed.sum())
            nearest = min(nearest, near)
        alike &= bool((np.abs(batch.p - first.p) <= ALIKE).all())
    bound = clopper_pearson(failures, n, float(look.delta))
    return FreshRuns(n, failures, alike, bound, look, nearest)


def _judged(scene: Scene, runs: RolloutBatch, p0: np.ndarray) -> tuple[np.ndarray, float]:
    """(n,) bool, the runs that failed, and their smallest distance [m] from an obstacle."""
    _, reached, distance = outcomes(scene, runs, np.broadcast_to(p0, (runs.n, len(p0))))
    # NaN is a contact: not above 0, and nearer than any distance
    nearest = np.where(np.isnan(distance), -np.inf, distance).min()
    return runs.failed | ~reached | ~(distance > 0), float(nearest)


def _equal(runs: RolloutBatch, first: RolloutBatch) -> np.ndarray:
    """(n,) bool, the runs that equal the first to the last bit."""
    moved = (runs.p != first.p).reshape(runs.n, -1).any(axis=1)
    return ~moved & (runs.q == first.q).all(axis=1) & (runs.failed == first.failed)
