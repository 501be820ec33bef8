"""Random mutants of valid certificates, and a judge of those that are accepted: the dense
oracle.
"""

import collections
import json
import random
from fractions import Fraction as F

import answer_files as build
import numpy as np
import oracle
import tree_search
from rows_of_sets import set_rows

from parc_jax import checker


def numbers(part, key=None):
    """(list, index) of all number strings below a part."""
    items = (
        part.items()
        if isinstance(part, dict)
        else enumerate(part)
        if isinstance(part, list)
        else ()
    )
    for place, child in items:
        if isinstance(child, str):
            if isinstance(part, list):
                yield part, place
        else:
            yield from numbers(child)


def shake(rng, part):
    """Changes one number below a part: a little, a lot, or its sign."""
    owner, place = rng.choice(list(numbers(part)))
    old = build.value(owner[place])
    near, far = build.dyadic(rng, F(1, 64)), build.dyadic(rng, 1)
    owner[place] = build.text(rng.choice([-old, old + far, old * 2, old + near, old - 3]))


def replace(rng, part, values):
    owner, place = rng.choice(list(numbers(part)))
    owner[place] = rng.choice(values)


def entry(rng, answer):
    return rng.choice(build.entries(answer))


def runs(rng, answer):
    return rng.choice(rng.choice(entry(rng, answer)["sep"]))


def run(rng, answer):
    return rng.choice(runs(rng, answer))


def shuffle(rng, part):
    rng.shuffle(part)


def drop(rng, part):
    part.pop(rng.randrange(len(part)))


def double(rng, part):
    part.insert(rng.randrange(len(part) + 1), json.loads(json.dumps(rng.choice(part))))


def set_item(part, key, new):
    part[key] = new


def flip(rng, piece):
    i = rng.randrange(len(piece["pattern"]))
    piece["pattern"] = (
        piece["pattern"][:i] + "10"[int(piece["pattern"][i])] + piece["pattern"][i + 1 :]
    )


def obstacle(rng, a):
    return rng.choice(a["problem"]["obstacles"])


SHAPES = [{"radius": "0.5"}, {"radius": "-0.1"}, build.TRIANGLE]
BODIES = [*map(build.one_part, SHAPES), {"parts": []}, {"radius": "0.5"}]
ODD = ["nan", "inf", "0x1p+1024", "1e999", "0/0", "", "1.", "--1", "0x", True, None, 3, [], {}]
KINDS = {
    "p0": lambda r, a: shake(r, entry(r, a)["p0"]),
    "k": lambda r, a: shake(r, entry(r, a)["k"]),
    "multiplier": lambda r, a: shake(r, run(r, a)[1]),
    "row": lambda r, a: set_item(r.choice(run(r, a)[1]), 0, r.randint(-2, 6)),
    "run end": lambda r, a: set_item(run(r, a), 0, r.randint(-1, 8)),
    "run dropped": lambda r, a: drop(r, runs(r, a)),
    "run doubled": lambda r, a: double(r, runs(r, a)),
    "runs swapped": lambda r, a: shuffle(r, runs(r, a)),
    "separation dropped": lambda r, a: drop(r, entry(r, a)["sep"]),
    "separations swapped": lambda r, a: shuffle(r, entry(r, a)["sep"]),
    "part dropped": lambda r, a: drop(r, r.choice(entry(r, a)["sep"])),
    "part doubled": lambda r, a: double(r, r.choice(entry(r, a)["sep"])),
    "pattern": lambda r, a: flip(r, r.choice(a["sets"])),
    "bin": lambda r, a: set_item(r.choice(a["sets"]), "bin", r.randint(-1, 3)),
    "not a number": lambda r, a: replace(r, entry(r, a), ODD),
    "entry doubled": lambda r, a: double(r, a[r.choice(build.KINDS)]),
    "sample for set": lambda r, a: a["sets"].append(a["samples"][0]),
    "set for corridor": lambda r, a: a["corridors"].append(a["sets"][0]),
    "unknown key": lambda r, a: set_item(a, r.choice(["note", "Samples"]), a["samples"]),
    "edge dropped": lambda r, a: drop(r, r.choice(a["tube"]["edges"])),
    "hash": lambda r, a: set_item(a["hash"], r.choice(["problem", "network", "tube"]), "0" * 64),
    # The next ones change the question, with correct hashes: old answers may be wrong now.
    "obstacle moved": lambda r, a: shake(r, obstacle(r, a)["b"]),
    "obstacle turned": lambda r, a: shake(r, obstacle(r, a)["A"]),
    "obstacle added": lambda r, a: double(r, a["problem"]["obstacles"]),
    "obstacle dropped": lambda r, a: drop(r, a["problem"]["obstacles"]),
    "steps": lambda r, a: set_item(obstacle(r, a), "steps", [r.randint(0, 3), r.randint(3, 6)]),
    "body": lambda r, a: set_item(a["problem"], "body", r.choice(BODIES)),
    "points": lambda r, a: set_item(a["problem"], "points", r.randint(0, 2)),
    "goal": lambda r, a: shake(r, a["problem"]["goal"]),
    "start": lambda r, a: shake(r, a["problem"]["start"]),
    "domain": lambda r, a: shake(r, a["problem"]["domain"]),
    "network": lambda r, a: shake(r, a["network"]["weights"][r.randrange(2)]),
    "bias": lambda r, a: shake(r, a["network"]["biases"]),
    "tube": lambda r, a: shake(r, a["tube"]["interval"]),
    "edges": lambda r, a: shake(r, a["tube"]["edges"]),
}


def inside(rows, x, rng):
    """A random point of a polytope of checker rows on a line through an inner point, in floats."""
    way = rng.normal(size=len(x))
    rows = np.array([[v / max(map(abs, [*a, 1])) for v in (*a, c)] for _, _, a, c in rows])
    speed, room = rows[:, :-1] @ way, rows[:, :-1] @ x + rows[:, -1]
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = -room / speed
    lo, hi = max(steps[speed > 0], default=-9.0), min(steps[speed < 0], default=9.0)
    return x + (lo + rng.uniform(0.01, 0.99) * (hi - lo)) * way


def judge(answer):
    """Asserts that samples and some members of sets and corridors are safe for the oracle; how many
    of corridors.
    """
    seen, rng = oracle.Oracle(answer), np.random.default_rng(1)
    for sample in answer["samples"]:
        assert seen.safe(build.value(sample["p0"]), build.value(sample["k"]))
    context, n, members = (
        checker.Context(*(answer[p] for p in checker.PARTS)),
        answer["problem"]["n_p"],
        0,
    )
    for piece in answer["sets"]:
        rows = set_rows(context, piece)
        centre = np.array(build.value(piece["p0"]) + build.value(piece["k"]), float)
        for x in (centre, inside(rows, centre, rng)):
            assert seen.safe(x[:n], x[n:])
    for corridor in answer["corridors"]:
        centre = np.array(build.value(corridor["p0"]) + build.value(corridor["k"]), float)
        for x in (centre, *(centre + rng.uniform(-0.3, 0.3, (6, len(centre))))):
            if keeps(context, corridor, x[:n], x[n:]):
                assert seen.safe(x[:n], x[n:])
                members += 1
    return members


def keeps(context, corridor, p0, k):
    """Whether the checker counts a plan in floats to a corridor."""
    try:
        context.check_sample(
            {"p0": build.text(list(p0)), "k": build.text(list(k)), "sep": corridor["sep"]}
        )
    except checker.Rejected:
        return False
    return True


PLAN_KINDS = {
    "number": lambda r, p: shake(r, p["tree"]),
    "z": lambda r, p: shake(r, p["z"]),
    "faces": lambda r, p: shake(r, p["faces"]),
    "node dropped": lambda r, p: drop(r, p["tree"]),
    "node doubled": lambda r, p: double(r, p["tree"]),
    "nodes shuffled": lambda r, p: shuffle(r, p["tree"]),
    "leaf renamed": lambda r, p: rename(r, p["tree"]),
    "kind": lambda r, p: set_item(p, "kind", "proved"),
    "by bounds": lambda r, p: bound(r, p["tree"]),
}


def rename(rng, tree):
    i = rng.randrange(len(tree))
    tree[i] = {rng.choice(["goal", "start", "hit", "safe"]): next(iter(tree[i].values()))}


def bound(rng, tree):
    """Says of a leaf at vertices that it holds by bounds, or the other way round."""
    i = rng.randrange(len(tree))
    ((name, what),) = tree[i].items()
    tree[i] = what if name == "bounded" else {"bounded": tree[i]}


def judge_plan(answer, rng, count):
    """Asserts that random points of safe leaves are safe and that random points of unsafe leaves
    are not.
    """
    seen, plan, n = oracle.Oracle(answer), answer["no_plan"], answer["problem"]["n_p"]
    root = [
        build.value(plan["z"][side] + answer["problem"]["domain"][side]) for side in ("lo", "hi")
    ]
    leaves = [leaf for leaf in tree_search.boxes(plan, *root) if leaf[0] != "open"]
    for name, lo, hi in rng.sample(leaves, min(count, len(leaves))):
        x = np.array(
            [
                float(a + (b - a) * F(rng.randrange(1, 1000), 1000))
                for a, b in zip(lo, hi, strict=True)
            ]
        )
        p0 = x[:n] - seen.path(np.zeros(n), x[n:])[0][-1]
        if name == "safe":
            assert seen.safe(p0, x[n:])
        else:
            knots, q = seen.path(p0, x[n:])
            assert any(
                seen.margin(knots, q, final) < 1e-6
                or seen.gap(knots, interval) < 0.01  # 4 mm between points
                for interval, final in seen.widths(x[n:])
            )


def scene(seed):
    """A small random answer with everything but a no_plan part."""
    body = build.DISC if seed % 2 else build.TRIANGLE
    return build.scene(seed, T=4, hidden=(3, 3), body=body)


def scene_of_plan(seed):
    """A small random answer with a no_plan part alone."""
    body = build.DISC if seed % 2 else build.TRIANGLE
    answer = build.scene(seed, T=4, hidden=(3,), body=body, counts=(0, 0, 0))
    parts = [answer[part] for part in checker.PARTS]
    return answer | {"no_plan": tree_search.grow(*parts, depth=5)}


def accepted(answer):
    try:
        checker.check_answer(answer)
    except checker.Rejected:
        return False
    return True


def check_mutants(seed, count) -> collections.Counter:
    """(kind, verdict) of so many mutants of one answer: "rejected", "accepted", or "false" for one
    that is accepted although the judge sees that it is not true.
    """
    rng, fresh, tally = random.Random(seed), json.dumps(scene(seed)), collections.Counter()
    for _ in range(count):
        answer, kind = json.loads(fresh), rng.choice(list(KINDS))
        KINDS[kind](rng, answer)
        if kind not in ("hash", "unknown key"):
            build.rehash(answer)
        tally[kind, _verdict(answer, fresh, judge)] += 1
    return tally


def check_plan_mutants(seed, count) -> collections.Counter:
    """The same of mutants of one no_plan part."""
    rng, fresh, tally = random.Random(seed), json.dumps(scene_of_plan(seed)), collections.Counter()
    judge_plan(json.loads(fresh), rng, 30)
    for _ in range(count):
        mutant, kind = json.loads(fresh), rng.choice(list(PLAN_KINDS))
        PLAN_KINDS[kind](rng, mutant["no_plan"])
        verdict = _verdict(mutant, fresh, lambda answer: judge_plan(answer, rng, 10))
        tally[f"no_plan: {kind}", verdict] += 1
    return tally


def _verdict(answer, fresh, judge):
    if not accepted(answer):
        return "rejected"
    if json.dumps(answer) != fresh:
        try:
            judge(answer)
        except AssertionError:
            return "false"
    return "accepted"
