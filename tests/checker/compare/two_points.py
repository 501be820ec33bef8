"""Mutants of answers with several points and parts, in the plane and in space: both checkers must
give every entry the same verdict.

Scenes are those of bodies.py: up to four points, three parts, errors as widths or as templates,
one or two bins, plans on their border. Mutants of entries: plans, directions, runs, parts
exchanged, patterns, bins, room of boxes of doubt. Mutants of the rest: obstacles, moved until they
touch exactly too, parts, network, goal, errors, rows of templates, ways to bound the error of the
end.
"""

import copy
import json
from fractions import Fraction as F

import answer_files as build
import bodies
import two
import two_mutants
from two_mutants import drop, put, shake

KINDS = two.KINDS
ENTRIES = 15  # of each kind in a batch
judge = two.by_entry
TRIES = 40  # plans per scene; those that hold are kept, and two others


def scene(rng):
    """An answer with its plans as samples, corridors, polytopes and boxes of doubt."""
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


def room(rng, entry):
    """Changes the half widths of a box of doubt; they stay half widths."""
    if "room" in entry:
        side = entry["room"][rng.choice(["p0", "k"])]
        shake(rng, side)
        side[:] = [build.text(abs(build.value(x))) for x in side]


ENTRY = two_mutants.ENTRY | {
    "part dropped": lambda r, e, a: drop(r, r.choice(e["sep"])),
    "parts shuffled": lambda r, e, a: r.shuffle(r.choice(e["sep"])),
    "part doubled": lambda r, e, a: e["sep"][0].append(copy.deepcopy(e["sep"][0][0])),
    "room": lambda r, e, a: room(r, e),
}


def obstacle(rng, answer):
    return rng.choice(answer["problem"]["obstacles"])


def part(rng, answer):
    return rng.choice(answer["problem"]["body"]["parts"])


def touch(rng, answer):
    """Moves an obstacle along one of its rows, of length one, by the exact room that a part of an
    entry has there: contact, or less than 2^-70 of it.
    """
    problem, tube = answer["problem"], answer["tube"]
    sample = rng.choice(answer["samples"])
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
    if "radius" in own:
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


SHAPES = [{"radius": "0.5"}, {"radius": "-0.1"}, {"radius": "0"}, {"vertices": []}]


def other_shape(rng, answer):
    own = part(rng, answer)
    points = own["points"]
    own.clear()
    own.update({"points": points, **rng.choice(SHAPES)})


def other_points(rng, answer):
    m = answer["problem"]["points"]
    part(rng, answer)["points"] = [rng.randint(0, m) for _ in range(rng.randint(0, 3))]


QUESTION = {
    "touch": touch,
    "touch again": touch,
    "obstacle moved": lambda r, a: shake(r, obstacle(r, a)["b"]),
    "obstacle turned": lambda r, a: shake(r, obstacle(r, a)["A"]),
    "obstacle dropped": lambda r, a: drop(r, a["problem"]["obstacles"]),
    "steps": lambda r, a: put(obstacle(r, a), "steps", [r.randint(0, 2), r.randint(1, 4)]),
    "shape": other_shape,
    "points of a part": other_points,
    "part dropped": lambda r, a: drop(r, a["problem"]["body"]["parts"]),
    "points": lambda r, a: put(a["problem"], "points", r.randint(0, 5)),
    "goal": lambda r, a: shake(r, a["problem"]["goal"]),
    "domain": lambda r, a: shake(r, a["problem"]["domain"]),
    "network": lambda r, a: shake(r, a["network"]["weights"]),
    "bias": lambda r, a: shake(r, a["network"]["biases"]),
    "error": shake_error,
    "another error": other_error,
    "row of a template": drop_row,
    "ways": change_ways,
    "final": lambda r, a: shake(r, a["tube"]["final"]),
    "edges": lambda r, a: shake(r, a["tube"]["edges"]),
}


def batch(rng, left, valid=None):
    """Answers with mutated entries under the question they came with, and under changed ones."""
    valid = scene(rng) if valid is None else valid
    for question in [None, *rng.sample(list(QUESTION), 5)]:
        answer = copy.deepcopy(valid)
        if question is not None:
            QUESTION[question](rng, answer)
        else:
            for kind in KINDS:
                answer[kind] = [copy.deepcopy(rng.choice(valid[kind])) for _ in range(ENTRIES)]
                for entry in answer[kind]:
                    try:
                        ENTRY[rng.choice(list(ENTRY))](rng, entry, valid)
                    except IndexError:  # nothing to change: no run
                        pass
        yield question or "entries", json.dumps(build.rehash(answer))
