"""Answers about bodies of several points and parts, in the plane and space, with template tubes.

Random entries are judged here in fractions, straight from the definitions: the support of a
template is the largest value at its vertices, where both checkers bound it by multipliers.
"""

import itertools
import json
from fractions import Fraction as F

import answer_files as build

AXES = {1: [(1,), (-1,)], 2: [(1, 0), (-1, 0), (0, 1), (0, -1)]}
AXES[3] = [(*a, 0) for a in AXES[2]] + [(0, 0, 1), (0, 0, -1)]
KNOWN_CORNERS = {}
SLANTED = {1: [(2,), (-3,)], 2: [(1, 1), (-1, -1), (2, -1)], 3: [(1, 1, 1), (-1, 0, -2)]}


def solve(A, b):
    """The solution of a square system in fractions, or None."""
    rows = [[*map(F, a), F(c)] for a, c in zip(A, b, strict=True)]
    for i in range(len(rows)):
        pivot = next((r for r in range(i, len(rows)) if rows[r][i]), None)
        if pivot is None:
            return None
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for r in range(len(rows)):
            if r != i:
                rows[r] = [x - rows[r][i] * y for x, y in zip(rows[r], rows[i], strict=True)]
    return [row[-1] for row in rows]


def vertices(rows, n):
    """The vertices of a bounded polytope {a . x <= b}."""
    found = []
    for some in itertools.combinations(rows, n):
        x = solve([a for a, _ in some], [b for _, b in some])
        if x is not None and all(build.dot(a, x) <= b for a, b in rows):
            found.append(x)
    return found


def corners(error, n):
    """Points whose hull is the set of errors."""
    key = json.dumps([error, n])
    if key not in KNOWN_CORNERS:
        KNOWN_CORNERS[key] = new_corners(error, n)
    return KNOWN_CORNERS[key]


def new_corners(error, n):
    if isinstance(error, dict):
        return vertices(list(zip(build.value(error["A"]), build.value(error["b"]), strict=True)), n)
    return list(itertools.product(*([-e, e] for e in build.value(error))))


def random_error(rng, n, template):
    if not template:
        return build.text([F(rng.randint(0, 8), 64) for _ in range(n)])
    rows = AXES[n] + rng.sample(SLANTED[n], rng.randint(1, len(SLANTED[n])))
    offsets = [F(rng.randint(2, 12), 64) for _ in rows]  # not symmetric
    return {"A": build.text(rows), "b": build.text(offsets)}


def random_part(rng, n, m):
    points = rng.sample(range(m), rng.randint(1, m))
    if rng.random() < 0.7:
        return {"points": points, "radius": build.text(F(rng.randint(0, 8), 16))}
    corner = [[F(rng.randint(-8, 8), 32) for _ in range(n)] for _ in range(3)]
    return {"points": points, "vertices": build.text(corner)}


def scene(rng):
    """Problem, network and tube; no start set, one or two bins."""
    n, m, T, n_q = rng.choice([2, 3]), rng.randint(1, 4), rng.randint(1, 4), rng.randint(0, 1)
    outputs = (T + 1) * m * n - n + n_q
    hidden = 3
    weights = [
        [[build.dyadic(rng, 1) for _ in range(2)] for _ in range(hidden)],
        [[build.dyadic(rng, F(1, 4)) for _ in range(hidden)] for _ in range(outputs)],
    ]
    biases = [
        [build.dyadic(rng, F(1, 2)) for _ in range(hidden)],
        [build.dyadic(rng, 1) for _ in range(outputs)],
    ]
    network = {"weights": build.text(weights), "biases": build.text(biases)}
    goal = build.box_rows([-9] * (m * n + n_q), [9] * (m * n + n_q))
    goal["b"] = build.text([F(rng.randint(8, 24), 4) for _ in goal["b"]])
    obstacles = []
    for _ in range(rng.randint(1, 2)):
        centre = [F(rng.randint(-16, 16), 4) for _ in range(n)]
        half = [F(rng.randint(0, 4), 4) for _ in range(n)]
        box = list(zip(centre, half, strict=True))
        obstacles.append(build.box_rows([c - h for c, h in box], [c + h for c, h in box]))
        if rng.random() < 0.3:
            obstacles[-1]["steps"] = sorted([rng.randrange(T), rng.randrange(T)])
    problem = {
        "n_p": n,
        "n_q": n_q,
        "n_k": 2,
        "points": m,
        "steps": T,
        "dt": "0.1",
        "domain": {"lo": ["-1", "-1"], "hi": ["1", "1"]},
        "goal": goal,
        "start": None,
        "obstacles": obstacles,
        "body": {"parts": [random_part(rng, n, m) for _ in range(rng.randint(1, 3))]},
    }
    bins = rng.randint(1, 2)
    template = rng.random() < 0.6
    interval = [
        [[random_error(rng, n, template) for _ in range(m)] for _ in range(T)] for _ in range(bins)
    ]
    final = [random_final(rng, goal, m * n + n_q, template) for _ in range(bins)]
    edges = [build.text([F(2 * i, bins) - 1 for i in range(bins + 1)]), ["-1", "1"]]
    return problem, network, {"edges": edges, "interval": interval, "final": final}


def random_final(rng, goal, size, template):
    """Widths, or a box in other words with the multipliers that bound each row of the goal."""
    if not template:
        return random_error(rng, size, False)
    A = [
        [int(sign > 0) - int(sign < 0) if i == j else 0 for j in range(size)]
        for i in range(size)
        for sign in (1, -1)
    ]
    rows = {"A": build.text(A), "b": build.text([F(rng.randint(0, 8), 32) for _ in A])}
    hints = []
    for a in build.value(goal["A"]):
        hints.append([[[2 * j + int(x < 0), build.text(abs(x))] for j, x in enumerate(a) if x]])
    return {**rows, "goal": hints}


def knots(problem, network, p0, k):
    """places[t][i] of all points at all knots, and the extras."""
    n, m, T = problem["n_p"], problem["points"], problem["steps"]
    _, y = build.evaluate(network, k)
    flat = [F(0)] * n + y
    places = [
        [[p0[a] + flat[(t * m + i) * n + a] for a in range(n)] for i in range(m)]
        for t in range(T + 1)
    ]
    return places, flat[(T + 1) * m * n :]


def support(part, w):
    if "radius" in part:
        return build.value(part["radius"]) * build.norm_up(w)
    return max(-build.dot(w, v) for v in build.value(part["vertices"]))


def tasks(problem):
    return itertools.product(problem["obstacles"], problem["body"]["parts"])


def good(problem, network, tube, entry):
    """Whether a sample holds, in fractions, in every closed bin that contains its k."""
    n, p0, k = problem["n_p"], *map(build.value, (entry["p0"], entry["k"]))
    places, q = knots(problem, network, p0, k)
    end = [*itertools.chain(*places[-1]), *q]
    goal = list(
        zip(build.value(problem["goal"]["A"]), build.value(problem["goal"]["b"]), strict=True)
    )
    bins = build.bins_of(tube, k)
    for b in bins:
        final = tube["final"][b]
        if isinstance(final, dict):  # a box: its rows are + and - of each axis
            limits = build.value(final["b"])
        else:
            limits = [e for e in build.value(final) for _ in range(2)]
        for a, c in goal:
            slack = sum(abs(x) * limits[2 * j + int(x < 0)] for j, x in enumerate(a))
            if build.dot(a, end) + slack > c:
                return False
        runs = [runs for parts in entry["sep"] for runs in parts]
        for (o, part), some in zip(tasks(problem), runs, strict=True):
            t = o.get("steps", [0])[0]
            for stop, ((row, m),) in some:
                w = [build.value(m) * x for x in build.value(o["A"][row])]
                h = build.value(m) * build.value(o["b"][row]) + support(part, w)
                for u in range(t, stop):
                    for i in part["points"]:
                        worst = max(-build.dot(w, e) for e in corners(tube["interval"][b][u][i], n))
                        if min(build.dot(w, places[s][i]) for s in (u, u + 1)) <= h + worst:
                            return False
                t = stop
    return bool(bins)


def attempt(rng, problem, network, tube):
    """A random plan with the best single rows, one run for each interval."""
    n = problem["n_p"]
    p0 = [F(rng.randint(-64, 64), 16) for _ in range(n)]
    k = [rng.choice([F(0), build.dyadic(rng, 1)]), build.dyadic(rng, 1)]
    return {
        "p0": build.text(p0),
        "k": build.text(k),
        "sep": separation(problem, network, p0, k),
    }


def separation(problem, network, p0, k):
    """For each obstacle and part the row with the most room, one run for each interval."""
    places, _ = knots(problem, network, p0, k)
    sep = []
    for o in problem["obstacles"]:
        first, last = o.get("steps", [0, problem["steps"] - 1])
        rows = list(zip(build.value(o["A"]), build.value(o["b"]), strict=True))
        sep.append([])
        for part in problem["body"]["parts"]:
            runs = []
            for t in range(first, last + 1):
                near = [places[s][i] for s in (t, t + 1) for i in part["points"]]
                room = [min(build.dot(a, x) for x in near) - b for a, b in rows]
                runs.append([t + 1, [[room.index(max(room)), "1"]]])
            sep[-1].append(runs)
    return sep


def pieces(answer, entry, rng):
    """The polytope around a sample, and the same with the bin or the pattern of another."""
    k = build.value(entry["k"])
    piece = build.piece(answer["network"], answer["tube"], entry)
    wrong = {**piece, "pattern": piece["pattern"][:-1] + "10"[int(piece["pattern"][-1])]}
    hidden, _ = build.evaluate(answer["network"], k)
    inner = all(hidden) and len(build.bins_of(answer["tube"], k)) == 1
    return [(piece, inner), (wrong, False)]


def boxes(rng, problem, entry):
    """The plan without doubt and with some: half widths down to 1/256, up to 1/2."""
    n = problem["n_p"]
    for size in (F(0), F(1, 2 ** rng.randint(1, 8))):
        room = {
            key: [size * rng.randint(0, 2) / 2 for _ in range(m)]
            for key, m in (("p0", n), ("k", 2))
        }
        yield {**entry, "room": {key: build.text(values) for key, values in room.items()}}
