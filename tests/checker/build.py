"""Builds certificates for the checker's tests from scratch: pure Python, fractions, nothing shared with the checker.

The network is evaluated neuron by neuron with fractions, and a separating direction is chosen by trying facets and pairs of
facets in every interval. Slow and plain on purpose: this is the second opinion.
"""

import copy
import hashlib
import json
import math
import random
from fractions import Fraction as F

PARTS = ("problem", "network", "tube")


def text(x):
    """Nested numbers as strings: dyadic ones as hex floats, the rest as p/q."""
    if isinstance(x, list | tuple):
        return [text(v) for v in x]
    x = F(x)
    return float(x).hex() if x == F(float(x)) else f"{x.numerator}/{x.denominator}"


def value(x):
    """Inverse of `text`, and decimals; floats on purpose go through `float.fromhex` (the checker does not)."""
    if isinstance(x, list):
        return [value(v) for v in x]
    return F(float.fromhex(x)) if "0x" in x else F(x)


def rehash(answer):
    """Makes all hashes agree with the content; returns the answer."""
    answer["hash"] = {
        part: hashlib.sha256(json.dumps(answer[part], sort_keys=True, separators=(",", ":")).encode()).hexdigest()
        for part in PARTS
    }
    if answer["claim"] is not None:
        answer["claim"]["network_hash"], answer["claim"]["tube_hash"] = answer["hash"]["network"], answer["hash"]["tube"]
    return answer


def answer(problem, network, tube, samples=(), sets=(), no_plan=None, kind="pac"):
    """A complete answer around parts that are already JSON."""
    claim = {"kind": kind, "statement": "a new rollout leaves the tube with probability at most 0.001", "n": 6905}
    parts = {"problem": problem, "network": network, "tube": tube, "claim": claim}
    rest = {"samples": list(samples), "sets": list(sets), "no_plan": no_plan}
    return rehash(copy.deepcopy({"format": "parc_jax.answer/1", **parts, **rest}))


def box_rows(lo, hi):
    """A box as half-spaces A x <= b."""
    n = len(lo)
    A = [[sign * int(i == j) for j in range(n)] for sign in (1, -1) for i in range(n)]
    return {"A": text(A), "b": text([*hi, *(-v for v in lo)])}


def evaluate(network, k):
    """(pre-activations of the hidden neurons, outputs) at a point, in fractions."""
    x, hidden = list(k), []
    layers = list(zip(value(network["weights"]), value(network["biases"]), strict=True))
    for depth, (W, b) in enumerate(layers):
        x = [sum((w * v for w, v in zip(row, x, strict=True)), c) for row, c in zip(W, b, strict=True)]
        if depth < len(layers) - 1:
            hidden += x
            x = [max(v, F(0)) for v in x]
    return hidden, x


def path(problem, network, p0, k):
    """(knots p_0 .. p_T, q) in fractions."""
    n, T = problem["n_p"], problem["steps"]
    _, y = evaluate(network, k)
    knots = [[p + c for p, c in zip(p0, [0] * n if s == 0 else y[(s - 1) * n : s * n], strict=True)] for s in range(T + 1)]
    return knots, y[T * n :]


def bins_of(tube, k):
    """All closed bins that contain k."""
    found = [0]
    for edge, x in zip(value(tube["edges"]), k, strict=True):
        found = [n * (len(edge) - 1) + i for n in found for i in range(len(edge) - 1) if edge[i] <= x <= edge[i + 1]]
    return found


def widths(tube, k):
    """Largest widths over the closed bins that contain k: (interval, final)."""
    bins = bins_of(tube, k)
    interval = [[max(v) for v in zip(*e, strict=True)] for e in zip(*(value(tube["interval"][b]) for b in bins), strict=True)]
    return interval, [max(v) for v in zip(*(value(tube["final"][b]) for b in bins), strict=True)]


def norm_up(w):
    """A rational upper bound of |w|; exact for perfect squares of numerators over a common square."""
    square = sum(v * v for v in w)
    num, den = square.numerator << 120, square.denominator << 120
    up = math.isqrt(num) + (math.isqrt(num) ** 2 < num)
    return F(up, math.isqrt(den))


def body_support(problem, w):
    """Support of -body at w, rounded up."""
    if "radius" in problem["body"]:
        return value(problem["body"]["radius"]) * norm_up(w)
    return max(-sum(a * b for a, b in zip(w, v, strict=True)) for v in value(problem["body"]["vertices"]))


def slack(problem, obstacle, multipliers, ends, e):
    """How far beyond the grown obstacle both ends of a segment lie in the direction of the multipliers."""
    A, b = value(obstacle["A"]), value(obstacle["b"])
    w = [sum(m * A[i][j] for i, m in multipliers) for j in range(problem["n_p"])]
    h = sum(m * b[i] for i, m in multipliers) + body_support(problem, w) + sum(abs(v) * x for v, x in zip(w, e, strict=True))
    return (min(sum(a * c for a, c in zip(w, p, strict=True)) for p in ends) - h) / norm_up(w) if any(w) else F(-1)


def separation(problem, knots, interval):
    """SEP of a path, or None if facets and pairs of facets do not separate it."""
    sep = []
    for obstacle in problem["obstacles"]:
        first, last = obstacle.get("steps", [0, problem["steps"] - 1])
        m = len(obstacle["b"])
        options = [[(i, F(1))] for i in range(m)]
        options += [[(i, F(a, 4)), (j, 1 - F(a, 4))] for i in range(m) for j in range(i) for a in (1, 2, 3)]
        runs, chosen = [], None
        for t in range(first, last + 1):
            ends = knots[t : t + 2]
            if chosen is None or slack(problem, obstacle, chosen, ends, interval[t]) <= 0:
                chosen = max(options, key=lambda o: slack(problem, obstacle, o, ends, interval[t]))
                if slack(problem, obstacle, chosen, ends, interval[t]) <= 0:
                    return None
                runs.append(None)
            runs[-1] = [t + 1, [[i, text(v)] for i, v in chosen]]
        sep.append(runs)
    return sep


def sample(problem, network, tube, p0, k):
    """A sample certificate, or None."""
    interval, _ = widths(tube, k)
    sep = separation(problem, path(problem, network, p0, k)[0], interval)
    return None if sep is None else {"p0": text(p0), "k": text(k), "sep": sep}


def piece(problem, network, tube, p0, k):
    """A set certificate about the same point, or None."""
    found = sample(problem, network, tube, p0, k)
    if found is None:
        return None
    pattern = "".join("1" if v > 0 else "0" for v in evaluate(network, k)[0])
    return {**found, "bin": bins_of(tube, k)[0], "pattern": pattern}


def dyadic(rng, scale, bits=10):
    return F(rng.randint(-(1 << bits), 1 << bits), 1 << bits) * F(scale)


def random_network(rng, n_k=2, n_p=2, n_q=1, T=6, hidden=(4, 3), length=4):
    """A network whose path runs roughly along the first axis for `length` metres and bends with k."""
    sizes, weights, biases = [n_k, *hidden], [], []
    for a, b in zip(sizes, sizes[1:], strict=False):
        weights.append([[dyadic(rng, 1) for _ in range(a)] for _ in range(b)])
        biases.append([dyadic(rng, F(1, 2)) for _ in range(b)])
    bend = [[dyadic(rng, F(1, 2)) for _ in range(n_p)] for _ in range(sizes[-1])]
    last = [[w * F(s, T) for w in column] for s in range(1, T + 1) for column in zip(*bend, strict=True)]
    weights.append(last + [[dyadic(rng, F(1, 4)) for _ in range(sizes[-1])] for _ in range(n_q)])
    drive = [F(length * s, T) * int(j == 0) for s in range(1, T + 1) for j in range(n_p)]
    biases.append(drive + [F(0)] * n_q)
    return {"weights": text(weights), "biases": text(biases)}


def random_tube(rng, bins=(2, 1), n_p=2, n_q=1, T=6, size=F(1, 16)):
    """Widths between size/2 and size on equal bins of [-1, 1]."""
    edges = [[F(2 * i, b) - 1 for i in range(b + 1)] for b in bins]
    n = math.prod(bins)
    def draw(): return size * (1 + abs(dyadic(rng, 1, 6))) / 2
    interval = [[[draw() for _ in range(n_p)] for _ in range(T)] for _ in range(n)]
    return {"edges": text(edges), "interval": text(interval), "final": text([[draw() for _ in range(n_p + n_q)] for _ in range(n)])}


def random_obstacle(rng, centre, size):
    """A convex polygon (3 to 5 random facets about a centre, bounded by a box) as half-spaces."""
    rows = box_rows([c - size for c in centre], [c + size for c in centre])
    A, b = value(rows["A"]), value(rows["b"])
    for _ in range(rng.randint(0, 2)):
        a = [F(rng.randint(-4, 4)) for _ in centre]
        if any(a):
            A.append(a)
            b.append(sum(x * c for x, c in zip(a, centre, strict=True)) + size * F(rng.randint(2, 5)))
    return {"A": text(A), "b": text(b)}


def scene(seed, hidden=(4, 3), T=6, n_q=1, bins=(2, 1), body="disc", starts=True, n_samples=3, n_sets=2):
    """A random problem with network, tube and certificates; None if no obstacle free plan was found."""
    rng = random.Random(seed)
    n_p, n_k = 2, 2
    network = random_network(rng, n_k, n_p, n_q, T, hidden)
    tube = random_tube(rng, bins, n_p, n_q, T)
    k0, p0 = [dyadic(rng, F(7, 8)) for _ in range(n_k)], [dyadic(rng, 1) for _ in range(n_p)]
    problem = {"n_p": n_p, "n_q": n_q, "n_k": n_k, "domain": {"lo": ["-1"] * n_k, "hi": ["0x1p+0"] * n_k}, "steps": T}
    problem |= {"dt": "0.05", "obstacles": [], "start": None}
    problem["body"] = {"radius": "0.2"} if body == "disc" else {"vertices": [["0.2", "0"], ["-0.2", "0.1"], ["-0.2", "-0.1"]]}
    if starts:
        problem["start"] = box_rows([v - F(1, 4) for v in p0], [v + F(1, 4) for v in p0])
    knots, q = path(problem, network, p0, k0)
    end = [*knots[-1], *q]
    problem["goal"] = box_rows([v - F(3, 4) for v in end], [v + F(3, 4) for v in end])
    for _ in range(40):
        centre = [dyadic(rng, 3) + 1 + p0[0], dyadic(rng, 2) + p0[1]]
        new = random_obstacle(rng, centre, F(rng.randint(1, 4), 8))
        if rng.random() < 0.3:
            new["steps"] = sorted([rng.randrange(T), rng.randrange(T)])
        if separation({**problem, "obstacles": [new]}, knots, widths(tube, k0)[0]) is not None:
            problem["obstacles"].append(new)
        if len(problem["obstacles"]) == 2:
            break
    points = [(p0, k0)]
    points += [([v + dyadic(rng, F(1, 8)) for v in p0], [v + dyadic(rng, F(1, 8)) for v in k0]) for _ in range(8)]
    good = [point for point in points if reaches(problem, network, tube, *point)]
    samples = [found for point in good if (found := sample(problem, network, tube, *point))][:n_samples]
    sets = [found for point in good if (found := piece(problem, network, tube, *point))][:n_sets]
    return answer(problem, network, tube, samples, sets)


def reaches(problem, network, tube, p0, k):
    """Start, domain and goal with margin, in fractions."""
    knots, q = path(problem, network, p0, k)
    _, final = widths(tube, k)
    goal, start = problem["goal"], problem["start"]
    end = [*knots[-1], *q]
    return all(
        sum(a * v + abs(a) * e for a, v, e in zip(row, end, final, strict=True)) <= b
        for row, b in zip(value(goal["A"]), value(goal["b"]), strict=True)
    ) and (start is None or all(
        sum(a * v for a, v in zip(row, p0, strict=True)) <= b
        for row, b in zip(value(start["A"]), value(start["b"]), strict=True)
    )) and all(-1 <= v <= 1 for v in k)
