"""Refine where it matters: new runs where the plans of a scene are, or nearly are. [T23, T24]

Pilot samples zoom in on small boxes of K by a few runs each; nothing is claimed of them, so they
cost no error probability. The best boxes are localised in turn, each from runs of its own and for
one look of the few declared, until a plan is proved under the claim.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
from parc_jax.drive.local.localise import Local, checked_local, localise, start_trial
from parc_jax.drive.local.safe_box import box_around
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


@dataclass(frozen=True)
class Zoom:
    """A search for boxes of K by pilot samples, with options of `Planner.refine`."""

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
    zoom: Zoom,
    local: Local | None,
    looks: Looks,
    settings: Settings,
    say: Callable[[str], None] | None = None,
) -> Refined:
    """Search for boxes, then localise the best: see `Planner.refine`. Raises InputError."""
    question, system, key, stages = zoom.question, zoom.system, zoom.key, []
    local = checked_local("refine", system, question.model, local)

    def note(stage: Bought) -> None:
        stages.append(stage)
        (say or _log.info)(str(stage))

    start = start_trial(system, key, local, question.model.claim)
    for box in zoom.boxes(note)[: looks.planned]:
        near = localise(question, system, start, box, key, looks, local, settings)
        name = f"claim, look {near.look.number} of {near.look.planned}"
        runs = local.rollouts + local.profile_runs + near.model.claim.n
        widest = float(near.model.tube.final.max())
        note(Bought(name, near.model.domain, float(near.share), runs, near.margin, widest))
        if near.answer is not None and near.answer.corridors:
            plan, value = near.answer.best("room")
            near = near.around(*np.split(plan, [question.model.n_p]))
            scene = lowered(question.nominal())
            chosen = Choice(plan, value, scene, looks)
            chosen = replace(chosen, near=replace(near, of=chosen.driven))
            return Refined(chosen, tuple(stages), looks)
    return Refined(None, tuple(stages), looks)
