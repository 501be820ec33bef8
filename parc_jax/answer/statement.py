"""An answer in words: the line that is its name, the sentences that say what it is worth."""

import html
from collections.abc import Sequence

from parc_jax.answer.findings import Findings
from parc_jax.answer.numbers import density_of_k, risk_of_draw
from parc_jax.common.spelling import counted, rounded_down
from parc_jax.learning.bound.counts import NoStatement
from parc_jax.safe_set.verdict.infeasible import why_none
from parc_jax.statement import (
    about_place,
    about_plans,
    about_pose,
    about_risk,
    about_sensing,
    about_uncertainty,
    nothing_found,
)


def one_line(found: Findings) -> str:
    """What was found, in a line."""
    name = found.model.system or "unnamed system"
    if not found.found:
        return f"Answer for {name}: {found.status}"
    share = f"at least {rounded_down(100 * found._held.at_least, 3)} % of the model's safe set"
    if found.around is not None:
        share += " around what a search found"
    counts = (
        counted(len(found.samples), "plan"),
        counted(len(found.corridors), "corridor"),
        counted(len(found.polytopes), "polytope"),
    )
    return f"Answer for {name}: {found.status}, {', '.join(counts)}, {share}"


def as_html(found: Findings) -> str:
    """The line and the sentences, for notebooks."""
    lines = "".join(f"<li>{html.escape(line)}</li>" for line in statement(found).split("\n"))
    return f"<b>{html.escape(one_line(found))}</b><ul>{lines}</ul>"


def statement(found: Findings) -> str:
    """The two sentences, as `Answer.statement`."""
    told = False
    if found.found:
        known = _about_tube(found, _about_uncertainty(found))
        said = f"(C) {_about_model(found)}\n{known}\n{_about_draw(found)}"
    elif found.no_plan is not None:
        said = f"{found.no_plan.statement()}\n{_about_tube(found, ())}"
        told = found.no_plan.ended is found.ended
    else:
        none = nothing_found(why_none(found.scene))
        said = none if found.uncertainty is None else found.uncertainty.of_none(none)
    return said if told or found.ended is None else f"{said}\n{found.ended.sentence}"


def _about_model(found: Findings) -> str:
    """What is proved of the model and its tube."""
    counts = len(found.samples), len(found.polytopes), len(found.corridors)
    plans = about_plans(*counts, found.proved)
    if found.around is None:
        return plans
    k_lo, k_hi = (side[-found.model.n_k :] for side in found.around.box)
    return f"{plans}\n{about_place(k_lo, k_hi)}"


def _about_uncertainty(found: Findings) -> list[str]:
    """What all plans withstand."""
    return [] if found.uncertainty is None else [about_uncertainty(found.uncertainty.words)]


def _about_tube(found: Findings, withstood: Sequence[str]) -> str:
    """What is known of the tube, after what all plans start from and withstand."""
    pose = found.pose
    here = [] if pose is None else [about_pose(pose.place, pose.heading)]
    return "\n".join([*here, *withstood, f"(E) {found.model.claim.statement()}"])


def _about_draw(found: Findings) -> str:
    """What a drawn plan risks."""
    drawn = "the safe polytopes" if len(found.polytopes) else "all that the corridors hold"
    promised = risk_of_draw(found)
    density = None if isinstance(promised, NoStatement) else density_of_k(found)
    risk = about_risk(promised, drawn, density, found._held.confidence, found.model.claim.delta)
    if found.uncertainty is not None and found.uncertainty.sensing_eps:
        risk = f"{risk} {about_sensing(promised, found.uncertainty.sensing_eps)}"
    return risk
