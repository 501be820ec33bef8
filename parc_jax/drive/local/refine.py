"""Refine where it matters: new runs where the plans of a scene are, or nearly are. [T23, T24]

Pilot samples zoom in on small boxes of K by a few runs each; nothing is claimed of them, so they
cost no error probability. The best boxes are localised in turn, each from runs of its own and for
one look of the few declared, until a plan is proved under the claim.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.looks import Looks
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import counted
from parc_jax.drive.local.choice import Choice
from parc_jax.drive.local.localise import Local, LocalAnswer, localise, start_trial
from parc_jax.drive.local.safe_box import box_around, share_of
from parc_jax.drive.local.search import (
    Aim,
    PilotSample,
    pilot_samples,
    rank_given,
    rank_plans,
    smaller_boxes,
    spaced,
)
from parc_jax.learning.system import System
from parc_jax.problem.robust.nominal import Query
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import lowered, scene_of

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


def refine(
    question: Query,
    system: System,
    key: jax.Array,
    local: Local,
    *,
    shares: Sequence[float],
    centres: int,
    runs: int,
    around: Sequence[Sequence[float]],
    looks: Looks,
    settings: Settings,
    say: Callable[[str], None] | None = None,
) -> Refined:
    """Search for boxes, then localise the best: see `Planner.refine`."""
    falling = all(a > b for a, b in pairwise(shares))
    if not shares or not falling or not 0 < shares[-1] <= shares[0] <= 1:
        raise InputError(f"refine: expected falling shares of K between 0 and 1; got {shares}.")
    if centres < 1 or runs < 20:
        raise InputError(
            f"refine: expected at least one centre and 20 runs of each; got {centres}, {runs}."
        )
    model, stages = question.model, []

    def note(stage: Bought) -> None:
        stages.append(stage)
        (say or _log.info)(str(stage))

    start = start_trial(system, key, local)
    boxes = _zoom(question, system, key, shares, centres, runs, around, note)
    for box in boxes[: looks.planned]:
        found = localise(question, system, start, box, key, looks, local, settings)
        note(_bought(found, model.domain, local))
        answer = found.answer
        if answer is not None and answer.corridors:
            choice = Choice(*answer.best("room"), lowered(question.nominal()), looks)
            return Refined(choice.under(found), tuple(stages), looks)
    return Refined(None, tuple(stages), looks)


def _zoom(
    question: Query,
    system: System,
    key: jax.Array,
    shares: Sequence[float],
    centres: int,
    runs: int,
    around: Sequence[Sequence[float]],
    note: Callable[[Bought], None],
) -> list[Box]:
    """Boxes to claim on, the most promising first. Ends when a round of smaller boxes is no better
    than the last.
    """
    model = question.model
    if any(len(k) != model.n_k for k in around):
        raise InputError(f"refine: expected around of {model.n_k} parameters each; got {around}.")
    rng = generator(stream(key, Stage.DRIVEN))
    scene = scene_of(question.problem, model)
    side = shares[0] ** (1 / model.n_k)
    # the tube is left out of the order, for that of a small box is another one
    plans = rank_plans(scene, rng, part=0.0, spacing=side)
    whole = rank_given(scene, plans.p0, plans.k).score
    widest = float(np.median(model.tube.final, axis=0).max())
    note(Bought("model of all of K", model.domain, 1.0, 0, whole, widest))
    note(Bought("the same without a tube", model.domain, 1.0, 0, plans.score, 0.0))
    chosen = spaced(plans.k, model.domain, centres, side)
    ends = paths_of(model, plans.p0[chosen], plans.k[chosen])[:, -1, : model.n_p]
    given = np.array(around, float).reshape(-1, model.n_k)
    k = np.concatenate([given, plans.k[chosen]])[:centres]
    ends = np.concatenate([np.repeat(ends[:1], len(given), axis=0), ends])
    aims = [
        Aim(box_around(values, side, model.domain), end)
        for values, end in zip(k, ends, strict=False)
    ]
    samples: list[PilotSample] = []
    best = -np.inf
    for number, share in enumerate(shares):
        if not aims:
            break
        # numbers of rounds stay below those of the trial of starts, in the same stream
        fresh = jax.random.fold_in(stream(key, Stage.DRIVEN), number)
        round_ = pilot_samples(system, scene, aims, runs, fresh, rng)
        if not round_:
            break
        top = round_[0]
        stage = f"pilot samples, round {number + 1}"
        note(Bought(stage, top.box, share, len(aims) * runs, top.margin, top.scatter))
        samples = sorted([*samples, *round_], key=lambda sample: sample.score, reverse=True)
        if top.score <= best or share == shares[-1]:
            break
        best = top.score
        part = shares[number + 1] / share
        smaller = [one for sample in round_ for one in smaller_boxes(sample, scene, part, rng)]
        smaller.sort(key=lambda one: one[0], reverse=True)
        aims = [aim for _, aim in smaller[:centres]]
    return [sample.box for sample in samples]


def _bought(found: LocalAnswer, domain: Box, local: Local) -> Bought:
    """The stage of a local claim."""
    model, look = found.model, found.look
    share = float(share_of(model.domain, domain))
    runs = local.rollouts + local.profile_runs + model.claim.n
    name = f"claim, look {look.number} of {look.planned}"
    return Bought(name, model.domain, share, runs, found.margin, float(model.tube.final.max()))
