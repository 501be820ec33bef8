"""An answer in words: the line that is its name, the sentences that say what it is worth."""

import html

from parc_jax.answer.findings import Findings
from parc_jax.answer.numbers import density_of_k, risk_of_draw
from parc_jax.robust.withstood import Withstood
from parc_jax.sentences import (
    NONE_OF_COPIES,
    NOTHING_FOUND,
    about_doubt,
    about_place,
    about_plans,
    about_pose,
    about_risk,
    about_sensing,
)
from parc_jax.verdict.scene import no_end_fits
from parc_jax.volume_bounds.no_plan import PROVED, NoPlan


def one_line(found: Findings) -> str:
    """What was found, in a line."""
    name = found.model.system or "unnamed system"
    if not found.found:
        return f"Answer for {name}: {found.status}"
    share = f"at least {100 * found._held.at_least:.1f} % of the model's safe set"
    if found.around is not None:
        share += " around what a search found"
    return (
        f"Answer for {name}: {found.status}, {len(found.samples)} plans, "
        f"{len(found.corridors)} corridors, {len(found.polytopes)} polytopes, {share}"
    )


def as_html(found: Findings) -> str:
    """The line and the sentences, for notebooks."""
    lines = "".join(f"<li>{html.escape(line)}</li>" for line in statement(found).split("\n"))
    return f"<b>{html.escape(one_line(found))}</b><ul>{lines}</ul>"


def statement(found: Findings) -> str:
    """The two sentences, as `Answer.statement`."""
    if found.found:
        return f"(C) {_about_model(found)}\n{_about_tube(found)}\n{_about_draw(found)}"
    if found.no_plan is None:
        why = no_end_fits(found.scene, found.model)
        return NOTHING_FOUND if why is None else f"{NOTHING_FOUND} It is known that {why}"
    return f"{_about_none(found.no_plan, found.doubt)}\n{_about_tube(found)}"


def _about_none(no_plan: NoPlan, doubt: Withstood | None) -> str:
    """What is known where no plan was found and branch and bound looked for a proof."""
    none = no_plan.statement()
    if no_plan.kind == PROVED and doubt is not None and doubt.copies:
        none = f"{none} {NONE_OF_COPIES}"
    return none


def _about_model(found: Findings) -> str:
    """What is proved of the model and its tube."""
    counts = len(found.samples), len(found.polytopes), len(found.corridors)
    plans = about_plans(*counts, found.proved)
    if found.around is None:
        return plans
    k_lo, k_hi = (side[-found.model.n_k :] for side in found.around.box)
    return f"{plans}\n{about_place(k_lo, k_hi)}"


def _about_tube(found: Findings) -> str:
    """What is known of the tube, after what all plans start from and withstand."""
    lines = [f"(E) {found.model.claim.statement()}"]
    if found.doubt is not None:
        lines.insert(0, about_doubt(found.doubt.words))
    if found.pose is not None:
        lines.insert(0, about_pose(found.pose.place, found.pose.heading))
    return "\n".join(lines)


def _about_draw(found: Findings) -> str:
    """What a drawn plan risks."""
    drawn = "the safe polytopes" if len(found.polytopes) else "all that the corridors hold"
    promised = risk_of_draw(found)
    density = density_of_k(found)
    risk = about_risk(promised, drawn, density, found._held.confidence, found.model.claim.delta)
    if found.doubt is not None and found.doubt.sensing_eps:
        risk = f"{risk} {about_sensing(promised, found.doubt.sensing_eps)}"
    return risk
