"""Claims next to what their runs show: both checkers must refuse, or accept, the same, and say of
the same that nobody looked.

"""

import json
from fractions import Fraction

import answer_files as build
import known
from two_readers import ODD

from parc_jax import checker
from parc_jax.claim.counts import required_runs

EPS, DELTA = ("1/1000", "1/20", "0.3", "0.0123"), ("1/1000", "1/20", "1e-9")
UNCHECKED = "arithmetic was not checked"


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
    if part and rng.random() < 0.4:
        name = rng.choice(sorted(part))
        if rng.random() < 0.3:
            del part[name]
        else:
            part[name] = rng.choice(ODD)
    return json.dumps(build.rehash(answer))


def batch(rng, left, valid=None):
    """So many claims."""
    for number in range(left):
        yield number, claimed(rng)


def looked(lines):
    """Whether these words say that the claim's numbers were looked at, or that it has none."""
    return not any(UNCHECKED in line for line in lines)


def judge(what, text, said):
    """Whether it is accepted, and whether somebody looked."""
    try:
        python = True, looked(checker.summary(checker.check_answer(json.loads(text))))
    except checker.Rejected:
        python = False, True
    same = python == (said["code"] == 0, looked(said["lines"]))
    yield python[0], None if same else json.loads(text)["claim"]
