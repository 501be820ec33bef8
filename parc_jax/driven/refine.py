"""Refine where it matters: new runs, bins and a local network where the plans of a scene are, or
nearly are. [T23, T24]

Probes zoom in on small boxes of K by a few runs each; nothing is claimed of them, so they cost no
error probability. On the best box a local claim is made, from runs of its own: one look, of the few
that were declared. Everything is proved again under it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import jax
import numpy as np

from parc_jax.driven.choice import Choice
from parc_jax.driven.local_model import Local, best_claimed
from parc_jax.driven.looks import Looks, fresh_key
from parc_jax.driven.near import Near
from parc_jax.driven.nearly import nearly_safe
from parc_jax.driven.probe import Probe, probes, spread_out
from parc_jax.driven.safe_box import safe_box, share_of
from parc_jax.driven.widths import compared
from parc_jax.errors import InputError
from parc_jax.keys import Stage, stream
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid
from parc_jax.verdict.near import whole_scene
from parc_jax.verdict.scene import scene_of


@dataclass(frozen=True)
class Refine:
    """How a refinement looks for its box, and what it claims there.

    shares: of K that the boxes of each round of probes take, falling. centres: probes a round.
    runs: of each probe. kept: probes whose plans are the next round's centres.
    local: of the claim; its share is not used. shapes: of the tube, the most promising one is
    taken before the holdout is seen.
    looks: claims that may be made, delta is split over them. delta: of all together.
    """

    shares: tuple[float, ...] = (2e-3, 2e-4, 3e-5)
    centres: int = 10
    runs: int = 200
    kept: int = 3
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
        if min(self.centres, self.kept) < 1 or self.runs < 20:
            raise InputError(
                "refine: expected at least one centre, one kept probe and 20 runs of each; got "
                f"{self.centres}, {self.kept}, {self.runs}."
            )


class Bought(NamedTuple):
    """What one stage bought. share: of K that its best box takes. runs: made in it. part: the
    largest tried share of its tube under which a plan was found safe; -1 none even without a tube,
    1 safe. room: least margin of that plan. end: (n_c + n_q,) half widths at the end.
    """

    stage: str
    share: float
    runs: int
    part: float
    room: float
    end: np.ndarray


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
        """The `Answer` under the local claim, its proofs for the checker; None when there is no
        plan.
        """
        return None if self.choice is None else self.choice.near.answer

    def statement(self) -> str:
        """The sentences (D) of the plan, or that there is none, which proves nothing."""
        if self.choice is None:
            return (
                f"No safe plan was found in {len(self.stages)} stages and {self.looks.taken} "
                "looks. This is not a proof that none exists."
            )
        return self.choice.statement()

    def table(self) -> str:
        """What each stage bought, one line each."""
        lines = ["stage                 share of K      runs  safe under     room"]
        for s in self.stages:
            under = f"{100 * s.part:.0f} % of tube" if s.part >= 0 else "no tube"
            lines.append(f"{s.stage:20s} {s.share:11.2g} {s.runs:9,d}  {under:14s} {s.room:.3f}")
        return "\n".join(lines)


def refine(
    model: TrajectoryModel,
    problem: ReachAvoid,
    system,
    key: jax.Array,
    solve: Callable[..., Any],
    asked: Refine,
    settings=None,
    say: Callable[[str], None] | None = None,
) -> Refined:
    """Zoom, claim, prove: see `Planner.refine`. solve: as of `Choice`. say: called with a line of
    progress.
    """
    looks = Looks(asked.delta, asked.looks)
    say = say or (lambda line: None)
    boxes, stages = _zoom(model, problem, system, key, asked, say)
    for box in boxes[: asked.looks]:
        look = looks.take()
        own = fresh_key(key, look, box.lo, box.hi)
        local = best_claimed(
            system, model, box, own, look.delta, asked.local, asked.shapes, problem
        )
        bought, near = _proved(local, model, problem, own, solve, look, asked, settings)
        stages.append(bought)
        say(_line(bought))
        if near is not None and near.answer.corridors:
            plan, value = near.answer.best("room")
            scene = whole_scene(near.answer.scene, local)
            n_p = local.n_p
            held = safe_box(local, scene, plan[:n_p], plan[n_p:], local.domain)
            near = Near(local, near.answer, near.share, held, near.widths, look)
            choice = Choice(plan, value, model, scene_of(problem, model), looks, solve, None, near)
            return Refined(choice, tuple(stages), looks)
    return Refined(None, tuple(stages), looks)


def _line(stage: Bought) -> str:
    return f"{stage.stage}: safe under {stage.part:.2f} of its tube, room {stage.room:.3f}"


def _zoom(model, problem, system, key, asked: Refine, say) -> tuple[list, list[Bought]]:
    """Boxes to claim on, the most promising first, and what each round bought. Ends when a round
    of smaller boxes is no better than the last.
    """
    rng = np.random.default_rng(np.asarray(jax.random.key_data(stream(key, Stage.DRIVEN))))
    plans = nearly_safe(model, scene_of(problem, model), rng)
    end = np.median(model.tube.final, axis=0)
    stages = [Bought("model of all of K", 1.0, 0, *plans.score, end)]
    side = asked.shares[0] ** (1 / model.n_k)
    centres = spread_out(plans, model.domain, asked.centres, side)
    found: list[Probe] = []
    best = None
    for number, share in enumerate(asked.shares):
        if not len(centres):
            break
        own = jax.random.fold_in(stream(key, Stage.DRIVEN), number)
        round_ = probes(system, problem, model, centres, share, asked.runs, own, rng)
        if not round_:
            break
        top = round_[0]
        stages.append(
            Bought(
                f"probes, round {number + 1}", share, len(centres) * asked.runs, *top.score, top.end
            )
        )
        say(_line(stages[-1]))
        found = sorted([*found, *round_], key=lambda probe: probe.score, reverse=True)
        if best is not None and top.score <= best:
            break
        best = top.score
        each = -(-asked.centres // asked.kept)
        side = share ** (1 / model.n_k) / 4
        centres = np.concatenate(
            [spread_out(p.plans, model.domain, each, side) for p in round_[: asked.kept]]
        )
    return [probe.box for probe in found], stages


def _proved(local, model, problem, key, solve, look, asked: Refine, settings):
    """The claimed model's stage, and what is proved under it; None without a claim."""
    share = share_of(local.domain, model.domain)
    rng = np.random.default_rng(0)
    end = local.tube.final.max(axis=0)
    runs = asked.local.rollouts + asked.local.profile_runs + local.claim.n
    name = f"claim, look {look.number} of {look.planned}"
    if not local.tube.claimed.any():
        return Bought(name, float(share), runs, -1.0, -np.inf, end), None
    score = nearly_safe(local, scene_of(problem, local), rng).score
    answer = solve(local, problem, key, settings)
    widths = compared(model.tube, local.tube, local.domain)
    return (
        Bought(name, float(share), runs, *score, end),
        Near(local, answer, share, None, widths, look),
    )
