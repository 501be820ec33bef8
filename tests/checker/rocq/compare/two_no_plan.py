"""Mutants of proofs that no plan exists and of volumes: both checkers must give the same verdict.

    python tests/checker/rocq/compare/two_no_plan.py --count 2000 [--seed 0]

Random scenes with the trees of tests/helpers/tree_search.py, and the hand-made ones of known.py.
"""

import argparse
import copy
import json
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3] / "helpers"))

import answer_files as build
import known
import tree_search
import two
import two_mutants

HAND_MADE = [name for name, make in known.VALID.items() if make()["no_plan"] is not None]
NAMES = ("goal", "start", "hit", "safe", "open")


def nodes(rng, plan, *names):
    """A random node of the tree with one of these names, by its only key, or IndexError."""
    found = [node for node in plan["tree"] if next(iter(node)) in (names or (*NAMES, "split"))]
    return rng.choice(found)


def rename(rng, plan):
    node = nodes(rng, plan)
    (what,) = node.values()
    node.clear()
    node[rng.choice(NAMES)] = what


def hit(rng, plan):
    return nodes(rng, plan, "hit")["hit"]


def odd_hit(rng, plan):
    place = rng.randrange(3)
    hit(rng, plan)[place] = [rng.randint(-1, 3), rng.randint(-1, 5), rng.choice("01")][place]


def copied(rng, plan):
    tree = plan["tree"]
    tree.insert(rng.randrange(len(tree) + 1), copy.deepcopy(rng.choice(tree)))


def other_axis(rng, plan):
    nodes(rng, plan, "split")["split"][0] = rng.randint(-1, 5)


MUTATIONS = {
    "nothing": lambda r, p: None,
    "a number": lambda r, p: two_mutants.shake(r, p["tree"]),
    "a cut": lambda r, p: two_mutants.shake(r, nodes(r, p, "split")),
    "an axis": other_axis,
    "a face": lambda r, p: two_mutants.shake(r, p["faces"]),
    "a row of a face": lambda r, p: r.choice(r.choice(r.choice(p["faces"]))).__setitem__(
        0, r.randint(-1, 7)
    ),
    "the box of z": lambda r, p: two_mutants.shake(r, p["z"]),
    "a reason": rename,
    "a hit": odd_hit,
    "a contact": lambda r, p: two_mutants.shake(r, hit(r, p)[3]),
    "a contact dropped": lambda r, p: two_mutants.drop(r, hit(r, p)[3]),
    "a combination": lambda r, p: two_mutants.shake(r, nodes(r, p, "goal", "start")),
    "a node dropped": lambda r, p: two_mutants.drop(r, p["tree"]),
    "a node copied": copied,
    "the kind": lambda r, p: p.update(kind=r.choice(["proved", "bracket", "likely"])),
}
QUESTIONS = ("obstacle moved", "body", "goal", "start", "network", "bias", "tube", "final", "edges")


def source(rng):
    """An answer with a part no_plan and nothing else."""
    if rng.random() < 0.2:
        return known.VALID[rng.choice(HAND_MADE)]()
    answer = build.scene(
        rng.randrange(10**6),
        T=4,
        hidden=(3,),
        bins=rng.choice([(1, 1), (2, 1), (2, 2)]),
        body=rng.choice([build.DISC, build.TRIANGLE]),
        starts=rng.random() < 0.5,
        counts=(0, 0, 0),
    )
    parts = [answer[part] for part in ("problem", "network", "tube")]
    return build.rehash(answer | {"no_plan": tree_search.grow(*parts, depth=5)})


def batch(rng, answer, count):
    """Mutants of one answer."""
    for _ in range(count):
        mutant = copy.deepcopy(answer)
        try:
            if rng.random() < 0.2:
                two_mutants.QUESTION[rng.choice(QUESTIONS)](rng, mutant)
            else:
                MUTATIONS[rng.choice(list(MUTATIONS))](rng, mutant["no_plan"])
        except (IndexError, AttributeError, TypeError):  # nothing of this kind to change
            continue
        yield build.rehash(mutant)


def campaign(program, count, seed):
    """(mutants compared, accepted by both, differences) of at least `count`."""
    proved, seen, accepted, different = two.Proved(program), 0, 0, []
    while seen < count:
        rng = random.Random(seed)
        texts = [json.dumps(mutant) for mutant in batch(rng, source(rng), 30)]
        for text, result in zip(texts, proved.verdicts(texts), strict=True):
            python = two.whole_verdict(text)
            seen += 1
            accepted += python is None
            if (python is None) != (result["code"] == 0):
                different.append((seed, python, result["lines"][0], text))
        seed += 1
    return seen, accepted, different


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--program", default=str(two.HERE.parent / "check"))
    arguments = parser.parse_args()
    seen, accepted, different = campaign(arguments.program.split(), arguments.count, arguments.seed)
    print(
        f"{seen} mutants, {accepted} accepted by the Python checker, {len(different)} differences"
    )
    for seed, python, proved, _ in different[:20]:
        print(f"  seed {seed}, Python: {python}; {proved}")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
