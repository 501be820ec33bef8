"""Campaigns: files by the thousand, of which both checkers must say the same.

    python tests/checker/compare/campaign.py mutants --count 20000 [--seed 0] [--answer answer.json]
    [--program "node parc_jax/checker/proved/js/run.js parc_jax/checker/proved/proved.js"]

CAMPAIGNS is the table. `make(rng, left, valid)` makes files, (what is known of one, text), perhaps
of the answer `valid`; `left` are still wanted. `judge(what, text, said)` gives for everything that
the proved checker says in a file whether it is accepted, and None or what differs. Seeds go up by
one for each batch, so a campaign that was stopped goes on with --seed.
"""

import argparse
import json
import random
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[2] / "helpers"))

import two
import two_bodies
import two_borders
import two_claims
import two_episodes
import two_mutants
import two_no_plan
import two_readers


class Campaign(NamedTuple):
    """option: of the program, which says what of a file it prints."""

    make: Callable
    judge: Callable
    option: str = "--each"


CAMPAIGNS = {
    # answers, entry by entry: with Python, with fractions, on borders between bins
    "mutants": Campaign(two_mutants.batch, two.by_entry),
    "bodies": Campaign(two_bodies.batch, two_bodies.judge),
    "borders": Campaign(two_borders.batch, two_borders.judge),
    # answers as a whole: proofs that there is no plan and volumes; claims; what is read
    "no_plan": Campaign(two_no_plan.batch, two.by_file),
    "claims": Campaign(two_claims.batch, two_claims.judge),
    "readers": Campaign(two_readers.odd_values, two.by_file),
    "changed_bytes": Campaign(two_readers.changed_bytes, two.by_file),
    "terms": Campaign(two_readers.reworded_files, two_readers.by_terms, "--read"),
    # episodes
    "episodes": Campaign(two_episodes.batch, two_episodes.judge),
}


class Found(NamedTuple):
    """How much was compared, how much of it was accepted, and the differences with their seeds."""

    seen: int
    accepted: int
    different: list


def campaign(name: str, program, count: int, seed: int = 0, valid=None) -> Found:
    """At least so many of a name, where its batches have as many."""
    make, judge, option = CAMPAIGNS[name]
    seen, accepted, different = 0, 0, []
    while seen < count:
        files = list(make(random.Random(seed), count - seen, valid))
        if not files:
            break
        said = two.proved_verdicts(program, [text for _, text in files], option)
        for (what, text), one in zip(files, said, strict=True):
            for good, difference in judge(what, text, one):
                seen += 1
                accepted += good
                different += [] if difference is None else [(seed, difference)]
        seed += 1
    return Found(seen, accepted, different)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", choices=CAMPAIGNS)
    parser.add_argument("--count", type=int, default=2_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--answer", type=Path, help="of this answer, where the campaign can")
    parser.add_argument("--program", default=str(two.PROGRAM))
    asked = parser.parse_args()
    valid = asked.answer and json.loads(asked.answer.read_text())
    found = campaign(asked.name, asked.program.split(), asked.count, asked.seed, valid)
    print(f"{found.seen} seen, {found.accepted} accepted, {len(found.different)} differences")
    for seed, difference in found.different[:20]:
        print(f"  seed {seed}: {difference}")
    return 1 if found.different else 0


if __name__ == "__main__":
    sys.exit(main())
