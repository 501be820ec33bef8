"""The arithmetic of a claim: whether so many runs show what it says of the tube. [T1, T2, T4]

That the runs were made, are independent, and that discards and looks were fixed before any of them
was seen, is the file's word. That the numbers follow from each other is checked here, with integers
that are rounded against the claim.
"""

from .exact import array, fields, integers, need, number, whole

SHOWN = "pac"  # the one kind of claim with evidence
NUMBERS = ("n", "discard", "looks", "eps", "delta", "bin_eps", "evidence")  # without: not checked
MAX_RUNS = 10**9 - 1  # in a block
MAX_DISCARDS = 1 << 20  # in all blocks together, and looks
BITS = 128  # of a rounded number, at least
ONE = 1 << BITS
MAX_SHIFT = 1 << 13  # beyond 2^-8192 a probability counts as that


def checked_claim(claim, hashes, n_bins):
    """What is known of a claim: {"checked", "says"}, or None where it has no evidence. Rejects one
    that is about other parts than those with these hashes, or whose numbers are wrong.
    """
    if claim is None:
        return None
    need(claim["network_hash"] == hashes["network"], "the claim is about another network")
    need(claim["tube_hash"] == hashes["tube"], "the claim is about another tube")
    if claim.get("kind") != SHOWN:
        return None
    missing = [name for name in NUMBERS if name not in claim]
    if missing:
        return {"checked": False, "says": f"it lacks {', '.join(missing)}"}
    by_bin, evidence = claim["bin_eps"], claim["evidence"]
    blocks, recorded = evidence.get("blocks"), "rows" in evidence
    if by_bin is None:
        blocks = [claim]
    elif blocks is None:
        return {"checked": False, "says": "it is about bins, and lacks the runs of each block"}
    looks = whole(claim["looks"], 1, MAX_DISCARDS)
    eps, delta = probability(claim["eps"]), probability(claim["delta"])
    shown = [block_of(block, by_bin is not None) for block in blocks]
    discards = sum(discard for _, discard, _ in shown)
    need(discards <= MAX_DISCARDS, "the claim leaves out more runs than are counted")
    used = sum(looks * share(n, discard, some, delta) for n, discard, some in shown)
    need(used <= ONE, "the claim's runs do not show its eps with its delta")
    need(max(some for _, _, some in shown) <= eps, "a block's eps is larger than the claim's")
    many = "recordings" if recorded else "runs"
    counted = f"{shown[0][0]} independent {many}"
    if by_bin is not None:
        known = {some for _, _, some in shown}
        claimed = [probability(x) for x in array(by_bin, n_bins) if x is not None]
        need(known.issuperset(claimed), "a bin's eps is that of no block")
        counted = f"in {len(claimed)} of {n_bins} bins {min(shown)[0]} independent {many} or more"
    rest = f"{discards} left outside, {looks} looks"
    return {"checked": True, "says": f"{counted}, {rest}, show eps = {eps} with delta = {delta}"}


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
    claim = claim or {"kind": "no claim"}
    if arithmetic is None:
        yield "The proof rests on the tube, which is ASSUMED:"
    elif not arithmetic["checked"]:
        yield "The proof rests on the tube, ASSUMED: the claim's arithmetic was not checked,"
        yield f"  since {arithmetic['says']}. The file says of it:"
    else:
        yield "The proof rests on the tube, of which the file says (unchecked, but for this sum:"
        yield f"  {arithmetic['says']}):"
    yield f"  {ascii(claim.get('kind'))[:40]} {ascii(claim.get('statement'))[:2000]}"
    for part, value in hashes.items():
        yield f"  sha256 {part} {value}"
