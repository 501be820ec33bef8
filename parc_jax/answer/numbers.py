"""What an answer is worth in numbers: the volume of the safe set, and what a plan drawn from it
risks.
"""

from typing import NamedTuple

import numpy as np

from parc_jax.answer.findings import Findings
from parc_jax.learning.bound.counts import NoStatement, Risk, clopper_pearson, least_probability
from parc_jax.safe_set.corridors.found import Cover

SHARE_CONFIDENCE = 0.99  # of the interval of the safe share
CONFIDENCE = 0.999  # of the safe set's volume, where a density rests on it


class SafeShare(NamedTuple):
    """What share of all plans that were asked about is safe, in the model with its tube: of all
    (p0, k) whose first point ends in the goal's box (missing what else the goal asks is not safe),
    or of all k in K where there is one start.

    share: estimate; at_least, at_most: Clopper-Pearson interval with `confidence`. reaching:
    estimate of the share that ends in the goal whatever error the tube holds, from a start that is
    allowed: what obstacles leave of it is share / reaching.
    """

    share: float
    at_least: float
    at_most: float
    reaching: float
    confidence: float


def safe_share(found: Findings) -> SafeShare | None:
    """As `Answer.safe_share`. Draws are uniform over a set of known volume, which is compared with
    that of all plans: one count of safe ones says both.
    """
    cover, whole = found.cover, found.whole
    volume = safe_volume(cover, SHARE_CONFIDENCE)
    if volume is None:
        return None
    share, at_least, at_most = (v / whole for v in volume)
    reaching = cover.volume * cover.reaching / cover.drawn / whole
    return SafeShare(share, at_least, at_most, reaching, SHARE_CONFIDENCE)


def safe_volume(cover: Cover, confidence: float) -> tuple[float, float, float] | None:
    """Estimate and Clopper-Pearson interval, as `Answer.volume`."""
    whole = cover.volume
    if not cover.drawn or not np.isfinite(whole):
        return None
    tail = (1 - confidence) / 2
    low = least_probability(cover.safe, cover.drawn, tail)
    high = float(clopper_pearson(cover.safe, cover.drawn, tail))
    return whole * cover.safe / cover.drawn, whole * low, whole * high


def density_of_k(found: Findings) -> float:
    """Upper bound W of the density of a drawn k, as explained at `Answer.density`. [T34]"""
    volume = safe_volume(found.cover, CONFIDENCE)
    if volume is None:
        return np.inf
    _, least, _ = volume
    union = least * found._held.at_least
    if not union > 0:
        return np.inf
    domain = found.model.domain
    whole = domain.volume if found.uncertainty is None else found.uncertainty.k_volume
    return float(whole * _ends_per_k(found) / union)


def _ends_per_k(found: Findings) -> float:
    """The most volume of end points that a k may have."""
    scene = found.scene
    if scene.at is not None:  # k alone is drawn
        return 1.0
    least, most = found.model.tube.end_extent
    with np.errstate(invalid="ignore"):  # bins without claim
        sides = (scene.z_hi - most) - (scene.z_lo - least)
        return np.nanmax(np.prod(np.maximum(sides, 0), axis=1))


def risk_of_draw(found: Findings) -> Risk | NoStatement:
    """What the claim promises for a plan drawn by `Answer.sample`. [T5, T18, T34]"""
    if not len(found.polytopes) and not len(found.corridors):
        return NoStatement("there is no safe set to draw k from")
    claim = found.model.claim
    promised = claim.risk(density=1.0)
    if isinstance(promised, NoStatement):
        return promised
    law = claim.law.k_law
    if law != "uniform":
        return NoStatement(f"the claim is about k drawn by {law!r}, not uniformly over K")
    density = density_of_k(found)
    if not np.isfinite(density):
        return NoStatement("how much of the safe set they cover was not measured")
    return claim.risk(density=density)
