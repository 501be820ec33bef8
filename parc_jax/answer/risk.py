"""The risk of a plan that is drawn from the safe set: the claim, over the density of its k."""

from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from parc_jax.learning.bound.claim import recorded
from parc_jax.learning.bound.counts import NoStatement, Risk, risk_of
from parc_jax.learning.bound.statement import VALIDATED, confidence_of, in_box, probability
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.statement import about_risk, about_sensing

if TYPE_CHECKING:
    from parc_jax.answer.answer import Answer

CONFIDENCE = 0.999  # of the safe set's volume, where a density rests on it


def risk_of_draw(answer: "Answer") -> Risk | NoStatement:
    """As of `Answer.risk`. [T5, T18, T34]"""
    if not len(answer.corridors):
        return NoStatement("there is no safe set to draw k from")
    claim = answer.model.claim
    if claim.kind == VALIDATED and claim.eps is not None and claim.delta is not None:
        return risk_of(claim.eps, claim.delta, Fraction(1), 0.0)
    promised = claim.risk(density=1.0, claimed=True)  # nothing is safe in bins without claim
    if isinstance(promised, NoStatement):
        return promised
    if none := measured_of(answer.model):
        return none
    if not claim.law.is_even:
        law = claim.law.k_law
        return NoStatement(f"the claim is about k drawn by {law!r}, not uniformly over K")
    density = density_of_k(answer)
    if not np.isfinite(density):
        return NoStatement("how much of the safe set they cover was not measured")
    risk = claim.risk(density=density, claimed=True)
    if isinstance(risk, Risk):  # the density was measured, too
        sure = Fraction(str(CONFIDENCE)), Fraction(str(answer.coverage.confidence))
        off = risk.unconditional + sum(1 - x for x in sure)
        risk = replace(risk, unconditional=min(Fraction(1), off))
    return risk


def measured_of(model: TrajectoryModel) -> NoStatement | None:
    """No statement of draws of k where some of k is measured at the start, also if left free."""
    names = ", ".join(name_of(model.labels.k[axis]) for axis in model.given)
    return NoStatement(f"{names} is measured at the start, and drawn by nobody") if names else None


def about_draw(answer: "Answer") -> str:
    """The sentence about it."""
    risk, uncertainty = answer.risk(), answer.scene.nominal.uncertainty
    claim = answer.model.claim
    if claim.kind == VALIDATED:
        most, how = probability(claim.premises["risk"], 2), "drawn by `sample`"
        if recorded(claim):
            start = "a start that `starts` draws" if answer.scene.at is None else "this start"
            how = f"for k of one run, drawn from a new recording's with k in K, from {start},"
        sure = f"in this scene, confidence {confidence_of(claim.premises)}"
        return f"Risk: a plan {how} fails with probability at most {most} {sure}: (V)."
    density = None if isinstance(risk, NoStatement) else density_of_k(answer)
    about = density, answer.coverage.confidence, claim.premises
    drawn = f"all that the corridors hold{in_box(answer.scene.box_of_k)}"
    text = about_risk(risk, drawn, *about)
    if uncertainty is None:
        return text
    if uncertainty.sensing_eps:
        text = f"{text} {about_sensing(risk, uncertainty.sensing_eps)}"
    elif density is not None:  # else the density of the executed k may be any
        text = f"{text} Errors of its execution, if any, must not depend on the plan."
    return text


def density_of_k(answer: "Answer") -> float:
    """Upper bound W of the density of k, relative to uniform on K, of a plan drawn by
    `Answer.sample`; infinite where nothing bounds it. [T34]

    Per unit of k a bin offers at most the box of end points in the goal less its error; `sample`
    spreads over all that the corridors hold, whose volume is at least the lower bound of the safe
    set's times the covered share.
    """
    volume = answer.cover.safe_volume(CONFIDENCE)
    if volume is None:
        return np.inf
    held = volume[1] * answer.coverage.at_least
    if not held > 0:
        return np.inf
    scene, uncertainty = answer.scene, answer.scene.nominal.uncertainty
    ends = 1.0
    if scene.at is None:  # else k alone is drawn
        least, most = answer.model.tube.end_extent
        with np.errstate(invalid="ignore"):  # bins without claim are NaN
            sides = (scene.z_hi - most) - (scene.z_lo - least)
            ends = np.nanmax(np.prod(np.maximum(sides, 0), axis=1))
    k_volume = answer.model.domain.volume if uncertainty is None else uncertainty.k_volume
    return max(1.0, float(k_volume * ends / held))  # below 1 by bad luck with the volume alone
