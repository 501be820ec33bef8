"""Mutants of answers: the proved checker and the Python one must give every entry the same verdict.

Scenes have discs and polygons for bodies, with and without a start set, obstacles that are there
for some steps only, several bins. Mutants of entries: plans, directions, runs, patterns, bins, k
moved onto borders between bins, obstacles moved until they touch exactly. Mutants of the rest:
obstacles, body, steps, goal, start, domain, network, tube, edges.
"""

import copy
import json
from fractions import Fraction as F

import answer_files as build
import two

KINDS = build.KINDS
ENTRIES = 60  # of each kind in a batch
judge = two.by_entry


def numbers(part):
    """(list, index) of all number strings below a part."""
    items = part.items() if isinstance(part, dict) else enumerate(part)
    for place, child in items:
        if isinstance(child, str):
            if isinstance(part, list):
                yield part, place
        elif isinstance(child, list | dict):
            yield from numbers(child)


def shake(rng, part):
    """Changes one number below a part: its sign, a lot, or by powers of two down to 2^-60."""
    places = list(numbers(part))
    if places:
        owner, place = rng.choice(places)
        old = build.value(owner[place])
        near = rng.choice([-1, 1]) * F(1, 2 ** rng.randint(1, 60))
        owner[place] = build.text(
            rng.choice([-old, old + near, old + near, old * 2, old - 3, F(0)])
        )


def runs(rng, entry):
    """A list of runs of an entry, of an obstacle and a part."""
    return rng.choice(rng.choice(entry["sep"]))


def multipliers(rng, entry):
    return rng.choice(runs(rng, entry))[1]


def onto_border(rng, entry, answer):
    """One coordinate of k onto the nearest edge of the tube."""
    axis = rng.randrange(len(entry["k"]))
    x = build.value(entry["k"][axis])
    edges = answer["tube"]["edges"][axis]
    entry["k"][axis] = min(edges, key=lambda edge: abs(build.value(edge) - x))


def drop(rng, part):
    part.pop(rng.randrange(len(part)))


def flip(rng, entry):
    if entry.get("pattern"):
        i = rng.randrange(len(entry["pattern"]))
        digits = entry["pattern"]
        entry["pattern"] = digits[:i] + "10"[int(digits[i])] + digits[i + 1 :]


def other_bin(rng, entry):
    if "bin" in entry:
        entry["bin"] = rng.randint(-1, 9)


def put(owner, key, value):
    owner[key] = value


ENTRY = {
    "nothing": lambda r, e, a: None,
    "p0": lambda r, e, a: shake(r, e["p0"]),
    "k": lambda r, e, a: shake(r, e["k"]),
    "border": onto_border,
    "multiplier": lambda r, e, a: shake(r, multipliers(r, e)),
    "row": lambda r, e, a: put(r.choice(multipliers(r, e)), 0, r.randint(-2, 6)),
    "run end": lambda r, e, a: put(r.choice(runs(r, e)), 0, r.randint(-1, 8)),
    "run dropped": lambda r, e, a: drop(r, runs(r, e)),
    "runs shuffled": lambda r, e, a: r.shuffle(runs(r, e)),
    "run empty": lambda r, e, a: put(r.choice(runs(r, e)), 1, []),
    "separation dropped": lambda r, e, a: drop(r, e["sep"]),
    "separations shuffled": lambda r, e, a: r.shuffle(e["sep"]),
    "pattern": lambda r, e, a: flip(r, e),
    "bin": lambda r, e, a: other_bin(r, e),
    "unknown field": lambda r, e, a: put(e, "note", "1"),
    "odd number": lambda r, e, a: put(
        e["p0"], 0, r.choice(["nan", "0x1p+1024", "1e999", "0/0", "", "1.", "--1", "+1", None, 3])
    ),
}


def obstacle(rng, answer):
    return rng.choice(answer["problem"]["obstacles"])


def touch(rng, answer):
    """Moves an obstacle along one of its rows by the exact room that an entry has there:
    contact.
    """
    problem = answer["problem"]
    sample = rng.choice([*answer["samples"], *answer["corridors"]])
    knots, _ = build.path(
        problem, answer["network"], *map(build.value, (sample["p0"], sample["k"]))
    )
    o = rng.randrange(len(problem["obstacles"]))
    rows = problem["obstacles"][o]
    intervals, _ = build.widths(answer["tube"], build.value(sample["k"]))
    t = problem["obstacles"][o].get("steps", [0])[0]
    (runs,) = sample["sep"][o]
    row = runs[0][1][0][0]
    w = build.value(rows["A"][row])
    (body,) = problem["body"]["parts"]
    if "radius" in body:  # a row of length one, so that nothing is rounded
        if sum(x * x for x in w) != 1:
            return
        support = build.value(body["radius"])
    else:
        support = max(-build.dot(w, v) for v in build.value(body["vertices"]))
    stop = runs[0][0]
    rooms = [
        build.dot(w, knots[s]) - support - build.widest(w, [interval[u] for interval in intervals])
        for u in range(t, stop)
        for s in (u, u + 1)
    ]
    runs[0][1] = [[row, "1"]]
    rows["b"][row] = build.text(min(rooms) - rng.choice([F(0), F(1, 2**70), -F(1, 2**70)]))


# Not among them: a polygon without vertices. The Python checker looks at it only where there is an
# obstacle; the proved one refuses it always.
SHAPES = [{"radius": "0.5"}, {"radius": "-0.1"}, {"radius": "0"}, build.TRIANGLE]
QUESTION = {
    "touch": touch,
    "obstacle moved": lambda r, a: shake(r, obstacle(r, a)["b"]),
    "obstacle turned": lambda r, a: shake(r, obstacle(r, a)["A"]),
    "obstacle dropped": lambda r, a: drop(r, a["problem"]["obstacles"]),
    "steps": lambda r, a: put(obstacle(r, a), "steps", [r.randint(0, 3), r.randint(2, 6)]),
    "body": lambda r, a: put(a["problem"], "body", build.one_part(r.choice(SHAPES))),
    "goal": lambda r, a: shake(r, a["problem"]["goal"]),
    "start": lambda r, a: shake(r, a["problem"]["start"] or []),
    "domain": lambda r, a: shake(r, a["problem"]["domain"]),
    "network": lambda r, a: shake(r, a["network"]["weights"]),
    "bias": lambda r, a: shake(r, a["network"]["biases"]),
    "tube": lambda r, a: shake(r, a["tube"]["interval"]),
    "final": lambda r, a: shake(r, a["tube"]["final"]),
    "edges": lambda r, a: shake(r, a["tube"]["edges"]),
    "one edge": lambda r, a: put(a["tube"]["edges"], 0, a["tube"]["edges"][0][:1]),
}
BODY = [build.DISC, build.TRIANGLE, {"radius": "0"}, {"radius": "0.125"}]


def scene(rng):
    bins = rng.choice([(1, 1), (2, 1), (2, 3)])
    return build.scene(
        rng.randrange(10**6), bins=bins, body=rng.choice(BODY), starts=rng.random() < 0.5
    )


def batch(rng, left, valid=None):
    """Answers with mutated entries under the question they came with, and under changed ones."""
    valid = scene(rng) if valid is None else valid
    sources = {kind: valid.get(kind) or [] for kind in KINDS}
    for question in [None, *rng.sample(list(QUESTION), 4)]:
        answer = {**copy.deepcopy(valid), "no_plan": None}
        if question is not None:
            QUESTION[question](rng, answer)
            for kind in KINDS:
                answer[kind] = answer[kind][:5]
        else:
            for kind in KINDS:
                answer[kind] = []
                for _ in range(ENTRIES if sources[kind] else 0):
                    entry = copy.deepcopy(rng.choice(sources[kind]))
                    try:
                        ENTRY[rng.choice(list(ENTRY))](rng, entry, valid)
                    except IndexError:  # nothing to change: no obstacle, no run
                        pass
                    answer[kind].append(entry)
        yield question or "entries", json.dumps(build.rehash(answer))
