"""Refine where it matters: new runs where the plans of a scene are, or nearly are. [T23, T24]

Probes zoom in on small boxes of K by a few runs each; nothing is claimed of them, so they cost no
error probability. On the best box a local claim is made, from runs of its own: one look, of the few
that were declared. Everything is proved again under it.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import jax
import numpy as np

from parc_jax.answer.looks import Look, Looks, fresh_key
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import counted
from parc_jax.drive.local.almost import judged, nearly_safe, spread_out
from parc_jax.drive.local.choice import Choice, near_by
from parc_jax.drive.local.local_model import Local, best_claimed, tried_first
from parc_jax.drive.local.probe import Aim, Probe, inside, probes
from parc_jax.drive.local.safe_box import box_around, share_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.system import System
from parc_jax.method import Exact
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.nominal import Query
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import lowered, scene_of

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Refine:
    """How a refinement looks for its box, and what it claims there.

    shares: of K that the boxes of each round of probes take, falling. centres: probes a round.
    runs: of each probe. around: values of k where something is known to be calm; the first round
    looks there too.
    local: of the claim; its share is not used. shapes: of the tube, the most promising one is
    taken before the holdout is seen.
    looks: claims that may be made, delta is split over them. delta: of all together.
    """

    shares: tuple[float, ...] = (2e-3, 2e-4, 2e-5, 2e-6)
    centres: int = 12
    runs: int = 200
    around: tuple[tuple[float, ...], ...] = ()
    local: Local = field(default_factory=Local)
    shapes: tuple[str, ...] = ("box", "fitted")
    looks: int = 2
    delta: float = 1e-3

    def __post_init__(self):
        falling = all(a > b for a, b in zip(self.shares, self.shares[1:], strict=False))
        if not self.shares or not falling or not 0 < self.shares[-1] <= self.shares[0] <= 1:
            raise InputError(
                f"refine: expected falling shares of K between 0 and 1; got {self.shares}."
            )
        if self.centres < 1 or self.runs < 20:
            raise InputError(
                "refine: expected at least one centre and 20 runs of each; got "
                f"{self.centres}, {self.runs}."
            )


class Bought(NamedTuple):
    """What one stage bought. box: of K, its best one; share: of K that it takes. runs: made in it.
    room: [m, .] the least margin of the best plan found: under the tube, positive for a safe one,
    or of all runs of a probe. widest: [m, .] half width at the end, the largest of all coordinates.
    """

    stage: str
    box: Box
    share: float
    runs: int
    room: float
    widest: float


@dataclass(frozen=True, eq=False)
class Refined:
    """What refinement found. choice: the plan that is driven, with its local claim in `near`; None
    when no claim left a safe plan. stages: what each of them bought.
    """

    choice: Choice | None
    stages: tuple[Bought, ...]
    looks: Looks

    @property
    def answer(self) -> Any:
        """The `Answer` under the local claim, with proofs for the checker; None without a plan."""
        return None if self.choice is None else self.choice.near.answer

    def statement(self) -> str:
        """The sentences (D) of the plan, or that there is none, which proves nothing."""
        if self.choice is None:
            return (
                f"No safe plan was found in {counted(len(self.stages), 'stage')} and "
                f"{counted(self.looks.taken, 'look')}. This is not a proof that none exists."
            )
        return self.choice.statement()

    def table(self) -> str:
        """What each stage bought, one line each."""
        lines = ["stage                     share of K      runs     room  half width at the end"]
        for s in self.stages:
            lines += [f"{s.stage:24s} {s.share:11.2g} {s.runs:9,d} {s.room:8.4f}  {s.widest:.4f}"]
        return "\n".join(lines)


def refine(
    question: Query,
    system: System,
    key: jax.Array,
    solve: Callable[..., Any],
    asked: Refine,
    settings: Settings,
    say: Callable[[str], None] | None = None,
) -> Refined:
    """Zoom, claim, prove: see `Planner.refine`. solve: as of `Choice`. say: told of stages."""
    model, problem = question.model, question.problem
    looks = Looks().declare(asked.delta, asked.looks)
    say = say or _log.info
    start = tried_first(system, key, asked.local)
    boxes, stages = _zoom(model, problem, system, key, asked, say)
    for box in boxes[: asked.looks]:
        look = looks.take()
        own = fresh_key(key, look, box.lo, box.hi)
        local = best_claimed(
            system, start, box, own, look.delta, asked.local, asked.shapes, problem
        )
        query = question.of(local)
        bought, answer = _proved(query, model, own, solve, look, looks, asked, settings)
        stages.append(bought)
        say(_line(bought))
        if answer is not None and answer.corridors:
            choice = Choice(*answer.best("room"), lowered(question.nominal()), looks, solve)
            choice = replace(choice, near=near_by(choice, local, answer, look))
            return Refined(choice, tuple(stages), looks)
    return Refined(None, tuple(stages), looks)


def _line(stage: Bought) -> str:
    sides = zip(stage.box.lo, stage.box.hi, strict=True)
    where = " x ".join(f"[{lo:.6g}, {hi:.6g}]" for lo, hi in sides)
    return (
        f"{stage.stage}: room {stage.room:.4f}, half width at the end {stage.widest:.4f}, k in "
        f"{where}"
    )


def _zoom(
    model: TrajectoryModel,
    problem: Problem,
    system: System,
    key: jax.Array,
    asked: Refine,
    say: Callable[[str], None],
) -> tuple[list, list[Bought]]:
    """Boxes to claim on, the most promising first, and what each round bought. Ends when a round
    of smaller boxes is no better than the last.
    """
    rng = generator(stream(key, Stage.DRIVEN))
    scene = scene_of(problem, model)
    side = asked.shares[0] ** (1 / model.n_k)
    # its tube is left out of the order, for that of a small box is another one
    plans = nearly_safe(scene, rng, part=0.0, apart=side)
    whole = judged(scene, plans.p0, plans.k).score
    widest = float(np.median(model.tube.final, axis=0).max())
    stages = [
        Bought("model of all of K", model.domain, 1.0, 0, whole, widest),
        Bought("the same without a tube", model.domain, 1.0, 0, plans.score, 0.0),
    ]
    for stage in stages:
        say(_line(stage))
    chosen = spread_out(plans.k, model.domain, asked.centres, side)
    ends = paths_of(model, plans.p0[chosen], plans.k[chosen])[:, -1, : model.n_p]
    if any(len(k) != model.n_k for k in asked.around):
        raise InputError(
            f"refine: expected around of {model.n_k} parameters each; got {asked.around}."
        )
    known = np.array(asked.around, float).reshape(-1, model.n_k)
    centres = np.concatenate([known, plans.k[chosen]])[: asked.centres]
    ends = np.concatenate([np.repeat(ends[:1], len(known), axis=0), ends])
    places = [
        Aim(box_around(k, side, model.domain), end) for k, end in zip(centres, ends, strict=False)
    ]
    found: list[Probe] = []
    best = -np.inf
    for number, share in enumerate(asked.shares):
        if not places:
            break
        own = jax.random.fold_in(stream(key, Stage.DRIVEN), number)
        round_ = probes(system, scene, places, asked.runs, own, rng)
        if not round_:
            break
        top = round_[0]
        runs = len(places) * asked.runs
        stage = f"probes, round {number + 1}"
        stages.append(Bought(stage, top.box, share, runs, top.room, top.unrest))
        say(_line(stages[-1]))
        found = sorted([*found, *round_], key=lambda probe: probe.score, reverse=True)
        if top.score <= best or share == asked.shares[-1]:
            break
        best = top.score
        part = asked.shares[number + 1] / share
        smaller = [one for probe in round_ for one in inside(probe, scene, part, rng)]
        smaller.sort(key=lambda one: one[0], reverse=True)
        places = [place for _, place in smaller[: asked.centres]]
    return [probe.box for probe in found], stages


def _proved(
    query: Query,
    model: TrajectoryModel,
    key: jax.Array,
    solve: Callable[..., Any],
    look: Look,
    looks: Looks,
    asked: Refine,
    settings: Settings,
):
    """The stage of the query's model, and the answer under it; None where no plan is safe."""
    local = query.model
    share = float(share_of(local.domain, model.domain))
    rng = np.random.default_rng(0)
    widest = float(local.tube.final.max())
    runs = asked.local.rollouts + asked.local.profile_runs + local.claim.n
    name = f"claim, look {look.number} of {look.planned}"
    if not local.tube.claimed.any():
        return Bought(name, local.domain, share, runs, -np.inf, widest), None
    plans = nearly_safe(scene_of(query.problem, local), rng)
    bought = Bought(name, local.domain, share, runs, plans.score, widest)
    if not plans.score > 0:
        return bought, None
    if settings.method is None:
        settings = settings.replace(method=Exact((plans.p0[0], plans.k[0])))
    return bought, solve(query, key, settings, looks)
