"""Claims next to what their runs show, with premises next to those: both checkers must refuse, or
accept, the same, and print the same of them.
"""

import json
from fractions import Fraction

import answer_files as build
import known
import two
from two_readers import ODD

from parc_jax import checker
from parc_jax.learning.bound.counts import required_runs

EPS, DELTA = ("1/1000", "1/20", "0.3", "0.0123"), ("1/1000", "1/20", "1e-9")
STANDINGS = ("checked", "measured", "assumed", "proved")
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
    answer = known.plain() if many == 1 else known.claim_of_bins(*blocks)
    claim = answer["claim"]
    claim |= {"eps": str(eps), "delta": str(delta), "looks": looks}
    if many == 1:
        claim |= blocks[0]
    else:
        claim["bin_eps"] = [rng.choice([str(eps), None]) for _ in claim["bin_eps"]]
    part = rng.choice([claim, claim, claim["evidence"], blocks[0]])
    if rng.random() < 0.7:
        claim["premises"] = premises(rng, claim, blocks)
        part = rng.choice([part, part, {}])
    if part and rng.random() < 0.4:
        name = rng.choice(sorted(part))
        if rng.random() < 0.3:
            del part[name]
        else:
            part[name] = rng.choice(ODD)
    return json.dumps(build.rehash(answer))


def premises(rng, claim, blocks):
    """What follows from the numbers of a claim of these blocks, and more; perhaps changed."""
    each, bins = "", []
    if claim["bin_eps"] is not None:
        claimed = sum(eps is not None for eps in claim["bin_eps"])
        each, bins = " or more in each", [("bins", f"{claimed} of 2 with a claim")]
    numbers = [(name, str(Fraction(claim[name]))) for name in ("eps", "delta")]
    numbers += [("n", f"{min(block['n'] for block in blocks)} runs{each}")]
    numbers += [("discards", max(block["discard"] for block in blocks))]
    stated = [[name, "checked", x] for name, x in [*numbers, ("looks", claim["looks"]), *bins]]
    more = [rng.choice(TEXTS), rng.choice(STANDINGS[1:3]), rng.choice([*TEXTS, 7, ["a", [1, "b"]]])]
    stated += [more, ["IID()", "assumed", ""]]
    for _ in range(rng.choice([0, 0, 0, 1, 2])):
        entry = rng.choice(stated)
        place = rng.randrange(5)
        if place == 4:
            stated.insert(rng.randrange(len(stated)), rng.choice(stated))
        elif place == 3:
            stated.remove(entry)
        else:
            choices = (TEXTS, STANDINGS, (*ODD, *TEXTS))[place]
            entry[place] = rng.choice(choices)
    return stated


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
