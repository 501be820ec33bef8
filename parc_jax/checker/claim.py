"""What a claim rests on: whether so many runs show what it says of the tube [T1, T2, T4], and its
premises, all of them from the claim's own fields.

That the runs were made, are independent, and that discards and looks were fixed before any of them
was seen, is the file's word. That the numbers follow from each other is checked here, with integers
that are rounded against the claim; no other premise is marked checked.
"""

import hashlib
import itertools
import json
import re
from fractions import Fraction
from typing import Any

from .entries import hash_of
from .exact import array, decimal, fields, integers, need, number, whole

SHOWN = "pac"  # the kind of claim whose runs show its tube
TESTED = "validated"  # the kind whose runs tested a set of plans in one scene
COUNTS = ("failed", "all", "rows", "left out")
NUMBERS = ("n", "discard", "looks", "eps", "delta", "bin_eps", "evidence")  # without: not checked
MAX_RUNS = 10**9 - 1  # in a block
MAX_DISCARDS = 1 << 20  # in all blocks together, and looks
BITS = 128  # of a rounded number, at least
ONE = 1 << BITS
MAX_SHIFT = 1 << 13  # beyond 2^-8192 a probability counts as that
CHECKED, MEASURED, ASSUMED = "checked", "measured", "assumed"  # the standings of a premise
K_LAW = {"uniform": "uniform on K", "logged": "as in the log", "given": "as it was given"}
NOT_STATED = "not stated"
LAW = ("generator", "parameters", "k_law", "lo", "hi")  # the fields of a law, beside its hash
OURS = "parc_jax:"  # begins names of parameters that no system declares
BOX = f"{OURS}box of k"  # the parameter that names the box, if not K
FITTED = f"{OURS}K"  # the parameter of a K that was fitted to logged k
PART = ", of which K is a part"  # ends a law of k on a larger box
DRAWN = "a plan drawn uniformly from this set"
OF_A_RECORDING = (
    "a plan whose k is that of a new recording for which this set has a start, one of 400 "
    "that are drawn so as to end in the goal, and whose p0 is the first such start"
)
FROM_ONE = (
    "a plan from ({}) m in the scene's frame whose k is that of a new recording for which this set "
    "has such a plan"
)
# Assumptions with numbers, and the fields of the evidence that have these.
UNSEEN, BETWEEN, STEPS = "UNSEEN", "INTERSAMPLE", "DISCRETE_TIME"
COUNTED = ("WORKERS_LOST", "LEFT_OUT")
TRIED = {"TRANSLATION_INVARIANCE": "seen", "ROTATION_INVARIANCE": "turned"}
# Fields that say so much of runs that an assumption stands beside them, or the file contradicts
# itself; and what any claim about runs rests on: where it is not stated, that is said.
IMPLIED = {
    "WORKERS_LOST": ("evidence", "lost"),
    "LEFT_OUT": ("evidence", "left_out"),
    "HIDDEN_START": ("subject", "given"),
    "ROTATION_INVARIANCE": ("subject", "rotation"),
}
SAME_LAW = "DEPLOYMENT_LAW = CALIBRATION_LAW"
ALWAYS = ("IID", "TRANSLATION_INVARIANCE", STEPS, SAME_LAW, "UNCHANGED_SYSTEM", UNSEEN)
STARTS = 8  # of a trial
NO_NUMBER = re.compile(r"[^0-9.,e+-]+")
MAX_PREMISES = 500  # assumptions of a claim
LONGEST = 500  # characters of a name or value that are printed


def checked_claim(claim, hashes, n_bins, domain=None, dt=None, corridors=None):
    """What is known of a claim: {"checked", "says", "premises"}; None where there is no claim.
    Rejects one that is about other parts than those with these hashes, another domain (lo, hi),
    time step [s] or set of corridors, or whose numbers are wrong.
    """
    if claim is None:
        return None
    need(claim["network_hash"] == hashes["network"], "the claim is about another network")
    need(claim["tube_hash"] == hashes["tube"], "the claim is about another tube")
    found, kind = not_checked(""), claim.get("kind")
    missing = [name for name in NUMBERS if name not in claim]
    if kind in (SHOWN, TESTED) and missing:
        found = not_checked(f"it lacks {', '.join(missing)}")
    elif kind == SHOWN:
        found = arithmetic_of(claim, n_bins)
    elif kind == TESTED:
        found = tests_of(claim, hashes.get("problem"), corridors)
    K = corners_of(claim)
    need(None in (K, domain) or K == domain, "the claim is about another domain")
    step = [number(x) for x in listed(at(claim, "subject"), "time")][:1]
    need(dt is None or step in ([], [dt]), "the claim is about another time step")
    return found | {"premises": [*found["premises"], *stated_premises(claim)]}


def not_checked(why: str) -> dict[str, Any]:
    """What is known of a claim whose arithmetic was not checked."""
    return {"checked": False, "says": why, "premises": []}


def tests_of(claim: dict, scene: str | None, corridors: list | None):
    """As `checked_claim`, of a set that was tested in its scene: nested sets, each of whose tests
    shows eps with delta, the last of them with the numbers of the claim. [T42]

    scene: hash of the problem, corridors: those of the file; None for a claim alone.
    """
    evidence = claim["evidence"]
    need(scene is None or at(evidence, "scene") == scene, "the set was tested in another scene")
    count, place = whole(at(evidence, "corridors"), 1, MAX_RUNS), at(evidence, "within")
    if corridors is not None:
        known = count, at(evidence, "set")
        # with the place that plans are drawn from, its sides as texts: together their law
        same = known == (len(corridors), hash_of([corridors, place]))
        need(same, "another set was tested than the corridors of this file")
    need(claim["bin_eps"] is None, "a tested set has no bins")
    whole(claim["looks"], 1, 1)
    eps, delta = probability(claim["eps"]), probability(claim["delta"])
    steps = [step_of(step) for step in listed(evidence, "steps")]
    pairs = list(itertools.pairwise(steps))
    need(all(number(a[0]) > number(b[0]) for a, b in pairs), "the scales of tests do not fall")
    nested = all(a[1] <= b[1] and a[2] <= b[2] for a, b in pairs)
    need(nested, "the sets that were tested are not nested")
    scale, n, failed = steps[-1]
    tests = whole(at(evidence, "tests"), n, MAX_RUNS)
    last = [at(evidence, "scale"), claim["n"], claim["discard"]]
    need(last == [scale, n, failed], "the claim's numbers are not those of its last test")
    need(sum(step[2] for step in steps) <= MAX_DISCARDS, "more runs failed than are counted")
    shown = all(share(n, failed, eps, delta) <= ONE for _, n, failed in steps)
    need(shown, "a test does not show the claim's eps with its delta")
    tried = ", ".join(f"{scale} ({failed} of {n})" for scale, n, failed in steps)
    ids = at(evidence, "tested")
    named = ids is None or (len(array(ids)), hash_of(ids)) == (tests, at(evidence, "recordings"))
    need(named, "other recordings were tested than the claim names")
    numbers = {"risk": eps, "delta": delta, "n": f"{n} {unit_of(claim)}", "failed of them": failed}
    numbers |= {"set": set_of(evidence)}
    premises = [[name, CHECKED, str(value)] for name, value in numbers.items()]
    premises += [["tests", MEASURED, str(tests)], ["scales", MEASURED, tried]]
    return {"checked": True, "says": f"{len(steps)} tests show it", "premises": premises}


def unit_of(claim: dict) -> str:
    """The independent units that a claim counts."""
    names = ("rows", "tested")
    recorded = any(at(claim, "evidence", name) is not None for name in names)
    return "recordings" if recorded else "runs"


def set_of(evidence: dict) -> str:
    """The set that was tested, in words."""
    n, where = evidence["corridors"], "" if evidence.get("within") is None else " around a search"
    return f"{n} corridor{'' if n == 1 else 's'}; {text(at(evidence, 'set'))[:8]}{where}"


def step_of(step):
    """(scale as text, n, failed) of one test."""
    scale, n, failed = step
    need(number(scale) > 0, "the scale of a test is not positive")
    return scale, n, whole(failed, 0, n)


def arithmetic_of(claim: dict, n_bins: int):
    """As `checked_claim`, of a claim with evidence."""
    by_bin, evidence, many = claim["bin_eps"], claim["evidence"], unit_of(claim)
    blocks = evidence.get("blocks")
    if by_bin is None:
        blocks = [claim]
    elif blocks is None:
        return not_checked("it is about bins, and lacks the runs of each block")
    n, failed = whole(claim["n"], 1, MAX_RUNS), at(evidence, "failed")
    failed = 0 if failed is None else whole(failed, 0, n)
    if failed and by_bin is None and failed > whole(claim["discard"], 0, n):
        return not_checked("more runs failed than are left outside")
    looks = whole(claim["looks"], 1, MAX_DISCARDS)
    eps, delta = probability(claim["eps"]), probability(claim["delta"])
    shown = [block_of(block, by_bin is not None) for block in blocks]
    discards = sum(discard for _, discard, _ in shown)
    need(discards <= MAX_DISCARDS, "the claim leaves out more runs than are counted")
    used = sum(looks * share(n, discard, some, delta) for n, discard, some in shown)
    need(used <= ONE, "the claim's runs do not show its eps with its delta")
    need(max(some for _, _, some in shown) <= eps, "a block's eps is larger than the claim's")
    need(max(shown)[0] <= n, "a block has more runs than the claim")
    least, most = min(shown)[0], max(discard for _, discard, _ in shown)
    need(whole(claim["discard"], 0, n) == most, "the claim's discards are not those of its blocks")
    counted, each, bins = f"{least} independent {many}", "", []
    if by_bin is not None:
        known = {some for _, _, some in shown}
        claimed = [probability(x) for x in array(by_bin, n_bins) if x is not None]
        need(known.issuperset(claimed), "a bin's eps is that of no block")
        where = "1 block" if len(shown) == 1 else f"{len(shown)} blocks"
        counted = f"in {where} with {len(claimed)} of {n_bins} bins {counted} or more"
        each, bins = " or more in each", [("bins", f"{len(claimed)} of {n_bins} with a claim")]
    says = f"{counted}, {discards} left outside, {looks} looks, show eps = {eps} with delta = "
    numbers = [("eps", str(eps)), ("delta", str(delta)), ("n", f"{least} {many}{each}")]
    numbers += [("discards", most), ("looks", looks), *bins]
    premises = [[name, CHECKED, str(value)] for name, value in numbers]
    return {"checked": True, "says": f"{says}{delta}", "premises": premises}


def stated_premises(claim: dict) -> list:
    """Entries [name, standing, value] of the fields of a claim beside its numbers: the file's word.
    What a sentence about runs needs and no field states is assumed, and said to be not stated.
    """
    pac, evidence = claim.get("kind") == SHOWN, claim.get("evidence")
    K, k_law, whole_law = corners_of(claim), at(claim, "law", "k_law"), checked_law(claim)
    box = [f"[{decimal(a)}, {decimal(b)}]" for a, b in zip(*K, strict=True)] if K else []
    needed = {
        "law": at(claim, "quantifier"),
        "K": " x ".join(box) or None,
        "k": None if k_law is None else how_drawn(text(k_law)),
        "failed": at(evidence, "failed"),
    }
    more = {
        "all": None if claim.get("bin_eps") is None else at(claim, "n"),
        "rows": at(evidence, "rows"),
        "recordings": at(evidence, "recordings"),
        "left out": at(evidence, "left_out"),
        "eps asked": at(evidence, "eps_asked"),
        "not drawn": ", ".join(map(text, listed(evidence, "not_drawn"))) or None,
    }
    found = []
    for name, value in (needed | more).items():
        if value is not None:
            value = whole(value, 0, MAX_RUNS) if name in COUNTS else text(value)
            by_word = name in ("law", "k") and not (whole_law and (pac or name == "k"))
            found.append([name, ASSUMED if by_word else MEASURED, value])
        elif name in needed and (pac or name != "failed"):
            found.append([name, ASSUMED, NOT_STATED])
    assumptions = listed(claim, "assumptions")
    need(len(assumptions) <= MAX_PREMISES, "the claim has too many assumptions")
    of_runs = claim.get("kind") in (SHOWN, TESTED)
    names = {text(x).partition("(")[0].replace(BETWEEN, STEPS) for x in assumptions}
    for name, path in IMPLIED.items() if of_runs else ():
        value = at(claim, *path)
        none = value is None or value == [] or (type(value) is int and value == 0)
        need(none or name in names, f"the claim's {path[-1]} comes without {name}")
    missing = [f"{name}({NOT_STATED})" for name in ALWAYS if of_runs and name not in names]
    for entry in [*assumptions, *missing] or [f"assumptions({NOT_STATED})"]:
        name, bracket, rest = text(entry).partition("(")
        known = rest == f"{NOT_STATED})" or has_its_numbers(claim, name, rest)
        need(known, f"the numbers of {name} are not the claim's")
        found.append([name, ASSUMED, rest.removesuffix(")") if bracket else ""])
    return found


def has_its_numbers(claim: dict, name: str, said: str) -> bool:
    """Are the numbers of an assumption, as it is said, those of the claim's fields? Where these are
    no whole numbers, to a hundred-thousandth: they are rounded for people.
    """
    if name not in (UNSEEN, BETWEEN, STEPS, *COUNTED, *TRIED):
        return True  # which no field has
    parts = (part.replace(",", "") for part in NO_NUMBER.split(said))
    told = [number(part) for part in parts if part[:1].isdigit()]
    known: list = []
    if name in TRIED:
        start = at(claim, "evidence", "start")
        known = [number(x) for x in (at(start, "gap"), at(start, TRIED[name])) if x is not None]
        known += [STARTS] if len(known) > 1 else []
    elif name in (UNSEEN, *COUNTED):
        count = claim.get("looks") if name == UNSEEN else at(claim, *IMPLIED[name])
        known = [count] if type(count) is int else []
    elif time := [number(x) for x in listed(at(claim, "subject"), "time")][2:]:
        if name == BETWEEN:  # a bound for each axis, or one for all of them
            terms = [number(x) for x in listed(claim, "intersample")]
            slow, h = said.startswith("speed"), time[0]
            known = [x * (2 / h if slow else 8 / h**2) for x in terms][: len(told) - 2 + slow]
            known += [] if slow else [2]  # of m/s^2
        known += time
    if len(told) != len(known):
        return False
    pairs = zip(told, known, strict=True)
    return all(a == b or (type(b) is Fraction and abs(a - b) <= abs(b) / 10**5) for a, b in pairs)


def checked_law(claim: dict) -> bool:
    """Does the claim state its law whole? Rejects one that is not about its K, has another hash, or
    is not in the words of a claim that was shown.
    """
    law, K = at(claim, "law"), corners_of(claim)
    if at(law, "hash") is None:
        return False
    fields(law, (*LAW, "hash"))
    need(law["hash"] == hash_of_law(law), "the law of the claim has another hash")
    for pair in array(law["parameters"]):
        for word in array(pair, 2):
            text(word)
    lo, hi = ([number(x) for x in array(law[side])] for side in ("lo", "hi"))
    if K is not None and not text(law["k_law"]).endswith(PART):
        need((lo, hi) == K, "the law of the claim is about another K")
    elif K is not None and len(lo) == len(K[0]):
        inside = zip(lo, *K, hi, strict=True)
        need(all(a <= b <= c <= d for a, b, c, d in inside), "K is no part of that of the law")
    if claim.get("kind") in (SHOWN, TESTED):
        same = text(claim.get("quantifier")) in words_of(claim, law)
        need(same, "the claim's words are about another law than its own")
    return True


def words_of(claim: dict, law: dict) -> list:
    """The words that a claim may have for its law."""
    said, recorded = described(law), unit_of(claim) == "recordings"
    if claim["kind"] == TESTED:
        start = ", ".join(decimal(number(x)) for x in listed(claim["evidence"], "at"))
        of_one = FROM_ONE.format(start) if start else OF_A_RECORDING
        drawn = f"{of_one}, run" if recorded else f"{DRAWN}, run afresh"
        return [f"{drawn} in this scene by {said}"]
    if claim.get("bin_eps") is not None:
        bins = ("bin", "bin"), ("block of bins", "block")
        of = f"of K, a new rollout drawn from {said} with k in that"
        return [f"in each claimed {several} {of} {one}" for several, one in bins]
    each = "any run of a new recording" if recorded else "a new rollout"
    fitted = any(name == FITTED for name, _ in law["parameters"])
    return [f"{each}{' whose k lies in K,' if fitted else ''} drawn from {said}"]


def hash_of_law(law: dict) -> str:
    """Of its fields."""
    only = {name: law[name] for name in LAW}
    return hashlib.sha256(json.dumps(only, sort_keys=True).encode()).hexdigest()


def described(law: dict) -> str:
    """A law in one phrase for people."""
    others = (pair for pair in law["parameters"] if pair[0] != BOX)
    more = "".join(f", {text(a).removeprefix(OURS)} = {text(b)}" for a, b in others)
    return f"{text(law['generator'])} (k {drawn(law)}{more}; {hash_of_law(law)[:8]})"


def drawn(law: dict) -> str:
    """How k is drawn, in words that follow "k"."""
    how = text(law["k_law"])
    if how == "uniform":
        return f"uniform on {dict(law['parameters']).get(BOX, 'K')}"
    return f"{'as' if how == 'logged' or how.startswith('given ') else 'by'} {how}"


def how_drawn(k_law: str) -> str:
    """The law of k, in words that follow "k"."""
    word = "as" if k_law.startswith("given ") else "by"
    return K_LAW.get(k_law, f"{word} {k_law}")


def corners_of(claim: dict) -> tuple | None:
    """(lo, hi) of the K of a claim, or None where it states none."""
    K = at(claim, "subject", "domain")
    if K is None:
        return None
    fields(K, ("lo", "hi"))
    lo, hi = ([number(x) for x in array(K[side])] for side in ("lo", "hi"))
    return lo, hi


def at(part: Any, *names: str):
    """A field inside of fields, or None where there is none."""
    for name in names:
        need(part is None or type(part) is dict, "a part of the claim is not an object")
        if part is None or name not in part:
            return None
        part = part[name]
    return part


def listed(part: Any, name: str) -> list:
    """A field that is a list, an empty one where there is none."""
    value = at(part, name)
    return [] if value is None else array(value)


def text(value: Any) -> str:
    """The value, if it is a text."""
    need(type(value) is str, "a premise of the claim is not a text")
    return value


def escaped(value: object) -> str:
    """The value of a premise, fit for a terminal."""
    value = str(value).encode("unicode_escape").decode()
    return value if len(value) <= LONGEST else f"{value[:LONGEST]}... ({len(value)} characters)"


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


def told(claim, known, hashes):
    """What the proof rests on, as lines: a claim, what `checked_claim` knows of it, and hashes."""
    if claim is None:
        yield "The proof rests on the tube, which is ASSUMED (no claim)."
    elif known["checked"] and claim.get("kind") == TESTED:
        yield "Runs may leave the tube. That each test of the set shows this risk with this delta"
        yield "  was checked; what is not marked so is the file's word:"
    elif claim.get("kind") not in (SHOWN, TESTED):
        kind = claim.get("kind")
        kind = escaped(kind) if type(kind) is str else "unknown"
        yield f"The proof rests on the tube, which is ASSUMED (kind {kind}):"
    elif not known["checked"]:
        yield "The proof rests on the tube, ASSUMED: the claim's arithmetic was not checked, since"
        yield f"  {known['says']}:"
    else:
        yield "The proof rests on the tube. That so many runs show this eps with this delta was"
        yield "  checked; what is not marked so is the file's word:"
    for name, standing, value in known["premises"] if known else ():
        yield f"  {standing:8} {escaped(name)}{': ' if value != '' else ''}{escaped(value)}"
    for part, value in hashes.items():
        yield f"  sha256 {part} {value}"
