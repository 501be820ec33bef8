"""Claims next to what their runs show, with fields that state what they rest on: both checkers must
refuse, or accept, the same, and print the same of them.
"""

import copy
import json
from fractions import Fraction

import answer_files as build
import known
import two
from two_readers import ODD

from parc_jax import checker
from parc_jax.learning.bound.counts import required_runs

EPS, DELTA = ("1/1000", "1/20", "0.3", "0.0123"), ("1/1000", "1/20", "1e-9")
TIMES = (["0.05"], ["1/20", "1"], ["0.5"], [], *3 * [["0.05", "1", "1/20"]], ["1/20", "1", "0"])
NUMBERED = [*known.NUMBERED["assumptions"], known.SLOW, "DISCRETE_TIME(h = 0.05 s)"]
NUMBERED += [one.replace("5", "6") for one in NUMBERED] + [
    one.replace("1", "x") for one in NUMBERED
]
TEXTS = ("", "x" * 499, "\u00e9" * 126, "\n\x1b\\", "\U0001f600 \ud800", "1/1000", "IID")


def claimed(rng):
    """A small answer whose claim has about as many runs as it needs, perhaps with an odd field."""
    eps, delta = Fraction(rng.choice(EPS)), Fraction(rng.choice(DELTA))
    looks, many = rng.choice([1, 1, 3]), rng.choice([1, 1, 2, 5])
    blocks = []
    for _ in range(many):
        discard = rng.choice([0, 0, 1, 7, 300])
        needed = required_runs(float(eps), float(delta / looks / many), discard)
        n = needed + rng.choice([0, 0, 0, 0, -1, 5])
        blocks.append({"n": n, "discard": discard, "eps": str(eps)})
    if many == 1 and rng.random() < 0.2:
        return json.dumps(build.rehash(tested(rng)))
    answer = known.plain() if many == 1 else known.claim_of_bins(*blocks)
    claim = answer["claim"]
    claim |= {"eps": str(eps), "delta": str(delta), "looks": looks}
    if many == 1:
        claim |= blocks[0]
    else:
        claim["bin_eps"] = [rng.choice([str(eps), None]) for _ in claim["bin_eps"]]
    part = rng.choice([claim, claim, claim["evidence"], blocks[0]])
    if rng.random() < 0.7:
        facts = stated(rng, claim)
        part = rng.choice([part, {}, facts, claim["evidence"], claim["subject"], facts["law"]])
    if part and rng.random() < 0.4:
        name = rng.choice(sorted(part))
        if rng.random() < 0.3:
            del part[name]
        else:
            part[name] = rng.choice(ODD)
    return json.dumps(build.rehash(answer))


def tested(rng):
    """Of a set that was tested, maybe with something odd, or other corridors."""
    answer = rng.choice([known.tested, known.tested_by_recordings])()
    claim = answer["claim"]
    part = rng.choice([claim, claim["evidence"], claim["evidence"], claim["evidence"]["steps"][1]])
    name = rng.choice(sorted(part)) if part is not claim["evidence"]["steps"][1] else 0
    if rng.random() < 0.5:
        part[name] = rng.choice([*ODD, 1, 2, 400])
    more = rng.choice([1, 1, 1, 0, 2])
    answer["corridors"] = more * answer["corridors"]
    return answer


def stated(rng, claim):
    """Gives a claim all that it may state, of every kind of text; returns the claim."""
    domain = {"lo": [rng.choice(["-1", "-0x1p+0", "-2/2"])], "hi": [rng.choice(["1", "1e0", "2"])]}
    law = {"k_law": rng.choice(["uniform", "logged", "given", *TEXTS])}
    claim |= {
        "quantifier": rng.choice([*TEXTS, *4 * [known.FACTS["quantifier"], known.OF_BINS]]),
        "subject": {"domain": domain, "time": rng.choice(TIMES)},
        "law": rng.choice([law, *3 * [copy.deepcopy(known.LAW)]]),
        "assumptions": rng.choices(
            [*TEXTS, "A(b)", "A(", "(a))", ")", *3 * [f"UNSEEN({claim['looks']} look"], *NUMBERED],
            k=rng.randrange(4),
        ),
        "intersample": known.NUMBERED["intersample"],
    }
    if rng.random() < 0.8:
        told = known.with_numbers()["claim"]["evidence"]
        claim["evidence"] |= {name: told[name] for name in ("lost", "start", "left_out")}
    claim["evidence"] |= {
        "failed": rng.choice([0, 0, 1, 9]),
        "recordings": rng.choice(TEXTS),
        "eps_asked": rng.choice(TEXTS),
        "not_drawn": rng.choices(TEXTS, k=rng.randrange(3)),
    }
    if rng.random() < 0.5:
        claim["evidence"]["rows"] = rng.choice([7, 10**9 - 1])
    return claim


def batch(rng, left, valid=None):
    """So many claims."""
    for number in range(left):
        yield number, claimed(rng)


def judge(what, text, said):
    """Whether it is accepted, with the same words about the tube."""
    try:
        python = two.about_the_tube(checker.summary(checker.check_answer(json.loads(text))))
    except checker.Rejected:
        python = None
    proved = two.about_the_tube(said["lines"]) if said["code"] == 0 else None
    yield python is not None, None if python == proved else json.loads(text)["claim"]
