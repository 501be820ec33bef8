"""What a claim rests on: whether so many runs show what it says of the tube [T1, T2, T4], and its
premises.

That the runs were made, are independent, and that discards and looks were fixed before any of them
was seen, is the file's word. That the numbers follow from each other is checked here, with integers
that are rounded against the claim; no other premise may be marked checked.
"""

from .exact import array, fields, integers, need, number, whole

SHOWN = "pac"  # the one kind of claim with evidence
NUMBERS = ("n", "discard", "looks", "eps", "delta", "bin_eps", "evidence")  # without: not checked
MAX_RUNS = 10**9 - 1  # in a block
MAX_DISCARDS = 1 << 20  # in all blocks together, and looks
BITS = 128  # of a rounded number, at least
ONE = 1 << BITS
MAX_SHIFT = 1 << 13  # beyond 2^-8192 a probability counts as that
CHECKED = "checked"
STANDINGS = (CHECKED, "measured", "assumed")  # of a premise
MAX_PREMISES = 500
MAX_LISTS = 3  # inside of each other, in the value of a premise
LONGEST = 500  # characters of a name or value that are printed


def checked_claim(claim, hashes, n_bins):
    """What is known of a claim: {"checked", "says", "premises"}, these as they must be marked
    checked, or None where it has no evidence. Rejects one that is about other parts than those with
    these hashes, whose numbers are wrong, or whose premises say more than is known.
    """
    if claim is None:
        return None
    need(claim["network_hash"] == hashes["network"], "the claim is about another network")
    need(claim["tube_hash"] == hashes["tube"], "the claim is about another tube")
    found = arithmetic_of(claim, n_bins) if claim.get("kind") == SHOWN else None
    if "premises" in claim:
        check_premises(claim["premises"], found["premises"] if found else [])
    return found


def arithmetic_of(claim: dict, n_bins: int):
    """As `checked_claim`, of a claim with evidence."""
    missing = [name for name in NUMBERS if name not in claim]
    if missing:
        return {"checked": False, "says": f"it lacks {', '.join(missing)}", "premises": []}
    by_bin, evidence = claim["bin_eps"], claim["evidence"]
    blocks, recorded = evidence.get("blocks"), "rows" in evidence
    if by_bin is None:
        blocks = [claim]
    elif blocks is None:
        why = "it is about bins, and lacks the runs of each block"
        return {"checked": False, "says": why, "premises": []}
    looks = whole(claim["looks"], 1, MAX_DISCARDS)
    eps, delta = probability(claim["eps"]), probability(claim["delta"])
    shown = [block_of(block, by_bin is not None) for block in blocks]
    discards = sum(discard for _, discard, _ in shown)
    need(discards <= MAX_DISCARDS, "the claim leaves out more runs than are counted")
    used = sum(looks * share(n, discard, some, delta) for n, discard, some in shown)
    need(used <= ONE, "the claim's runs do not show its eps with its delta")
    need(max(some for _, _, some in shown) <= eps, "a block's eps is larger than the claim's")
    many = "recordings" if recorded else "runs"
    least, most = min(shown)[0], max(discard for _, discard, _ in shown)
    counted, each, bins = f"{least} independent {many}", "", []
    if by_bin is not None:
        known = {some for _, _, some in shown}
        claimed = [probability(x) for x in array(by_bin, n_bins) if x is not None]
        need(known.issuperset(claimed), "a bin's eps is that of no block")
        counted = f"in {len(claimed)} of {n_bins} bins {counted} or more"
        each, bins = " or more in each", [("bins", f"{len(claimed)} of {n_bins} with a claim")]
    says = f"{counted}, {discards} left outside, {looks} looks, show eps = {eps} with delta = "
    numbers = [("eps", str(eps)), ("delta", str(delta)), ("n", f"{least} {many}{each}")]
    numbers += [("discards", most), ("looks", looks), *bins]
    premises = [[name, CHECKED, value] for name, value in numbers]
    return {"checked": True, "says": f"{says}{delta}", "premises": premises}


def check_premises(told: list, known: list):
    """Rejects premises that mark as checked what is not `known`, or leave any of that out, and
    those that nobody could print.
    """
    need(len(array(told)) <= MAX_PREMISES, "the claim has too many premises")
    for name, standing, value in told:
        need(type(name) is str, "the name of a premise is not a text")
        need(standing in STANDINGS, "a premise has an unknown standing")
        spelled(value)
    need(len({name for name, _, _ in told}) == len(told), "a premise is named twice")
    checked = [entry for entry in told if entry[1] == CHECKED]
    need(checked == known, "what the claim marks as checked is not what its numbers show")


def spelled(value: list | str | int, lists: int = 0):
    """The value of a premise, escaped."""
    if type(value) is list and lists < MAX_LISTS:
        return ", ".join(spelled(part, lists + 1) for part in value)
    need(type(value) in (str, int), "the value of a premise is no text, whole number or list of it")
    return str(value).encode("unicode_escape").decode()


def block_of(block, own):
    """(n, discard, eps) of one block, which is the claim itself where it is not about bins."""
    if own:
        fields(block, ("n", "discard", "eps"))
    n = whole(block["n"], 1, MAX_RUNS)
    return n, whole(block["discard"], 0, n), probability(block["eps"])


def probability(text):
    """The number that a text spells, above 0 and at most 1: of few runs a claim says no more."""
    p = number(text)
    integers([p])  # of bounded length
    need(0 < p <= 1, "a probability of the claim is not between 0 and 1")
    return p


def share(n, discard, eps, delta):
    """The part of delta that n runs with so many discards cost, in units of 2^-BITS, rounded up:

        sum_{i <= discard} C(n, i) eps^i (1 - eps)^(n - i) / delta.

    With odds = eps / (1 - eps) the sum is that of C(n, i) odds^i, divided by (1 + odds)^n. Both are
    at least 1, the first is rounded up and the second down, by less than 2^-90 of them. That at
    most all runs leave is true of any.
    """
    if eps == 1:
        return 0
    p, rest = eps.numerator, eps.denominator - eps.numerator
    top, up = ONE, 0  # top 2^(up - BITS): 1 + (n - i + 1)/i odds (...), from the innermost
    for i in range(discard, 0, -1):
        top = -(-top * (n - i + 1) * p // (i * rest)) + (ONE >> up) + 1
        extra = max(0, top.bit_length() - 2 * BITS)
        top, up = (top >> extra) + (extra > 0), up + extra
    low, down = ONE, 0  # low 2^(down - BITS): squares and products
    for bit in f"{n:b}":
        low, down = low * low >> BITS, 2 * down
        if bit == "1":
            low = low * (p + rest) // rest
        extra = max(0, low.bit_length() - 2 * BITS)
        low, down = low >> extra, down + extra
    shift = max(up - down, -MAX_SHIFT)
    above = top * delta.denominator << BITS + max(shift, 0)
    below = low * delta.numerator << max(-shift, 0)
    return -(-above // below)


def told(claim, arithmetic, hashes):
    """What the proof rests on, as lines: a claim, what `checked_claim` knows of it, and hashes."""
    premises = [] if arithmetic is None else arithmetic["premises"]
    if claim is None:
        yield "The proof rests on the tube, which is ASSUMED (no claim)."
    elif arithmetic is None:
        kind = claim.get("kind")
        kind = shortened(spelled(kind)) if type(kind) is str else "unknown"
        yield f"The proof rests on the tube, which is ASSUMED (kind {kind}):"
    elif not arithmetic["checked"]:
        yield "The proof rests on the tube, ASSUMED: the claim's arithmetic was not checked, since"
        yield f"  {arithmetic['says']}:"
    else:
        yield "The proof rests on the tube. That so many runs show this eps with this delta was"
        yield "  checked; what is not marked so is the file's word:"
    for name, standing, value in claim.get("premises", premises) if claim else ():
        named, value = shortened(spelled(name)), shortened(spelled(value))
        yield f"  {standing:8} {named}{': ' if value else ''}{value}"
    if claim is not None and "premises" not in claim:
        yield "  assumed  all else: the file states no premises of its claim"
    for part, value in hashes.items():
        yield f"  sha256 {part} {value}"


def shortened(text: str):
    """As much of a text as is printed."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}... ({len(text)} characters)"
