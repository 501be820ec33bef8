"""Mutants of answers: both checkers must give every entry the same verdict.

Scenes are those of answer_files.py (one point in the plane, polygons and discs, start sets, many
bins, plans that are good) or of bodies.py (up to four points, three parts, space, errors as widths
or as templates, plans on borders between bins). Mutants of entries: plans, directions, runs, parts
exchanged, patterns, bins, room of boxes of doubt. Mutants of the rest: obstacles, moved until they
touch exactly too, body, points, steps, goal, start, domain, network, errors, rows of templates,
ways to bound the error of the end, edges.
"""

import copy
import json
from fractions import Fraction as F

import answer_files as build
import bodies
import two

KINDS = two.KINDS
ENTRIES = 30  # of each kind in a batch
TRIES = 40  # plans per scene of bodies; those that hold are kept, and two others


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


def room(rng, entry):
    """Changes the half widths of a box of doubt; they stay half widths."""
    if "room" in entry:
        side = entry["room"][rng.choice(["p0", "k"])]
        shake(rng, side)
        side[:] = [build.text(abs(build.value(x))) for x in side]


def put(owner, key, value):
    owner[key] = value


ODD_NUMBERS = ["nan", "0x1p+1024", "1e999", "0/0", "", "1.", "--1", "+1", None, 3]
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
    "part dropped": lambda r, e, a: drop(r, r.choice(e["sep"])),
    "parts shuffled": lambda r, e, a: r.shuffle(r.choice(e["sep"])),
    "part doubled": lambda r, e, a: e["sep"][0].append(copy.deepcopy(e["sep"][0][0])),
    "pattern": lambda r, e, a: flip(r, e),
    "bin": lambda r, e, a: other_bin(r, e),
    "room": lambda r, e, a: room(r, e),
    "unknown field": lambda r, e, a: put(e, "note", "1"),
    "odd number": lambda r, e, a: put(e["p0"], 0, r.choice(ODD_NUMBERS)),
}


def obstacle(rng, answer):
    return rng.choice(answer["problem"]["obstacles"])


def part(rng, answer):
    return rng.choice(answer["problem"]["body"]["parts"])


def touch(rng, answer):
    """Moves an obstacle along one of its rows by the exact room that a part of an entry has there:
    contact, or less than 2^-70 of it.
    """
    problem, tube = answer["problem"], answer["tube"]
    sample = rng.choice([*answer["samples"], *answer["corridors"]])
    p0, k = build.value(sample["p0"]), build.value(sample["k"])
    places, _ = bodies.knots(problem, answer["network"], p0, k)
    o = rng.randrange(len(problem["obstacles"]))
    rows = problem["obstacles"][o]
    t = rows.get("steps", [0])[0]
    b = rng.randrange(len(problem["body"]["parts"]))
    own = problem["body"]["parts"][b]
    run = sample["sep"][o][b][0]
    row = run[1][0][0]
    w = build.value(rows["A"][row])
    if "radius" in own:  # a row of length one, so that nothing is rounded
        if sum(x * x for x in w) != 1:
            return
        shape = build.value(own["radius"])
    else:
        shape = bodies.support(own, w)
    rooms = []
    for number in build.bins_of(tube, k):
        for i in own["points"]:
            for u in range(t, run[0]):
                error = bodies.corners(tube["interval"][number][u][i], problem["n_p"])
                worst = max(-build.dot(w, e) for e in error)
                rooms += [build.dot(w, places[s][i]) - worst - shape for s in (u, u + 1)]
    run[1] = [[row, "1"]]
    rows["b"][row] = build.text(min(rooms) - rng.choice([F(0), F(1, 2**70), -F(1, 2**70)]))


def errors(rng, answer):
    """The errors of one bin and interval, by point."""
    return rng.choice(rng.choice(answer["tube"]["interval"]))


def shake_error(rng, answer):
    shake(rng, rng.choice(errors(rng, answer)))


def other_error(rng, answer):
    """Other errors, of whichever kind, for one point."""
    new = bodies.random_error(rng, answer["problem"]["n_p"], rng.random() < 0.5)
    some = errors(rng, answer)
    some[rng.randrange(len(some))] = new


def drop_row(rng, answer):
    """A template without one of its rows."""
    error = rng.choice(errors(rng, answer))
    if isinstance(error, dict):
        place = rng.randrange(len(error["A"]))
        error["A"].pop(place)
        error["b"].pop(place)


def change_ways(rng, answer):
    """Other multipliers for a row of the goal: shaken, none, one more."""
    final = rng.choice(answer["tube"]["final"])
    if isinstance(final, dict):
        ways = rng.choice(final["goal"])
        change = rng.choice(["shaken", "dropped", "doubled", "row"])
        if change == "shaken":
            shake(rng, ways)
        elif change == "dropped":
            ways.clear()
        elif change == "doubled":
            ways.append(copy.deepcopy(ways[0]))
            shake(rng, ways[-1])
        else:
            rng.choice(ways[0])[0] = rng.randrange(len(final["A"]))


SHAPES = [{"radius": "0.5"}, {"radius": "-0.1"}, {"radius": "0"}, {"vertices": []}, build.TRIANGLE]


def other_shape(rng, answer):
    own = part(rng, answer)
    points, n_p = own["points"], answer["problem"]["n_p"]
    shapes = [x for x in SHAPES if all(len(v) == n_p for v in x.get("vertices", ()))]
    own.clear()
    own.update({"points": points, **rng.choice(shapes)})


def other_points(rng, answer):
    m = answer["problem"]["points"]
    part(rng, answer)["points"] = [rng.randint(0, m) for _ in range(rng.randint(0, 3))]


QUESTION = {
    "touch": touch,
    "touch again": touch,
    "obstacle moved": lambda r, a: shake(r, obstacle(r, a)["b"]),
    "obstacle turned": lambda r, a: shake(r, obstacle(r, a)["A"]),
    "obstacle dropped": lambda r, a: drop(r, a["problem"]["obstacles"]),
    "steps": lambda r, a: put(obstacle(r, a), "steps", [r.randint(0, 3), r.randint(1, 6)]),
    "shape": other_shape,
    "points of a part": other_points,
    "part dropped": lambda r, a: drop(r, a["problem"]["body"]["parts"]),
    "points": lambda r, a: put(a["problem"], "points", r.randint(0, 5)),
    "goal": lambda r, a: shake(r, a["problem"]["goal"]),
    "start": lambda r, a: shake(r, a["problem"]["start"] or []),
    "domain": lambda r, a: shake(r, a["problem"]["domain"]),
    "network": lambda r, a: shake(r, a["network"]["weights"]),
    "bias": lambda r, a: shake(r, a["network"]["biases"]),
    "error": shake_error,
    "another error": other_error,
    "row of a template": drop_row,
    "ways": change_ways,
    "final": lambda r, a: shake(r, a["tube"]["final"]),
    "edges": lambda r, a: shake(r, a["tube"]["edges"]),
    "one edge": lambda r, a: put(a["tube"]["edges"], 0, a["tube"]["edges"][0][:1]),
}
BODY = [build.DISC, build.TRIANGLE, {"radius": "0"}, {"radius": "0.125"}]


def one_point(rng):
    """An answer about one point in the plane, whose entries all hold."""
    bins = rng.choice([(1, 1), (2, 1), (2, 3)])
    return build.scene(
        rng.randrange(10**6), bins=bins, body=rng.choice(BODY), starts=rng.random() < 0.5
    )


def several_points(rng):
    """An answer of bodies.py with its plans as samples, corridors, polytopes and boxes of doubt."""
    problem, network, tube = bodies.scene(rng)
    held, others = [], []
    for _ in range(TRIES):
        entry = bodies.attempt(rng, problem, network, tube)
        good = bodies.good(problem, network, tube, entry)
        (held if good else others).append(entry)
    samples = held[:4] + others[:2]
    answer = build.answer(problem, network, tube, samples, corridors=samples)
    answer["sets"] = [bodies.pieces(answer, entry, rng)[0][0] for entry in samples]
    answer["doubt"] = [box for entry in samples for box in bodies.boxes(rng, problem, entry)]
    return answer


def batch(rng, left, valid=None):
    """Answers with mutated entries under the question they came with, and under changed ones."""
    valid = rng.choice([one_point, several_points])(rng) if valid is None else valid
    sources = {kind: valid.get(kind) or [] for kind in KINDS}
    for question in [None, *rng.sample(list(QUESTION), 5)]:
        answer = {**copy.deepcopy(valid), "no_plan": None}
        if question is not None:
            QUESTION[question](rng, answer)
            for kind in KINDS:
                answer[kind] = answer.get(kind, [])[:6]
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
