"""Random answers about bodies of several points and parts, with template tubes: both checkers must
say of every entry what fractions say, straight from the definitions (bodies.py).

Entries that are accepted are driven as well: random trajectories in the tube, random points of the
body. Boxes of doubt around each plan: without room they are samples; with room, points of accepted
ones are.
"""

import json
import random

import answer_files as build
import bodies
import two


def mixture(rng, points):
    weights = [rng.random() ** 3 + 1e-9 for _ in points]
    total = sum(weights)
    return [
        sum(w * float(x[a]) for w, x in zip(weights, points, strict=True)) / total
        for a in range(len(points[0]))
    ]


def hits(rng, problem, network, tube, entry):
    """Drives an accepted plan, in floats: whether a random point of the body meets an obstacle."""
    n, p0, k = problem["n_p"], *map(build.value, (entry["p0"], entry["k"]))
    places, _ = bodies.knots(problem, network, p0, k)
    b = rng.choice(build.bins_of(tube, k))
    for o, part in bodies.tasks(problem):
        first, last = o.get("steps", [0, problem["steps"] - 1])
        t, s = rng.randint(first, last), rng.choice([0, 1, rng.random()])
        points = []
        for i in part["points"]:
            error = mixture(rng, bodies.corners(tube["interval"][b][t][i], n))
            line = [
                (1 - s) * float(x) + s * float(y)
                for x, y in zip(places[t][i], places[t + 1][i], strict=True)
            ]
            points.append([x + e for x, e in zip(line, error, strict=True)])
        x = mixture(rng, points)
        if "radius" in part:
            way = [rng.gauss(0, 1) for _ in range(n)]
            scale = float(build.value(part["radius"])) / sum(v * v for v in way) ** 0.5
            offset = [scale * v for v in way]
        else:
            offset = mixture(rng, build.value(part["vertices"]))
        x = [u + v for u, v in zip(x, offset, strict=True)]
        rows = zip(build.value(o["A"]), build.value(o["b"]), strict=True)
        if all(
            sum(float(v) * y for v, y in zip(a, x, strict=True)) <= float(c) - 1e-9 for a, c in rows
        ):
            return True
    return False


def escapes(rng, problem, network, tube, box):
    """Whether a corner or a random point of a box of doubt is not a good sample, in fractions."""
    for attempt in range(4):
        point = {"sep": box["sep"]}
        for key in ("p0", "k"):
            shares = [
                rng.choice([-1, 1]) if attempt < 2 else build.dyadic(rng, 1) for _ in box[key]
            ]
            middle, room = build.value(box[key]), build.value(box["room"][key])
            point[key] = build.text(
                [x + r * s for x, r, s in zip(middle, room, shares, strict=True)]
            )
        if not bodies.good(problem, network, tube, point):
            return True
    return False


def batch(rng, left, valid=None):
    """Ten answers: (what fractions say of samples and of polytopes, which samples hit), text."""
    bodies.KNOWN_CORNERS.clear()
    for _ in range(10):
        problem, network, tube = bodies.scene(rng)
        question = problem, network, tube
        entries = [bodies.attempt(rng, *question) for _ in range(20)]
        answer = build.answer(*question, entries)
        good = [bodies.good(*question, entry) for entry in entries]
        sets = [
            (piece, ok and inner)
            for entry, ok in zip(entries, good, strict=True)
            for piece, inner in bodies.pieces(answer, entry, rng)
        ]
        answer["sets"] = [piece for piece, _ in sets]
        answer["doubt"] = [box for entry in entries for box in bodies.boxes(rng, problem, entry)]
        met = [
            ok and any(hits(rng, *question, entry) for _ in range(20))
            for entry, ok in zip(entries, good, strict=True)
        ]
        yield {"samples": good, "sets": [ok for _, ok in sets], "hit": met}, json.dumps(answer)


def judge(what, text, said):
    """By fractions and by the Python checker; a box of doubt with room by some of its points."""
    answer = json.loads(text)
    question = [answer[part] for part in ("problem", "network", "tube")]
    python = two.python_verdicts(answer)
    if isinstance(python, str) or not said["entries"]:
        yield False, (python, said["lines"])
        return
    for kind in ("samples", "sets", "doubt"):
        for i, digit in enumerate(said["entries"][kind]):
            accepted = digit == "1"
            if kind != "doubt":
                wanted = what[kind][i]
            elif i % 2 == 0:  # the first of two is a plan without doubt
                wanted = what["samples"][i // 2]
            else:
                escaped = accepted and escapes(random.Random(i), *question, answer[kind][i])
                wanted = accepted and not escaped
            met = kind == "samples" and what["hit"][i]
            same = accepted == wanted == (python[kind][i] is None) and not met
            yield accepted, None if same else (f"{kind}[{i}]", digit, wanted, python[kind][i], met)
