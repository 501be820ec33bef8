"""The checker's second part: proofs that no plan exists, and exact volumes of safe and unsafe plans.

Standard library only. Loaded by checker.py when an answer has a no_plan part; copy both files to use it alone.
A proof is a binary tree of boxes over (z, k), z = p_T = p0 + c_T(k). A leaf is checked at its vertices: each corner of
z with each vertex of a cell of the network inside the leaf's box of k. The cells are derived here, in exact arithmetic.
`checker` holds the functions of checker.py and `context` is its Context; they are arguments, not imported.
"""

import collections
import itertools
import math
import operator

MAX_POINTS = 20_000
UNSAFE = ("goal", "start", "hit")


def network_cells(checker, context, lo, hi):
    """Yields the cells of the network in a box of k with interior, as {vertex: (neurons, outputs, scale)} (T16).

    A cell is a list of vertices (homogeneous coordinates, bit set of the facets through it). All earlier neurons keep
    their sign on it, so the next neuron is affine on it. If that has both signs at vertices it splits the cell; new
    vertices are its zeros on edges, and two vertices span an edge if no third lies on all facets they share.
    """
    known, first = {}, []
    for sides in itertools.product((0, 1), repeat=context.n_k):
        corner, scale = checker.integers([(lo, hi)[side][i] for i, side in enumerate(sides)])
        first.append(((*corner, scale), sum(1 << 2 * i + side for i, side in enumerate(sides))))
    stack = [(first, 0)]
    while stack:
        cell, start = stack.pop()
        known |= {p: context.evaluate([p[:-1]], p[-1]) for p, _ in cell if p not in known}
        checker.need(len(known) <= MAX_POINTS, "too many cells in a leaf")
        for j in range(start, context.n_neurons):
            signs = [known[p][0][j][0] for p, _ in cell]
            if min(signs) < 0 < max(signs):
                stack += split(cell, signs, 1 << 2 * context.n_k + j, j + 1)
                break
        else:
            yield {p: known[p] for p, _ in cell}


def split(cell, values, facet, then):
    """The parts of a cell where an affine function with these values at the vertices is >= 0 and <= 0."""
    new, vertices = [], list(zip(cell, values, strict=True))
    for ((p, f), x), ((q, g), y) in itertools.product(vertices, repeat=2):
        if y < 0 < x and sum(h & f & g == f & g for _, h in cell) == 2:
            zero = [x * b - y * a for a, b in zip(p, q, strict=True)]  # values scale with the homogeneous coordinates
            common = math.gcd(*zero)
            new.append((tuple(v // common for v in zero), f & g | facet))
    for side in (1, -1):
        yield [(p, f | facet if x == 0 else f) for (p, f), x in vertices if x * side >= 0] + new, then


def contact(checker, context, what, widths):
    """The offset of a contact: a point of the body plus an error inside the tube."""
    (body, error), n = what, context.n_p
    error = checker.vector(error, n)
    inside = all(abs(x) * context.e_scale <= e for x, e in zip(error, widths, strict=False))
    checker.need(inside, "the error of a contact is outside the tube")
    if context.vertices is None:
        body = checker.vector(body, n)
        checker.need(checker.dot(body, body) <= context.radius**2, "the body point of a contact is outside the disc")
    else:
        weights = checker.vector(body, len(context.vertices))
        checker.need(all(v >= 0 for v in weights), "a weight of a contact is negative")
        checker.need(sum(weights) == 1, "the weights of a contact do not sum to one")
        body = [checker.dot(weights, column) for column in zip(*context.vertices, strict=True)]
    return [x + y for x, y in zip(body, error, strict=False)]


def hit(checker, context, what, interval):
    """Per contact, conditions on (p0, y) that p + point is in the obstacle, p = the share alpha of interval t."""
    o, t, alpha, contacts = what
    rows, first, last = context.obstacles[checker.whole(o, 0, len(context.obstacles) - 1)]
    n, t, alpha = context.n_p, checker.whole(t, first, last), checker.number(alpha)
    checker.need(0 <= alpha <= 1, "a hit is outside its interval")
    shares = (1 - alpha, alpha) if t else (alpha,)  # c_0 = 0 is not an output
    part = slice(max(t - 1, 0) * n, (t + 1) * n)
    for entry in contacts:
        point, found = contact(checker, context, entry, interval[t]), []
        for a, b in rows:
            a, b = [-x for x in a], b - checker.dot(a, point)
            found.append(checker.condition("", False, a, [x * share for share in shares for x in a], part, b))
        yield found


def check_leaf(checker, context, name, what, lo, hi, cells):
    """Proves that all (z, k) of a box are safe, or miss the goal, or start outside the start set, or hit an obstacle.

    p0 and y are affine on each cell times the box of z, and each condition is affine in them: one that holds at all
    vertices holds everywhere. Several contacts may share a hit, since the obstacle grown by body and tube is convex.
    Unsafe leaves use the least widths of the bins they overlap, since whatever fails for these fails for wider ones.
    """
    n = context.n_p
    interval, final = context.widths(lo[n:], hi[n:], operator.lt, max if name == "safe" else min)
    if name == "safe":
        options = [list(context.conditions(what, interval, final))]
    elif name == "goal":  # a combination of goal rows that (z, q) violates
        w, h = checker.combine(context.shrunken_goal(final), what)
        options = [[checker.condition("", True, w[:n], w, context.end, -h)]]
    elif name == "start":  # a combination of start rows that p0 violates
        w, h = checker.combine(context.start, what)
        options = [[checker.condition("", True, w, [], slice(0), -h)]]
    else:
        options = list(hit(checker, context, what, interval))
    if name == "goal" and not any(w[n:]):
        points = [([0] * (context.T * n + context.n_q), 1)]  # the condition is about z alone
    else:
        points = cells(lo[n:], hi[n:])
    for y, scale in points:
        for corner in itertools.product(*zip(lo[:n], hi[:n], strict=True)):
            z, z_scale = checker.integers(corner)
            p0 = [x * scale - c * z_scale for x, c in zip(z, y[context.end], strict=False)]
            held = any(all(checker.holds(c, p0, z_scale * scale, y, scale) for c in option) for option in options)
            checker.need(held, f"a {name} leaf fails at one of its vertices")


def check_no_plan(checker, context, plan):
    """Proves that no (p0, k) is safe, or brackets the volume of those that are: a dict of kind and exact volumes.

    (p0, k) -> (z, k) is a bijection that keeps volume (T15). The faces prove that each plan that meets the goal for
    the least final error has z in the stated box; the leaves tile this box times the domain, by the tree's build.
    """
    checker.fields(plan, ("kind", "z", "faces", "tree"))
    n, need = context.n_p, checker.need
    lo, hi = checker.box(plan["z"], n)
    need(all(a < b for a, b in zip(lo + context.lo, hi + context.hi, strict=True)), "the box of (z, k) is flat")
    goal = context.shrunken_goal(context.widths(context.lo, context.hi, operator.le, min)[1])
    for i, pair in enumerate(checker.array(plan["faces"], n)):
        for sign, bound, multipliers in zip((-1, 1), (-lo[i], hi[i]), pair, strict=True):
            w, h = checker.combine(goal, multipliers)
            need(w == [sign * (i == j) for j in range(n + context.n_q)], "a face of z has another direction")
            need(h <= bound, "a face of z does not follow from the goal")
    allowed = {"proved": UNSAFE, "bracket": (*UNSAFE, "safe", "open")}[plan["kind"]]
    stack, nodes = [(lo + context.lo, hi + context.hi)], iter(plan["tree"])
    volumes, seen = collections.Counter(), {}

    def cells(lo, hi):  # leaves next to each other in the tree often share their box of k
        if (*lo, *hi) not in seen:
            seen.clear()
            points = {p: v for cell in network_cells(checker, context, lo, hi) for p, v in cell.items()}
            seen[*lo, *hi] = [(y, scale) for _, (y,), scale in points.values()]
        return seen[*lo, *hi]

    while stack:
        lo, hi = stack.pop()
        ((name, what),) = next(nodes).items()
        if name == "split":
            i, at = what
            i, at = checker.whole(i, 0, len(lo) - 1), checker.number(at)
            need(lo[i] < at < hi[i], "a split is outside its box")
            stack += [([*lo[:i], at, *lo[i + 1 :]], hi), (lo, [*hi[:i], at, *hi[i + 1 :]])]  # lower part on top
            continue
        need(name in allowed, f"a leaf {name!r} has no place here")
        if name != "open":
            check_leaf(checker, context, name, what, lo, hi, cells)
        volumes[name] += math.prod(b - a for a, b in zip(lo, hi, strict=True))
    need(next(nodes, None) is None, "the tree has nodes left over")
    unsafe = sum(volumes[name] for name in UNSAFE)
    sizes = {"safe": volumes["safe"], "unsafe": unsafe, "undecided": volumes["open"]}
    return {"kind": plan["kind"], **{name: str(size) for name, size in sizes.items()}}
