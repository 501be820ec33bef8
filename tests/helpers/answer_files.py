"""Builds certificates for the checker's tests from scratch: pure Python, fractions, nothing shared
with the checker.

The network is evaluated neuron by neuron with fractions, and a separating direction is found by
trying facets and mixtures of two facets in every interval. Plain on purpose: this is the second
opinion.
"""

import copy
import functools
import hashlib
import itertools
import json
import math
import random
from fractions import Fraction as F

FORMAT = "parc_jax.answer/3"
KINDS = ("samples", "sets", "corridors")


def text(x):
    """Nested numbers as strings: dyadic ones as hex floats, the rest as p/q."""
    if isinstance(x, list | tuple):
        return [text(v) for v in x]
    x = F(x)
    return float(x).hex() if x == F(float(x)) else f"{x.numerator}/{x.denominator}"


def value(x):
    """Inverse of `text`, reads decimals too."""
    if isinstance(x, list):
        return [value(v) for v in x]
    return one_value(x)


@functools.lru_cache(maxsize=1 << 16)
def one_value(x):
    """The number that a text spells."""
    return F(float.fromhex(x)) if "0x" in x else F(x)


def dot(a, b):
    """Over one denominator: a sum of fractions would look for a common divisor at every term."""
    pairs = list(zip(a, b, strict=True))
    below = math.lcm(*(x.denominator * y.denominator for x, y in pairs))
    tops = (
        x.numerator * y.numerator * (below // (x.denominator * y.denominator)) for x, y in pairs
    )
    return F(sum(tops), below)


def rehash(answer):
    """Makes all hashes agree with the content; returns the answer."""
    parts = ("problem", "network", "tube")
    answer["hash"] = {part: sha256(answer[part]) for part in parts}
    if answer["claim"] is not None:
        answer["claim"] |= {f"{part}_hash": answer["hash"][part] for part in parts[1:]}
    answer["hash"]["claim"] = sha256(answer["claim"])
    return answer


def sha256(part):
    """Of the canonical text of a part."""
    return hashlib.sha256(
        json.dumps(part, sort_keys=True, separators=(",", ":")).encode()
    ).hexdigest()


def answer(problem, network, tube, samples=(), sets=(), no_plan=None, kind="pac", corridors=()):
    """A complete answer around parts that are already JSON; without corridors without their key."""
    claim = {
        "kind": kind,
        "statement": "a new rollout leaves the tube with probability at most 0.001",
        "n": 6905,
        "discard": 0,
        "looks": 1,
        "eps": "1/1000",
        "delta": "1/1000",
        "bin_eps": None,
        "evidence": {},
    }
    parts = {"problem": problem, "network": network, "tube": tube, "claim": claim}
    rest = {"samples": list(samples), "sets": list(sets), "no_plan": no_plan}
    rest |= {"corridors": list(corridors)} if corridors else {}
    return rehash(json.loads(json.dumps({"format": FORMAT, **parts, **rest})))  # shares nothing


def only(answer, kind, *entries):
    """The answer with these entries of one kind, all of its own by default, and nothing else."""
    kept = list(entries) or answer[kind]
    return {**answer, **{key: [] for key in KINDS}, "no_plan": None, kind: kept}


def entries(answer):
    """All samples, sets and corridors."""
    return [entry for kind in KINDS for entry in answer.get(kind, [])]


def one_part(shape):
    """The body that is this shape about the first reference point."""
    return {"parts": [{"points": [0], **shape}]}


def box_rows(lo, hi):
    """A box as half-spaces A x <= b, upper faces first."""
    A = [[sign * int(i == j) for j in range(len(lo))] for sign in (1, -1) for i in range(len(lo))]
    return {"A": text(A), "b": text([*hi, *(-v for v in lo)])}


def evaluate(network, k):
    """(pre-activations of the hidden neurons, outputs) at a point, in fractions."""
    x, hidden = list(k), []
    layers = list(zip(value(network["weights"]), value(network["biases"]), strict=True))
    for depth, (W, b) in enumerate(layers):
        x = [dot(row, x) + c for row, c in zip(W, b, strict=True)]
        if depth < len(layers) - 1:
            hidden += x
            x = [max(v, F(0)) for v in x]
    return hidden, x


def path(problem, network, p0, k):
    """(knots p_0 .. p_T, q) in fractions."""
    n, T = problem["n_p"], problem["steps"]
    _, y = evaluate(network, k)
    offsets = [[F(0)] * n] + [y[s * n : (s + 1) * n] for s in range(T)]
    return [[p + c for p, c in zip(p0, offset, strict=True)] for offset in offsets], y[T * n :]


def bins_of(tube, k):
    """All closed bins that contain k."""
    found = [0]
    for edge, x in zip(value(tube["edges"]), k, strict=True):
        inside = [i for i in range(len(edge) - 1) if edge[i] <= x <= edge[i + 1]]
        found = [n * (len(edge) - 1) + i for n in found for i in inside]
    return found


def widths(tube, k):
    """The widths of the only point in every closed bin that contains k: ([bin][T] widths, [bin]
    widths at the end).
    """
    bins = bins_of(tube, k)
    intervals = [[widths for (widths,) in value(tube["interval"][b])] for b in bins]
    return intervals, [value(tube["final"][b]) for b in bins]


def widest(w, many):
    """The farthest that errors of any of these widths reach along w."""
    return max(dot(map(abs, w), e) for e in many)


def norm_up(w):
    """A rational upper bound of |w| within 2^-100 or so."""
    square = dot(w, w)
    up = math.isqrt((square.numerator << 240) // square.denominator + 1) + 1
    return F(up, 1 << 120)


def reaches(problem, tube, knots, q, k):
    """Start, domain and goal with margin, in fractions."""
    goal, start, end = problem["goal"], problem["start"], [*knots[-1], *q]
    finals = widths(tube, k)[1]
    rows = zip(value(goal["A"]), value(goal["b"]), strict=True)
    if not all(dot(a, end) + widest(a, finals) <= b for a, b in rows):
        return False
    lo, hi = (value(problem["domain"][side]) for side in ("lo", "hi"))
    inside = [a <= x <= b for a, x, b in zip(lo, k, hi, strict=True)]
    if start is not None:
        inside += [
            dot(a, knots[0]) <= b for a, b in zip(value(start["A"]), value(start["b"]), strict=True)
        ]
    return all(inside)


def slack(rows, shape, multipliers, ends, many):
    """How far both ends of a segment lie beyond the obstacle, grown by a shape and the widths of
    any bin, in the direction of the multipliers.
    """
    w = [sum(m * rows[i][0][j] for i, m in multipliers) for j in range(len(ends[0]))]
    if not any(w):
        return F(-1)
    size = norm_up(w)
    h = sum(m * rows[i][1] for i, m in multipliers) + widest(w, many)
    h += (
        value(shape["radius"]) * size
        if "radius" in shape
        else max(-dot(w, v) for v in value(shape["vertices"]))
    )
    return (min(dot(w, p) for p in ends) - h) / size


def separation(problem, knots, intervals):
    """SEP of a path, for a body of one part about the only point, or None if facets and mixtures of
    two facets do not separate it.
    """
    (shape,) = problem["body"]["parts"]
    sep = []
    for obstacle in problem["obstacles"]:
        first, last = obstacle.get("steps", [0, problem["steps"] - 1])
        rows = list(zip(value(obstacle["A"]), value(obstacle["b"]), strict=True))
        options = [[(i, F(1))] for i in range(len(rows))]
        options += [
            [(i, F(1, 2)), (j, F(1, 2))] for i, j in itertools.combinations(range(len(rows)), 2)
        ]
        runs, chosen = [], None
        for t in range(first, last + 1):

            def beyond(option, t=t, rows=rows):
                many = [interval[t] for interval in intervals]
                return slack(rows, shape, option, knots[t : t + 2], many)

            if chosen is None or beyond(chosen) <= 0:
                chosen = max(options, key=beyond)
                if beyond(chosen) <= 0:
                    return None
                runs.append(None)
            runs[-1] = [t + 1, [[i, text(v)] for i, v in chosen]]
        sep.append([runs])
    return sep


def sample(problem, network, tube, p0, k):
    """A sample certificate, or None."""
    knots, q = path(problem, network, p0, k)
    if not reaches(problem, tube, knots, q, k):
        return None
    sep = separation(problem, knots, widths(tube, k)[0])
    return None if sep is None else {"p0": text(p0), "k": text(k), "sep": sep}


def keeps(problem, network, tube, sep, p0, k):
    """Whether (p0, k) meets all conditions of the corridor with these directions."""
    knots, q = path(problem, network, p0, k)
    if not bins_of(tube, k) or not reaches(problem, tube, knots, q, k):
        return False
    intervals, (shape,) = widths(tube, k)[0], problem["body"]["parts"]
    for obstacle, (runs,) in zip(problem["obstacles"], sep, strict=True):
        rows, t = (
            list(zip(value(obstacle["A"]), value(obstacle["b"]), strict=True)),
            obstacle.get("steps", [0])[0],
        )
        for stop, multipliers in runs:
            option = [(i, value(m)) for i, m in multipliers]
            if any(
                slack(rows, shape, option, knots[s : s + 2], [e[s] for e in intervals]) <= 0
                for s in range(t, stop)
            ):
                return False
            t = stop
    return True


def piece(network, tube, found):
    """The set certificate around a sample certificate."""
    k = value(found["k"])
    pattern = "".join("1" if v > 0 else "0" for v in evaluate(network, k)[0])
    return {**found, "bin": bins_of(tube, k)[0], "pattern": pattern}


def dyadic(rng, scale, bits=10):
    """A random number in [-scale, scale]."""
    return F(rng.randint(-(1 << bits), 1 << bits), 1 << bits) * F(scale)


def random_network(rng, n_k=2, n_p=2, n_q=1, T=6, hidden=(4, 3), length=4, bits=10):
    """A network whose path runs roughly along the first axis for `length` metres and bends with
    k.
    """
    sizes, weights, biases = [n_k, *hidden], [], []
    for a, b in itertools.pairwise(sizes):
        weights.append([[dyadic(rng, 1, bits) for _ in range(a)] for _ in range(b)])
        biases.append([dyadic(rng, F(1, 2), bits) for _ in range(b)])
    bend = [[dyadic(rng, 1, bits) for _ in range(sizes[-1])] for _ in range(n_p)]
    last = [[w * s / T for w in bend[j]] for s in range(1, T + 1) for j in range(n_p)]
    weights.append(
        last + [[dyadic(rng, F(1, 4), bits) for _ in range(sizes[-1])] for _ in range(n_q)]
    )
    drive = [F(length * s, T) if j == 0 else F(0) for s in range(1, T + 1) for j in range(n_p)]
    biases.append(drive + [F(0)] * n_q)
    return {"weights": text(weights), "biases": text(biases)}


def random_tube(rng, bins=(2, 1), n_p=2, n_q=1, T=6, size=F(1, 16)):
    """Widths between size/2 and size on equal bins of [-1, 1]."""
    edges = [[F(2 * i, b) - 1 for i in range(b + 1)] for b in bins]

    def draw(*shape):
        if not shape:
            return size * (1 + abs(dyadic(rng, 1, 6))) / 2
        return [draw(*shape[1:]) for _ in range(shape[0])]

    n = math.prod(bins)
    return {
        "edges": text(edges),
        "interval": text(draw(n, T, 1, n_p)),
        "final": text(draw(n, n_p + n_q)),
    }


def random_obstacle(rng, centre, size):
    """A convex polygon of 4 to 6 facets about a centre as half-spaces."""
    rows = box_rows([c - size for c in centre], [c + size for c in centre])
    for _ in range(rng.randint(0, 2)):
        a = [F(rng.randint(1, 4)) * rng.choice((-1, 1)) for _ in centre]
        rows["A"].append(text(a))
        rows["b"].append(text(dot(a, centre) + size * rng.randint(2, 5)))
    return rows


DISC = {"radius": "0.2"}
TRIANGLE = {"vertices": [["0.3", "0"], ["-0.2", "0.1"], ["-0.2", "-0.1"]]}


def scene(
    seed,
    hidden=(4, 3),
    T=6,
    n_q=1,
    n_k=2,
    bins=(2, 1),
    body=DISC,
    starts=True,
    counts=(2, 2, 2),
    bits=10,
):
    """An answer to a random problem in the plane, with so many samples, sets and corridors that
    prove it.
    """
    rng = random.Random(seed)
    network, tube = (
        random_network(rng, n_k, 2, n_q, T, hidden, bits=bits),
        random_tube(rng, bins, 2, n_q, T),
    )
    k0, p0 = [dyadic(rng, F(7, 8)) for _ in range(n_k)], [dyadic(rng, 1), dyadic(rng, 1)]
    problem = {
        "n_p": 2,
        "points": 1,
        "n_q": n_q,
        "n_k": n_k,
        "domain": {"lo": ["-1"] * n_k, "hi": ["0x1p+0"] * n_k},
        "steps": T,
    }
    problem |= {"dt": "0.05", "obstacles": [], "start": None, "body": one_part(copy.deepcopy(body))}
    if starts:
        problem["start"] = box_rows([v - F(1, 4) for v in p0], [v + F(1, 4) for v in p0])
    knots, q = path(problem, network, p0, k0)
    end = [*knots[-1], *q]
    problem["goal"] = box_rows([v - F(3, 4) for v in end], [v + F(3, 4) for v in end])
    while len(problem["obstacles"]) < 2:
        centre = [dyadic(rng, 3) + 2 + p0[0], dyadic(rng, 2) + p0[1]]
        new = random_obstacle(rng, centre, F(rng.randint(1, 4), 8))
        if rng.random() < 0.3:
            new["steps"] = sorted([rng.randrange(T), rng.randrange(T)])
        if separation({**problem, "obstacles": [new]}, knots, widths(tube, k0)[0]) is not None:
            problem["obstacles"].append(new)
    found = [sample(problem, network, tube, p0, k0)]
    while len(found) < max(counts):
        near = [[v + dyadic(rng, F(1, 16)) for v in x] for x in (p0, k0)]
        if (extra := sample(problem, network, tube, *near)) is not None:
            found.append(extra)
    samples, sets, corridors = (found[:count] for count in counts)
    sets = [piece(network, tube, s) for s in sets]
    return answer(problem, network, tube, samples, sets, corridors=corridors)
