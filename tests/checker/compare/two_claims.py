"""Claims next to what their runs show: both checkers must refuse, or accept, the same, and say of
the same that nobody looked.

    python tests/checker/compare/two_claims.py --count 2000 [--seed 0]
    [--program "node parc_jax/checker/proved/js/run.js parc_jax/checker/proved/proved.js"]
"""

import argparse
import json
import random
import sys
from fractions import Fraction
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "helpers"))

import answer_files as build
import known
import two
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


def verdict(text):
    """(accepted, looked at the claim's numbers or had none to look at) by the Python checker."""
    try:
        report = checker.check_answer(json.loads(text))
    except checker.Rejected:
        return False, True
    return True, not any(UNCHECKED in line for line in checker.summary(report))


def campaign(program, count, seed):
    """(claims, accepted, those that the checkers differ on) of so many at random."""
    rng = random.Random(seed)
    texts = [claimed(rng) for _ in range(count)]
    python = [verdict(text) for text in texts]
    proved = [
        (said["code"] == 0, not any(UNCHECKED in line for line in said["lines"]))
        for said in two.Proved(program).verdicts(texts)
    ]
    different = [
        json.loads(text)["claim"]
        for text, one, other in zip(texts, python, proved, strict=True)
        if one != other
    ]
    return count, sum(accepted for accepted, _ in python), different


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--program", default=str(two.PROGRAM))
    asked = parser.parse_args()
    seen, accepted, different = campaign(asked.program.split(), asked.count, asked.seed)
    print(f"{seen} claims, {accepted} accepted, {len(different)} differences")
    for claim in different[:20]:
        print(f"  {claim}")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
