"""Refine where it matters: new runs where the plans of a scene are, or nearly are. [T23, T24]

Pilot samples zoom in on small boxes of K by a few runs each; nothing is claimed of them, so they
cost no error probability. The best boxes are localised in turn, each from runs of its own and for
one look of the few declared, until a plan is proved under the claim.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.looks import Looks, fresh_key
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.common.probes import require_sound_arithmetic
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import counted
from parc_jax.drive.local.choice import Choice
from parc_jax.drive.local.localise import (
    Local,
    LocalRuns,
    answered_near,
    bounded_near,
    checked_local,
    key_of_trial,
)
from parc_jax.drive.local.safe_box import box_around, share_of
from parc_jax.learning.bound.declared import assumed_claim, stand_in
from parc_jax.learning.bound.pipeline import learn_profile
from parc_jax.learning.bound.profile import SHAPES
from parc_jax.learning.bound.settings import Intersample, intersample_of
from parc_jax.learning.bound.start_gap import StartTrial, declared_gap, try_starts
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import fit, fit_tail
from parc_jax.learning.system import System
from parc_jax.method import Exact
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.nominal import Query, query
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import lowered, scene_of
from sims.boxes_of_k import (
    Aim,
    PilotSample,
    pilot_samples,
    rank_given,
    rank_plans,
    smaller_boxes,
    spaced,
)

_log = logging.getLogger(__name__)


class Bought(NamedTuple):
    """The result of one stage. box: of K, its best one; share: of K that it takes. runs: made in
    it. margin: [m, .] least one of the best plan: under the tube, positive for a safe plan, or of
    all runs of a pilot sample. widest: [m, .] largest half width at the end, of all coordinates.
    """

    stage: str
    box: Box
    share: float
    runs: int
    margin: float
    widest: float

    def __str__(self) -> str:
        sides = zip(self.box.lo, self.box.hi, strict=True)
        where = " x ".join(f"[{lo:.6g}, {hi:.6g}]" for lo, hi in sides)
        return (
            f"{self.stage}: margin {self.margin:.4f}, half width at the end {self.widest:.4f}, k "
            f"in {where}"
        )


@dataclass(frozen=True, eq=False)
class Refined:
    """The result of a refinement. choice: the plan to drive, with its local claim and the answer
    under it in `near`; None when no claim left a safe plan. stages: their results, in order.
    """

    choice: Choice | None
    stages: tuple[Bought, ...]
    looks: Looks

    def details(self) -> str:
        """The sentences (D) of the plan, or that there is none, which proves nothing."""
        if self.choice is None:
            return (
                f"No safe plan was found in {counted(len(self.stages), 'stage')} and "
                f"{counted(self.looks.taken, 'look')}. This is not a proof that none exists."
            )
        return self.choice.details()

    def table(self) -> str:
        """The result of each stage, one line each."""
        lines = ["stage                     share of K      runs   margin  half width at the end"]
        for s in self.stages:
            lines += [f"{s.stage:24s} {s.share:11.2g} {s.runs:9,d} {s.margin:8.4f}  {s.widest:.4f}"]
        return "\n".join(lines)


@dataclass(frozen=True)
class Zoom:
    """A search for boxes of K by pilot samples, with options of `refine`."""

    question: Query
    system: System
    key: jax.Array
    shares: Sequence[float]
    centres: int
    runs: int
    around: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        shares, n_k = self.shares, self.question.model.n_k
        falling = all(a > b for a, b in pairwise(shares))
        if not shares or not falling or not 0 < shares[-1] <= shares[0] <= 1:
            raise InputError(f"refine: expected falling shares of K between 0 and 1; got {shares}.")
        if self.centres < 1 or self.runs < 20:
            raise InputError(
                "refine: expected at least one centre and 20 runs of each; got "
                f"{self.centres}, {self.runs}."
            )
        if any(len(k) != n_k for k in self.around):
            raise InputError(
                f"refine: expected around of {n_k} parameters each; got {self.around}."
            )

    def boxes(self, note: Callable[[Bought], None]) -> list[Box]:
        """Boxes to claim on, the most promising first; `note` gets the result of every round. Ends
        when a round of smaller boxes is no better than the last.
        """
        model, shares = self.question.model, self.shares
        rng = generator(stream(self.key, Stage.DRIVEN))
        scene = scene_of(self.question.problem, model)
        side = shares[0] ** (1 / model.n_k)
        # the tube is left out of the order, for that of a small box is another one
        plans = rank_plans(scene, rng, part=0.0, spacing=side)
        under = rank_given(scene, *plans.x).score
        widest = float(np.median(model.tube.final, axis=0).max())
        note(Bought("model of all of K", model.domain, 1.0, 0, under, widest))
        note(Bought("the same without a tube", model.domain, 1.0, 0, plans.score, 0.0))
        aims = self._first_aims(*plans.x, side)
        samples: list[PilotSample] = []
        best = -np.inf
        for number, share in enumerate(shares):
            if not aims:
                break
            # numbers of rounds stay below those of the trial of starts, in the same stream
            fresh = jax.random.fold_in(stream(self.key, Stage.DRIVEN), number)
            new = pilot_samples(self.system, scene, aims, self.runs, fresh, rng)
            if not new:
                break
            top = new[0]
            stage, runs = f"pilot samples, round {number + 1}", len(aims) * self.runs
            note(Bought(stage, top.box, share, runs, top.margin, top.scatter))
            samples = sorted([*samples, *new], key=lambda sample: sample.score, reverse=True)
            if top.score <= best or share == shares[-1]:
                break
            best, part = top.score, shares[number + 1] / share
            smaller = [one for sample in new for one in smaller_boxes(sample, scene, part, rng)]
            smaller.sort(key=lambda one: one[0], reverse=True)
            aims = [aim for _, aim in smaller[: self.centres]]
        return [sample.box for sample in samples]

    def _first_aims(self, p0: np.ndarray, k: np.ndarray, side: float) -> list[Aim]:
        """Aims around the given k, then around the best plans p0 (n, n_p), k (n, n_k)."""
        model = self.question.model
        chosen = spaced(k, model.domain, self.centres, side)
        ends = paths_of(model, p0[chosen], k[chosen])[:, -1, : model.n_p]
        given = np.array(self.around, float).reshape(-1, model.n_k)
        centres = np.concatenate([given, k[chosen]])[: self.centres]
        ends = np.concatenate([np.repeat(ends[:1], len(given), axis=0), ends])
        pairs = zip(centres, ends, strict=False)
        return [Aim(box_around(values, side, model.domain), end) for values, end in pairs]


def refine(
    model: TrajectoryModel,
    problem: Problem,
    system: System,
    key: jax.Array,
    local: Local | None = None,
    *,
    shares: Sequence[float] = (2e-3, 2e-4, 2e-5, 2e-6),
    centres: int = 12,
    runs: int = 200,
    around: Sequence[Sequence[float]] = (),
    looks: int = 2,
    delta: float = 1e-3,
    settings: Settings | None = None,
    say: Callable[[str], None] | None = None,
) -> Refined:
    """Search for a small box of K with new runs where plans of a problem are, or nearly are; then a
    plan, a claim about its box, and everything proved again under it. [T23, T24]

    For scenes too narrow for a model of the whole of K, and plans close to something.
    system: the black box of this model. key: only its DRIVEN stream is used, by no other call.
    local: sizes of the claims; its share and shape are not used, the shape of the tube is
    selected before the calibration runs. shares: of K that the boxes of each round take,
    falling. centres, runs: boxes a round, and runs of each. around: values of k (n_k,) that the
    first round samples too. looks: claims that may be made; delta: error probability of all of
    them together. settings: of the query under a claim. say: called with a line of progress.
    Raises InputError.
    """
    if problem.uncertainty is not None:
        raise InputError("refine: expected a problem without uncertainty; set uncertainty=None.")
    require_sound_arithmetic()
    question, stages = query(problem, model), []
    zoom = Zoom(question, system, key, tuple(shares), centres, runs, around)
    local, account = checked_local("refine", system, model, local), Looks().declare(delta, looks)

    def note(stage: Bought) -> None:
        stages.append(stage)
        (say or _log.info)(str(stage))

    gap = max(local.gap, declared_gap(model.claim))
    start = try_starts(system, key_of_trial(key), gap)
    for box in zoom.boxes(note)[: account.planned]:
        look = account.take()
        fresh = fresh_key(key, look, box.lo, box.hi)
        runs_there = LocalRuns(system, fresh, local.rollouts, None, True, box)
        between = intersample_of(model.claim.assumptions)
        there = selected_model(problem, runs_there, look.delta, local, start, between)
        best = rank_plans(scene_of(problem, there), np.random.default_rng(0))
        made = local.rollouts + local.profile_runs + there.claim.n
        name = f"claim, look {look.number} of {look.planned}"
        share, widest = float(share_of(box, model.domain)), float(there.tube.final.max())
        note(Bought(name, there.domain, share, made, best.score, widest))
        if not best.score > 0:  # no proof that no plan is safe, but reason enough for the next box
            continue
        here = settings or Settings.whole()
        if here.method is None:
            here = here.replace(method=Exact((best.x[0][0], best.x[1][0])))
        near = answered_near(question, there, look, account, runs_there.key, here)
        if near.answer is not None and near.answer.corridors:
            plan, value = near.answer.best("room")
            near = near.around(*np.split(plan, [model.n_p]))
            chosen = Choice(plan, value, lowered(question.nominal()), account)
            chosen = replace(chosen, near=replace(near, of=chosen.driven))
            return Refined(chosen, tuple(stages), account)
    return Refined(None, tuple(stages), account)


def selected_model(
    problem: Problem,
    runs: LocalRuns,
    delta: Fraction,
    local: Local,
    start: StartTrial,
    between: Intersample,
) -> TrajectoryModel:
    """A model of the box of some runs: of some networks and shapes of the tube those that leave the
    problem the largest margin.
    """
    train = runs.train()
    # by training and shape runs alone: calibration runs see the selected pair, for one look
    further = list(runs.further(local.profile_runs))
    first, rng, tried = fit(train, local, runs.key), np.random.default_rng(0), []
    for net in [first] if local.hidden else [first, fit_tail(first, train)]:
        for shape in SHAPES:
            profile = learn_profile(net, train, further, runs.bins, shape=shape)
            guessed = trajectory_model(net, stand_in(assumed_claim(net, train.finite), profile))
            tried.append((rank_plans(scene_of(problem, guessed), rng).score, net, profile))
    _, net, profile = max(tried, key=lambda one: one[0])
    return bounded_near(net, runs, train, delta, local, start, between, profile)
