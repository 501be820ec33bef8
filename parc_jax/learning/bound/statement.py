"""What a claim says, in sentences that never say more than was shown: all of it is printed from the
claim's premises.
"""

from fractions import Fraction
from typing import TYPE_CHECKING

from parc_jax.common.premises import ASSUMED, CHECKED, MEASURED, Premise, Premises, premises
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.bound.counts import RECORDED_ROWS

if TYPE_CHECKING:
    from parc_jax.learning.bound.claim import ErrorClaim

EACH = " or more in each"  # block of bins with a claim
DIGITS = 10  # of the numbers of a claim, at most


def premises_of(c: "ErrorClaim") -> Premises:
    """All that the sentences of a claim rest on. Both checkers compute the checked ones anew."""
    shown = _SHOWN[c.kind](c)
    k_law = {"uniform": "uniform on K", "logged": "as in the log"}
    measured = {
        "law": c.quantifier,
        "box": c.law.box,
        "K": " x ".join(f"[{a:.10g}, {b:.10g}]" for a, b in zip(*_corners(c), strict=True)),
        "k": k_law.get(c.law.k_law, c.law.how_drawn),
        "all": None if c.bin_eps is None else c.n,
        "failed": c.evidence.get("failed", 0),
        "open bins": f"{int((~c.tube.claimed).sum())} of {c.tube.n_bins}",
        "rows": c.evidence.get(RECORDED_ROWS),
        "recordings": c.evidence.get("recordings"),
        "left out": c.evidence.get("left_out"),
        "eps asked": c.evidence.get("eps_asked"),
        "not drawn": c.evidence.get("not_drawn") or None,
    }
    known = [(name, MEASURED, value) for name, value in measured.items() if value is not None]
    return premises([*shown, *known, *map(_assumption, c.assumptions)])


def statement(p: Premises) -> str:
    """The sentences of the premises of a claim."""
    without, of = p["open bins"].split(" of ")
    if without == of:
        n, many = _number(p)
        return (
            f"No claim: {p['failed']:,} of {n:,} {many} failed, with {p['discards']} discards "
            "fixed beforehand, so no finite tube holds. Repair the system, shrink K, or calibrate "
            f"on new {many} with more discards."
        )
    sentences = [_pac(p) if "eps" in p else str(p["tube"])]
    if without != "0":
        sentences.append(f"{without} of {of} bins of {p['box']} have no claim.")
    assumed = [entry for entry in p if entry.standing == ASSUMED and entry.name != "tube"]
    sentences.append(f"Assumes: {', '.join(map(_ledger, assumed))}.")
    return " ".join(sentences)


def in_short(c: "ErrorClaim") -> str:
    """What an `ErrorClaim` says of its tube, in the few words that a picture has room for."""
    p = c.premises
    if "eps" not in p:
        return f"{c.kind}, not shown"
    return f"left with probability ≤ {_eps(p)}, confidence {_confidence(p)}"


def _shown(c: "ErrorClaim") -> list[tuple]:
    checked = {
        "eps": str(c.eps),
        "delta": str(c.delta),
        "n": f"{c.n} {c.unit.many}",
        "discards": c.discard,
        "looks": c.looks,
    }
    if c.bin_eps is not None:
        claimed = sum(eps is not None for eps in c.bin_eps)
        least = min(block["n"] for block in c.evidence["blocks"])
        checked["n"] = f"{least} {c.unit.many}{EACH}"
        checked["bins"] = f"{claimed} of {len(c.bin_eps)} with a claim"
    return [(name, CHECKED, value) for name, value in checked.items()]


def _assumed(c: "ErrorClaim") -> list[tuple]:
    said = (
        "ASSUMED, not shown: that no run leaves the tube. It is the largest error over the "
        f"{c.n:,} training rollouts, the statistic of the published method; new rollouts are known "
        "to leave such a tube."
    )
    return [("tube", ASSUMED, said), *_unshown(c)]


def _declared(c: "ErrorClaim") -> list[tuple]:
    said = f"DECLARED, not shown here: that no run leaves the tube, because {c.quantifier}."
    return [("tube", ASSUMED, said), *_unshown(c)]


def _unshown(c: "ErrorClaim") -> list[tuple]:
    return [("n", MEASURED, f"{c.n} {c.unit.many}"), ("discards", MEASURED, c.discard)]


_SHOWN = {"pac": _shown, "assumed": _assumed, "declared": _declared}


def _pac(p: Premises) -> str:
    by_bin = " (the largest of them, each with its own)" if "bins" in p else ""
    n, many = _number(p)
    behind = f"{n:,} calibration {'rollouts' if many == 'runs' else many}"
    if "rows" in p:
        behind += f" (of {p['rows']:,} runs)"
    asked = ""
    if "eps asked" in p:
        asked = f" ({p['eps asked']} was asked; {n:,} {many} do not support it.)"
    return (
        f"With confidence {_confidence(p)} over the {behind}, {p['law']} leaves the tube at any "
        f"time with probability at most {_eps(p)}{by_bin}, in every environment.{asked} "
        f"{_counts(p)} {_chosen(p)} For a single hand-picked k: no probabilistic statement."
    )


def _counts(p: Premises) -> str:
    """What was counted and left out: numbers that were fixed, or seen, before the claim."""
    _, many = _number(p)
    looks = f"; delta is shared by {p['looks']} looks" if p["looks"] > 1 else ""
    gaps = ""
    if "left out" in p:
        gaps = f" Before that {p['left out']:,} rows between theirs were left out of the runs."
    return (
        f"{p['box']} = {p['K']}. Of these {many} {p['failed']:,} failed; discards, fixed "
        f"beforehand: {p['discards']:,}{looks}.{gaps}"
    )


def _chosen(p: Premises) -> str:
    """What it promises of k from a certified set; shares are probabilities for uniform k. [T5]"""
    if "not drawn" in p:
        return f"Of runs with chosen values of {', '.join(p['not drawn'])}: nothing more."
    if p["k"] == "uniform on K":
        return (
            f"For k drawn uniformly at random from a certified set of share s of {p['box']}: at "
            f"most {_eps(p)}/s."
        )
    return (
        f"For k drawn {p['k']}, whenever it falls into a certified set that it falls into with "
        f"probability s: at most {_eps(p)}/s. The share of K that the set fills says nothing: "
        "these runs may hardly visit some of K."
    )


def _assumption(entry: str) -> tuple[str, str, str]:
    """An identifier of the ledger, and what stands in its parentheses."""
    name, bracket, rest = entry.partition("(")
    return name, ASSUMED, rest.removesuffix(")") if bracket else ""


def _ledger(entry: Premise) -> str:
    """The same as the ledger has it."""
    return f"{entry.name}({entry.value})" if entry.value else entry.name


def _corners(c: "ErrorClaim") -> tuple:
    return c.domain.lo, c.domain.hi


def _number(p: Premises) -> tuple[int, str]:
    """How many of what is independent."""
    n, many = p["n"].removesuffix(EACH).split(" ", 1)
    return p["all"] if "all" in p else int(n), many


def _eps(p: Premises) -> str:
    return rounded_up(Fraction(p["eps"]), DIGITS)


def _confidence(p: Premises) -> str:
    return rounded_down(1 - Fraction(p["delta"]), DIGITS)
