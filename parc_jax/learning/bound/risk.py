"""From a claim about the calibration law to a promise about the k that will be driven. [T5]"""

from dataclasses import dataclass
from fractions import Fraction

from parc_jax.common.errors import InputError


@dataclass(frozen=True)
class Risk:
    """P(the run leaves the tube) <= bound, on the event that the claim holds (confidence 1 -
    delta). unconditional: bound + delta, the same without that condition.
    """

    bound: Fraction
    unconditional: Fraction


@dataclass(frozen=True)
class NoStatement:
    """The claim says nothing about this law; `reason` says why and what to do."""

    reason: str


def risk_of(eps: Fraction, delta: Fraction, density: Fraction, shift: float) -> Risk:
    """Density x eps + shift, capped at one. [T5]"""
    if not 0 <= shift <= 1:
        raise InputError(f"risk: expected a total variation between 0 and 1; got {shift}.")
    bound = min(Fraction(1), density * eps + Fraction(str(shift)))
    return Risk(bound, min(Fraction(1), bound + delta))


def density_of_share(share: float, whole: Fraction = Fraction(1)) -> Fraction:
    """whole / share for a share in (0, whole]. Raises InputError."""
    share = Fraction(str(share))
    if not 0 < share <= whole:
        raise InputError(
            f"risk: expected a share of K in (0, {float(whole):g}]; got {float(share):g}."
        )
    return whole / share
