"""Counts and probabilities: how many runs a claim takes, how much a number of them supports, and
the risk of k drawn in a certain way. [T1, T2, T5, T6]
"""

import math
from bisect import bisect_left
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError, check_count, shown
from parc_jax.common.spelling import rounded_up

MOST = "most"  # discards: as many as the runs, eps and delta allow

# covers the rounding of the binomial tail and its inverse; always towards more runs or a larger eps
_OUTWARD = 1.0 + 1e-9
# the same of scipy's tail with discards, which is off by 1e-11 of itself
_TAIL_OUTWARD = 1.0 + 1e-7
FEW = 500  # trials, whose tail is summed here: scipy takes longer to load than a first query
SURE = 0.9  # probability, by what the training runs show, that so many discards suffice
MOST_SHARE = 0.1  # of the holdout, but for failed runs: a tube that more may leave is hardly one


class Unit(NamedTuple):
    """Independent unit, in words: runs or recordings. each: of a claim. many: of its count."""

    each: str
    many: str


RUNS = Unit("a new rollout", "runs")
RECORDINGS = Unit("any run of a new recording", "recordings")

RECORDED_ROWS = "rows"  # evidence of a claim about recordings: of how many runs they are
RECORDED_IDS = "tested"  # evidence of a claim of tests by recordings: the runs that were replayed


def wrong_claim_probability(n: int, eps: float, discard: int = 0) -> float:
    """Bound, rounded up, on P(more than eps of new runs leave) after n runs with discards. [T2]

    sum_{i <= discard} C(n, i) eps^i (1 - eps)^(n - i)
    """
    if n <= discard:
        return 1.0
    if discard == 0:
        return min(1.0, math.exp(n * math.log1p(-eps)) * _OUTWARD)

    from scipy.special import betaincc  # slower to load than much of what asks

    return min(1.0, float(betaincc(discard + 1, n - discard, eps)) * _TAIL_OUTWARD)


def required_runs(eps: float, delta: float, discard: int = 0) -> int:
    """Smallest n for (eps, delta); without discards ceil(ln delta / ln(1 - eps)). [T1, T2]"""
    _check(eps, delta, discard)
    high = max(2 * discard, 16)
    while wrong_claim_probability(high, eps, discard) > delta:
        high *= 2
    if high > 2**62:  # near the end of a range
        raise InputError(f"eps: expected one that fewer than 2^61 runs show; got {eps}.")
    return discard + bisect_left(
        range(discard, high), True, key=lambda n: wrong_claim_probability(n, eps, discard) <= delta
    )


def supported_eps(n: int, delta: float, discard: int = 0) -> Fraction | None:
    """The smallest eps that n runs support at 1 - delta, rounded up; None for none. [T1, T2]"""
    _check(0.5, delta, discard)
    if n <= discard:
        return None
    eps = -math.expm1(math.log(delta) / n)
    if discard:
        eps = float(clopper_pearson(discard, n, delta)) / _OUTWARD
    for _ in range(60):
        if eps >= 1.0:
            return None
        if wrong_claim_probability(n, eps, discard) <= delta:
            return Fraction(rounded_up(eps, 6))
        eps *= _TAIL_OUTWARD**2 if discard else _OUTWARD**2
    return None


def clopper_pearson(failures: int, n: int, delta: float) -> Fraction:
    """Upper bound, rounded up, with confidence 1 - delta on a probability of which n independent
    trials showed `failures`; 1 - delta^(1/n) for none. [T6] Raises InputError.
    """
    if not 0 <= failures <= n or n < 1:
        raise InputError(
            f"clopper_pearson: expected 0 <= failures <= n, n >= 1; got {failures} of {n}."
        )
    if failures == n:
        return Fraction(1)
    p = _rare_at(failures, n, delta) * _OUTWARD
    while n > FEW and p < 1.0 and wrong_claim_probability(n, p, failures) > delta:
        p *= _OUTWARD  # the inverse of scipy's tail is less exact than the tail
    return min(Fraction(1), Fraction(p))


def _rare_at(failures: int, n: int, delta: float) -> float:
    """The probability at which n trials show so few failures with probability delta."""
    if n > FEW:
        from scipy.special import betainccinv

        return float(betainccinv(failures + 1, n - failures, delta))
    ways = [math.comb(n, i) for i in range(failures + 1)]
    low, high = 0.0, 1.0
    while low < (p := (low + high) / 2) < high:
        tail = sum(w * p**i * (1 - p) ** (n - i) for i, w in enumerate(ways))
        low, high = (p, high) if tail > delta else (low, p)
    return high


def least_probability(successes: int, n: int, delta: float) -> float:
    """Lower bound, rounded down, at 1 - delta on a probability of `successes` in n trials. [T6]"""
    return math.nextafter(float(1 - clopper_pearson(n - successes, n, delta)), 0.0)


def most_discards(n: int, eps: float, delta: float) -> int:
    """The largest number of discards that n runs allow for (eps, delta); -1 when n is too small."""
    _check(eps, delta, 0)
    # the tail grows with the discards: the last number before it is too large
    return -1 + bisect_left(
        range(n), True, key=lambda discard: wrong_claim_probability(n, eps, discard) > delta
    )


def advised_discards(sizes: np.ndarray, n: int, delta: float) -> int:
    """Discards for a holdout of n independent runs, from the largest errors (m,) of runs that have
    no part in it, infinite for failed ones.

    They are taken where eps times the width that the tube then needs is least: a tube half as wide
    is worth twice the eps. At most MOST_SHARE of the holdout is discarded, and more only where no
    fewer surely leave a finite tube: as many fail, or m is so small that as many might.
    """
    best, least = 0, math.inf
    for discard in range(n):
        eps, width = supported_eps(n, delta, discard), width_needed(sizes, n, discard)
        if eps is None or (discard > MOST_SHARE * n and math.isfinite(least)):
            break
        if float(eps) * width < least:
            best, least = discard, float(eps) * width
    return best


def width_needed(sizes: np.ndarray, n: int, discard: int) -> float:
    """Least of sizes (m,) above all but `discard` of n runs with probability SURE, or infinite."""
    # one more run than observed may be beyond each size: a first failure must not end all plans
    from scipy.special import bdtr

    ordered = np.sort(sizes)
    beyond = np.arange(len(ordered), 0, -1) / (len(ordered) + 1)
    enough = bdtr(float(discard), n, beyond) >= SURE
    return float(ordered[np.argmax(enough)]) if enough.any() else math.inf


def as_fraction(name: str, told: Fraction | float | str) -> Fraction:
    """The decimal the user wrote. Raises InputError."""
    try:
        return Fraction(str(told))
    except (ValueError, ZeroDivisionError):  # nan, infinity, or no number
        raise InputError(f"{name}: expected a number; got {shown(told, 40)}.") from None


def as_probability(name: str, value: Fraction | float | str) -> Fraction:
    """The decimal the user wrote, as an exact fraction in (0, 1). Raises InputError."""
    if not 0 < (exact := as_fraction(name, value)) < 1:
        raise InputError(f"{name}: expected a probability strictly between 0 and 1; got {value}.")
    return exact


def _check(eps: float, delta: float, discard: int) -> None:
    as_probability("eps", eps)
    as_probability("delta", delta)
    check_count("discard", discard, 0, "0 runs to leave outside")


@dataclass(frozen=True)
class Risk:
    """P(the run leaves the tube) <= bound, on the event that the claim holds (confidence 1 -
    delta). unconditional: bound + delta, the same without that condition; of an answer also
    with what its density may be measured wrongly by.
    """

    bound: Fraction
    unconditional: Fraction


@dataclass(frozen=True)
class NoStatement:
    """No statement about this law, with the reason and a remedy."""

    reason: str


def risk_of(eps: Fraction, delta: Fraction, density: Fraction, shift: float) -> Risk:
    """Density x eps + shift, capped at one. [T5]"""
    if not 0 <= (shift := as_fraction("shift", shift)) <= 1:
        raise InputError(f"risk: expected a total variation between 0 and 1; got {float(shift):g}.")
    bound = min(Fraction(1), density * eps + shift)
    return Risk(bound, min(Fraction(1), bound + delta))


def density_of(given: float | Fraction) -> Fraction:
    """A density as it was written. Raises InputError for one that no law of k has."""
    if not (given := as_fraction("density", given)) >= 1:
        raise InputError(
            f"risk: expected a density of 1 or more; got {float(given):g}. No law of k is "
            "everywhere less dense than the claim's."
        )
    return given


def density_of_share(share: float, whole: Fraction = Fraction(1)) -> Fraction:
    """whole / share for a share in (0, whole]. Raises InputError."""
    if not 0 < (exact := as_fraction("share", share)) <= whole:
        raise InputError(f"risk: expected a share of K in (0, {float(whole):g}]; got {share}.")
    return whole / exact
