"""What a claim says, in sentences that never say more than was shown."""

from typing import TYPE_CHECKING

from parc_jax.base.spelling import rounded_down, rounded_up
from parc_jax.claim.counts import RECORDED_ROWS

if TYPE_CHECKING:
    from parc_jax.claim.claim import ErrorClaim

DIGITS = 10  # of the numbers of a claim, at most


def statement(c: "ErrorClaim") -> str:
    """The sentences of an `ErrorClaim`."""
    if not c.tube.claimed.any():
        failed, many = c.evidence.get("failed", 0), c.unit.many
        return (
            f"No claim: {failed:,} of {c.n:,} {many} failed, with {c.discard} discards fixed "
            "beforehand, so no finite tube holds. Repair the system, shrink K, or calibrate on new "
            f"{many} with more discards."
        )
    sentences = [_HEAD[c.kind](c)]
    without = int((~c.tube.claimed).sum())
    if without:
        sentences.append(f"{without} of {c.tube.n_bins} bins of {c.law.box} have no claim.")
    sentences.append(f"Assumes: {', '.join(c.assumptions)}.")
    return " ".join(sentences)


def in_short(c: "ErrorClaim") -> str:
    """What an `ErrorClaim` says of its tube, in the few words that a picture has room for."""
    return _SHORTLY[c.kind](c)


def _behind(c: "ErrorClaim") -> str:
    """The independent runs that a claim rests on."""
    if RECORDED_ROWS in c.evidence:
        return f"{c.n:,} calibration {c.unit.many} (of {c.evidence[RECORDED_ROWS]:,} runs)"
    return f"{c.n:,} calibration rollouts"


def _eps(c: "ErrorClaim") -> str:
    return rounded_up(c.eps, DIGITS)


def _confidence(c: "ErrorClaim") -> str:
    return rounded_down(1 - c.delta, DIGITS)


def _short(c: "ErrorClaim") -> str:
    """What was asked for, where it is not what n supports."""
    asked = c.evidence.get("eps_asked")
    return f" ({asked} was asked; {c.n:,} {c.unit.many} do not support it.)" if asked else ""


def _pac(c: "ErrorClaim") -> str:
    by_bin = "" if c.bin_eps is None else " (the largest of them, each with its own)"
    return (
        f"With confidence {_confidence(c)} over the {_behind(c)}, {c.quantifier} leaves the tube "
        f"at any time with probability at most {_eps(c)}{by_bin}, in every environment.{_short(c)} "
        f"{_chosen(c)} For a single hand-picked k: no probabilistic statement."
    )


def _chosen(c: "ErrorClaim") -> str:
    """What it promises of k from a certified set; shares are probabilities for uniform k. [T5]"""
    if c.evidence.get("not_drawn"):
        return f"Of runs with chosen values of {', '.join(c.evidence['not_drawn'])}: nothing more."
    eps = _eps(c)
    if c.law.k_law == "uniform":
        return (
            f"For k drawn uniformly at random from a certified set of share s of {c.law.box}: at "
            f"most {eps}/s."
        )
    how = {"logged": "as in the log", "given": "as the calibration's k were given"}.get(
        c.law.k_law, f"by {c.law.k_law}"
    )
    return (
        f"For k drawn {how}, whenever it falls into a certified set that it falls into with "
        f"probability s: at most {eps}/s. The share of K that the set fills says nothing: these "
        "runs may hardly visit some of K."
    )


def _assumed(c: "ErrorClaim") -> str:
    return (
        "ASSUMED, not shown: that no run leaves the tube. It is the largest error over the "
        f"{c.n:,} training rollouts, the statistic of the published method; new rollouts are known "
        "to leave such a tube."
    )


def _declared(c: "ErrorClaim") -> str:
    return f"DECLARED, not shown here: that no run leaves the tube, because {c.quantifier}."


_HEAD = {"pac": _pac, "assumed": _assumed, "declared": _declared}
_SHORTLY = {
    "pac": lambda c: f"left with probability ≤ {_eps(c)}, confidence {_confidence(c)}",
    "assumed": lambda c: "assumed, not shown",
    "declared": lambda c: "declared, not shown",
}
