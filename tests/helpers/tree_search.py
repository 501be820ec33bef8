"""A plain branch and bound that writes no_plan parts for the tests; it asks the checker which
leaves it accepts.
"""

import itertools
import math
from fractions import Fraction as F

import answer_files as build

from parc_jax import checker
from parc_jax.checker import no_plan


def goal_faces(n_p, n_q):
    """Faces of z for a goal made by `build.box_rows`."""
    return [[[[n_p + n_q + i, "1"]], [[i, "1"]]] for i in range(n_p)]


def goal_box(problem, tube):
    """Bounds of z for such a goal and the least error at the end, which is one of the last interval
    too.
    """
    n_p, n = problem["n_p"], problem["n_p"] + problem["n_q"]
    b = build.value(problem["goal"]["b"])
    last = [interval[-1][0] for interval in build.value(tube["interval"])]
    e = [min(v) for v in zip(*build.value(tube["final"]), strict=True)]
    e[:n_p] = [min(v) for v in zip(e, *last, strict=False)]
    return [e[i] - b[n + i] for i in range(n_p)], [b[i] - e[i] for i in range(n_p)]


def contacts(problem, e):
    """A handful of extreme contacts of the only point: body point (or weights) and error."""
    (body,) = problem["body"]["parts"]
    if "vertices" in body:
        m = len(body["vertices"])
        points = [[F(int(i == j)) for j in range(m)] for i in range(m)]
    else:
        r, unit = build.value(body["radius"]), [F(s * v, 5) for v in (0, 3, 4, 5) for s in (1, -1)]
        points = [[a * r, b * r] for a in unit for b in unit if a * a + b * b == 1]
    errors = [
        [s * x for s, x in zip(signs, e, strict=True)]
        for signs in itertools.product((1, -1), repeat=len(e))
    ]
    return [build.text([p, [error]]) for p in points for error in errors]


def accepted(leaves, name, what, lo, hi, bounded=False):
    try:
        leaves.check(name, what, bounded, lo, hi)
    except checker.Rejected:
        return False
    return True


def unsafe_leaf(leaves, name, what, lo, hi):
    """A leaf of this reason, by bounds where they do, or None."""
    if accepted(leaves, name, what, lo, hi, bounded=True):
        return {"bounded": {name: what}}
    return {name: what} if accepted(leaves, name, what, lo, hi) else None


def leaf(context, problem, network, tube, lo, hi):
    """A leaf that the checker accepts for this box, or None."""
    n, T = problem["n_p"], problem["steps"]
    leaves = no_plan.Leaves(context)
    middle = [(a + b) / 2 for a, b in zip(lo, hi, strict=True)]
    k = middle[n:]
    _, y = build.evaluate(network, k)
    p0 = [z - c for z, c in zip(middle[:n], y[(T - 1) * n : T * n], strict=True)]
    knots, _ = build.path(problem, network, p0, k)
    found = build.sample(problem, network, tube, p0, k)
    if found is not None:
        return {"safe": found["sep"]} if accepted(leaves, "safe", found["sep"], lo, hi) else None
    for name, rows in (("goal", problem["goal"]), ("start", problem["start"] or {"b": []})):
        for i in range(len(rows["b"])):
            made = unsafe_leaf(leaves, name, [[i, "1"]], lo, hi)
            if made is not None:
                return made
    bins = context.bins_meeting(lo[n:], hi[n:], closed=False)
    interval = list(zip(*(build.value(tube["interval"][b]) for b in bins), strict=True))
    for o, obstacle in enumerate(problem["obstacles"]):
        first, last = obstacle.get("steps", [0, T - 1])
        rows = list(zip(build.value(obstacle["A"]), build.value(obstacle["b"]), strict=True))
        depth = {}
        for t in range(first, last + 1):
            for alpha in (F(0), F(1, 2)):
                p = [(1 - alpha) * a + alpha * b for a, b in zip(*knots[t : t + 2], strict=True)]
                depth[t, alpha] = max((build.dot(a, p) - b) / build.norm_up(a) for a, b in rows)
        for t, alpha in sorted(depth, key=depth.get)[:2]:
            e = [min(widths) for widths in zip(*(of for (of,) in interval[t]), strict=True)]
            what = [o, 0, t, build.text(alpha), [[["1"], contacts(problem, e)]]]
            made = unsafe_leaf(leaves, "hit", what, lo, hi) if depth[t, alpha] < 1 else None
            if made is not None:
                return made
    return None


def grow(problem, network, tube, kind="bracket", depth=6):
    """A no_plan part; with kind "proved" it is only valid if no box is left open or safe."""
    context = checker.Context(problem, network, tube)
    zlo, zhi = goal_box(problem, tube)

    def decide(lo, hi):
        return leaf(context, problem, network, tube, lo, hi)

    return {
        "kind": kind,
        "z": {"lo": build.text(zlo), "hi": build.text(zhi)},
        "faces": goal_faces(problem["n_p"], problem["n_q"]),
        "tree": tree_of([*zlo, *context.lo], [*zhi, *context.hi], decide, depth),
    }


def tree_of(lo, hi, decide, depth):
    """The nodes of a tree over a box, as a part lists them: decide(lo, hi) gives a leaf or None,
    and what has none is halved along its relatively widest axis, `depth` times at most.
    """
    stack, tree = [(lo, hi, 0)], []
    root = [b - a for a, b in zip(lo, hi, strict=True)]
    while stack:
        lo, hi, level = stack.pop()
        node = decide(lo, hi)
        if node is None and level < depth:
            axis = max(range(len(lo)), key=lambda i: (hi[i] - lo[i]) / root[i])
            at = (lo[axis] + hi[axis]) / 2
            node = {"split": [axis, build.text(at)]}
            stack.append(([*lo[:axis], at, *lo[axis + 1 :]], hi, level + 1))
            stack.append((lo, [*hi[:axis], at, *hi[axis + 1 :]], level + 1))
        tree.append({"open": None} if node is None else node)
    return tree


def boxes(plan, lo, hi):
    """(name, lo, hi) of the leaves of a tree over a box, in floats."""
    nodes, stack = iter(plan["tree"]), [(list(lo), list(hi))]
    for node in nodes:
        (name, what), (lo, hi) = *node.items(), stack.pop()
        if name == "split":
            axis, at = what[0], build.value(what[1])
            stack += [
                ([*lo[:axis], at, *lo[axis + 1 :]], hi),
                (lo, [*hi[:axis], at, *hi[axis + 1 :]]),
            ]
        else:
            yield next(iter(what)) if name == "bounded" else name, lo, hi


def volume(lo, hi):
    return math.prod(b - a for a, b in zip(lo, hi, strict=True))


def corners(lo, hi):
    return itertools.product(*zip(lo, hi, strict=True))
