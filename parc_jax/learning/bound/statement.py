"""Sentences of a claim, printed from its premises: never more than was shown."""

from fractions import Fraction
from typing import TYPE_CHECKING

from parc_jax.checker import Rejected
from parc_jax.checker.claim import PART, set_of, stated_premises
from parc_jax.common.errors import InputError
from parc_jax.common.premises import ASSUMED, CHECKED, MEASURED, Premises, premises
from parc_jax.common.spelling import counted, exact, rounded_down, rounded_up

if TYPE_CHECKING:
    from parc_jax.learning.bound.claim import ErrorClaim

VALIDATED = "validated"  # kind of a claim about one set in one scene
AS_RECORDED = ", and run as one run that is drawn from a new recording"
# beside plans, by the kind of their claim: of tubes of which no run showed that runs stay inside
UNSHOWN = {
    VALIDATED: " under a tube that runs may leave",
    "assumed": " under an assumed tube",
    "declared": " under a declared tube",
}
EACH = " or more in each"  # block of bins with a claim
DIGITS = 10  # of the numbers of a claim, at most


def premises_of(c: "ErrorClaim") -> Premises:
    """Premises of the sentences of a claim. Both checkers compute the checked ones anew."""
    shown = _SHOWN[c.kind](c)
    more = [
        ("box", MEASURED, c.law.box),
        ("lasts", MEASURED, f"{exact(c.subject.time.t_f)} s"),
        ("open bins", MEASURED, f"{int((~c.tube.claimed).sum())} of {c.tube.n_bins}"),
    ]
    if c.bin_eps is not None:
        of = "of the model's claim, of whose tube this one is made"
        where = of if "network_of_runs" in c.evidence else "in which runs were counted"
        n = len(c.evidence["blocks"])
        more.append(("blocks", MEASURED, f"{n} block{'s' * (n > 1)} {where}"))
    try:
        return premises([*shown, *more, *stated_premises(c.facts())])
    except Rejected as why:
        raise InputError(f"claim: expected fields that a sentence can state; {why}.") from None


def about_open_bins(p: Premises) -> list[str]:
    """That no plan is safe in bins without a claim, a sentence; none where each has one."""
    told = f"{p['open bins']} bins of K have no claim: no plan there can be shown safe."
    return [] if p["open bins"].startswith("0 ") else [told]


def statement(p: Premises) -> str:
    """The sentences of the premises of a claim."""
    without, of = p["open bins"].split(" of ")
    if without == of:
        n, many = count_of(p)
        return (
            f"No claim: {_failed(p)} of {n:,} {many} failed, with {p['discards']} discards "
            "fixed beforehand, so no finite tube holds. Repair the system, shrink K, or calibrate "
            f"on new {many} with more discards."
        )
    sentences = [_pac(p) if "eps" in p else _in_scene(p) if "risk" in p else str(p["tube"])]
    if without != "0":
        sentences.append(f"{without} of {of} bins of {p['box']} have no claim.")
    return " ".join([*sentences, assumes(p)])


def assumes(p: Premises) -> str:
    """The sentence that ends all others: the assumptions."""
    assumed = [e for e in p if e.standing == ASSUMED and e.name not in ("tube", "law")]
    ledger = [f"{entry.name}({entry.value})" if entry.value else entry.name for entry in assumed]
    return f"Assumes: {', '.join(ledger)}."


def in_box(box: str, words: str = " with k in ") -> str:
    """The box of k that plans are of, by its name; empty for K, which is that of all."""
    return "" if box == "K" else f"{words}{box}"


def in_short(c: "ErrorClaim") -> str:
    """The claim about a tube in a few words, for pictures."""
    p = c.premises
    if c.kind == VALIDATED:
        return "of a validated set: runs may leave it"
    if "eps" not in p or "not drawn" in p:
        return f"{'of runs that nobody drew' if 'eps' in p else c.kind}, not shown"
    without, of = map(int, p["open bins"].split(" of "))
    claimed = f"{of - without} of {of} bins of {p['box']} with a claim"
    where = claimed if without else f"all of {p['box']}"
    # of a part of the law's box the probability is that of all runs, not of those with k there
    how = f"k {p['k']}" + f", in {where}" * ("bins" in p or not p["k"].endswith(PART))
    how = f"k drawn uniformly from {where}" if p["k"] == "uniform on K" else how
    by = f"by one run of a new recording, {how}" if "rows" in p else f"by a run, {how}"
    return f"left with probability ≤ {probability(p['eps'])} {by}, confidence {confidence_of(p)}"


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


def _unshown(c: "ErrorClaim") -> list[tuple]:
    tube = f"DECLARED, not shown here: that no run leaves the tube, because {c.quantifier}."
    if c.kind == "assumed":
        tube = (  # the law of a log says where failed runs are not in it at all
            "ASSUMED, not shown: that no run leaves the tube. It is the largest error over the "
            f"{c.n:,} training rollouts that did not fail ({c.discard:,} failed), of "
            f"{c.law.describe()}, the statistic of the published method; new rollouts are known to "
            "leave such a tube."
        )
    n = f"{c.n} {c.unit.many}"
    return [("tube", ASSUMED, tube), ("n", MEASURED, n), ("discards", MEASURED, c.discard)]


def _validated(c: "ErrorClaim") -> list[tuple]:
    known = c.evidence
    of = "the error shape" if known.get("shape") else "that"
    tube = f"{of} of the claim {known['of'][:12]} scaled by {known['scale']}"
    tube += f", on the way by {known['way']} of that" if "way" in known else ""
    tube += "; runs may leave it"
    tried = ", ".join(f"{scale} ({failed} of {n})" for scale, n, failed in known["steps"])
    numbers = {"risk": str(c.eps), "delta": str(c.delta), "n": f"{c.n} {c.unit.many}"}
    numbers |= {"failed of them": c.discard, "set": set_of(known)}
    by_word = [("tests", MEASURED, known["tests"]), ("scales", MEASURED, tried)]
    shown = [(name, CHECKED, x) for name, x in numbers.items()]
    return [("tube", ASSUMED, tube), *shown, *by_word]


_SHOWN = {"pac": _shown, "assumed": _unshown, "declared": _unshown, VALIDATED: _validated}


def _pac(p: Premises) -> str:
    eps = probability(p["eps"])
    tube = "the tube" + " of the model's claim about all its parameters" * ("not drawn" in p)
    by_bin = f" (the largest of {p['blocks']}, {p['n']})" if "bins" in p else ""
    n, many = count_of(p)
    behind = f"{n:,} calibration {'rollouts' if many == 'runs' else many}"
    if "rows" in p:
        behind += f" (of {p['rows']:,} runs)"
    asked = ""
    if "eps asked" in p:
        asked = f" ({p['eps asked']} was asked; {n:,} {many} do not support it.)"
    return (
        f"With confidence {confidence_of(p)} over the {behind}, {p['law']} leaves {tube} at any "
        f"time in its {p['lasts']} with probability at most {eps}{by_bin}, in every environment."
        f"{asked} {_counts(p)} {_chosen(p)} For a single hand-picked k: no probabilistic statement."
    )


def _in_scene(p: Premises) -> str:
    """Of a validated set. [T42]"""
    n, _ = count_of(p)
    seen = f"{n:,} of {p['tests']:,}"
    if "recordings" in p:
        tests = (
            f"{seen} held-out recordings ({p['recordings'][:12]}) had such a plan in it ("
            f"{p['set']}; none without k in K), and at most {p['failed of them']:,} of these failed"
        )
    else:
        tests = (
            f"{seen} plans drawn from the largest of some nested sets lay in this one "
            f"({p['set']}), and {p['failed of them']:,} of their runs failed"
        )
    return (
        f"With confidence {confidence_of(p)}, {p['law']}, fails (misses the goal, touches "
        f"something in its {p['lasts']}, or does not return) with probability at most "
        f"{probability(p['risk'])}: "
        f"{tests}. Tested in falling order of scale, of which each passed (failed of those "
        f"inside): {p['scales']}. The tube is {p['tube']}. Nothing is said of a plan that is "
        "picked by hand or by a search, of another scene, or of a second try on this one."
    )


def _counts(p: Premises) -> str:
    """Failed runs, discards and looks, with the rows left out before."""
    _, many = count_of(p)
    looks = f"; delta is shared by {p['looks']} looks" if p["looks"] > 1 else ""
    gaps = ""
    if "left out" in p:
        gaps = f" Before that {counted(p['left out'], 'row')} beside theirs had been left out."
    # the law has the numbers of a box of which plans choose from a part, and calls that part K
    box = f"K, a part of {p['box']}," if p["k"].endswith(PART) and p["box"] != "K" else p["box"]
    return (
        f"{box} = {p['K']}. Of these {many} {_failed(p)} failed; discards, fixed "
        f"beforehand: {p['discards']:,}{' at most in each block' * ('bins' in p)}{looks}.{gaps}"
    )


def _chosen(p: Premises) -> str:
    """The promise for k from a certified set; shares are probabilities for uniform k. [T5]"""
    if "not drawn" in p:
        return f"Of this tube, which is of runs with {p['not drawn']}, which nobody drew: nothing."
    eps = probability(p["eps"])
    how = (
        f"{p['k']}, whenever it falls into a certified set that it falls into with probability s, "
        "which need not be the set's share of K"
    )
    if p["k"] == "uniform on K":
        how = f"uniformly at random from a certified set of share s of {p['box']}"
    if "rows" in p:  # of recordings
        how += (
            " (s and risk are those of one run, drawn from a new recording; of all runs together, "
            "of which some recordings may have more than others: nothing)"
        )
    return f"For k drawn {how}: at most {eps}/s."


def _failed(p: Premises) -> str:
    stated = "failed" in p and isinstance(p["failed"], int)
    return f"{p['failed']:,}" if stated else "an unstated number"


def count_of(p: Premises) -> tuple[int, str]:
    """Number and name of the independent units."""
    n, many = p["n"].removesuffix(EACH).split(" ", 1)
    return p["all"] if "all" in p else int(n), many


def probability(text: str, digits: int = DIGITS) -> str:
    """A bound of a premise for people, never below it."""
    return rounded_up(Fraction(text), digits)


def confidence_of(p: Premises) -> str:
    """One less delta, never above it."""
    return rounded_down(1 - Fraction(p["delta"]), DIGITS)
