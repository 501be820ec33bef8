"""Branch and bound for no_plan parts of several points and parts: templates, errors of
goal rows, mixtures. It asks the checker which leaves it accepts.

The box of z is the goal's, not shrunken: faces with the error zero, or the larger widths, hold.
"""

import itertools
from fractions import Fraction as F

import answer_files as build
import tree_search

from parc_jax import checker
from parc_jax.checker import no_plan

TRIES = 3  # body points, and errors, of the contacts of a group


def plain_end(tube):
    """Whether all errors at the end are half widths."""
    last = [error for interval in tube["interval"] for error in interval[-1]]
    return all(isinstance(error, list) for error in [*tube["final"], *last])


def uses(tube, row, size, *errors):
    """Ways to use a row of the goal: without an error where there may be one, with each error."""
    named = [[[row, "1", build.text(error)]] for error in ([F(0)] * size, *errors)]
    return ([[[row, "1"]]] if plain_end(tube) else []) + named


def farthest(problem, tube, row):
    """An error of the end along a row of the goal, half as far as the first bin has it."""
    final = tube["final"][0]
    if isinstance(final, dict):  # a box: its rows are + and - of each axis
        limits = build.value(final["b"])
    else:
        limits = [e for e in build.value(final) for _ in range(2)]
    a = build.value(problem["goal"]["A"][row])
    size = [limits[2 * j + int(x < 0)] * ((x > 0) - (x < 0)) for j, x in enumerate(a)]
    return [x / 2 for x in size]


def body_points(rng, part, n):
    """Some points of the shape of a part: coordinates in a disc, weights of a polygon."""
    if "vertices" in part:
        m = len(part["vertices"])
        return [[F(int(i == j)) for j in range(m)] for i in rng.sample(range(m), min(TRIES, m))]
    r = build.value(part["radius"])
    units = [[F(s * (i == a)) * r for i in range(n)] for a in range(n) for s in (1, -1)]
    return [[F(0)] * n, *rng.sample(units, TRIES)]


def hit(rng, problem, corners, bins, o, which, t, alpha):
    """Groups of contacts: each point by itself, and the middle of all. corners(bin, t, i): points
    of the set of errors of point i, whose hull it is.
    """
    n = problem["n_p"]
    part = problem["body"]["parts"][which]
    m = len(part["points"])
    errors = [[[F(0)] * n] * m]
    for _ in range(TRIES):
        b = rng.choice(bins)
        errors.append([[x / 2 for x in rng.choice(corners(b, t, i))] for i in part["points"]])
    contacts = list(itertools.product(body_points(rng, part, n), errors))
    mixtures = [[F(int(i == j)) for j in range(m)] for i in range(m)] + [[F(1, m)] * m]
    groups = [[weights, contacts] for weights in mixtures]
    return build.text([F(0), groups])[1], build.text(alpha)


def leaf(rng, context, question, corners, lo, hi, attempt):
    """A leaf that the checker accepts for this box, or None."""
    problem, _network, tube = question
    n, size = problem["n_p"], problem["points"] * problem["n_p"] + problem["n_q"]
    leaves = no_plan.Leaves(context)
    for row in range(len(problem["goal"]["b"])):
        for what in uses(tube, row, size, farthest(problem, tube, row)):
            made = tree_search.unsafe_leaf(leaves, "goal", what, lo, hi)
            if made is not None:
                return made
    middle = [(a + b) / 2 for a, b in zip(lo, hi, strict=True)]
    sep = attempt(middle)
    if tree_search.accepted(leaves, "safe", sep, lo, hi):
        return {"safe": sep}
    bins = context.bins_meeting(lo[n:], hi[n:], closed=False)
    for o, obstacle in enumerate(problem["obstacles"]):
        first, last = obstacle.get("steps", [0, problem["steps"] - 1])
        for which in range(len(problem["body"]["parts"])):
            t = rng.randint(first, last)
            alpha = rng.choice([F(0), F(1, 2), F(1)])
            groups, share = hit(rng, problem, corners, bins, o, which, t, alpha)
            what = [o, which, t, share, groups]
            made = tree_search.unsafe_leaf(leaves, "hit", what, lo, hi)
            if made is not None:
                return made
    return None


def grow(rng, question, corners, attempt, depth):
    """A bracket. attempt(middle of a box): the separation of the plan there."""
    problem, _network, tube = question
    context = checker.Context(*question)
    n, size = problem["n_p"], problem["points"] * problem["n_p"] + problem["n_q"]
    b = build.value(problem["goal"]["b"])
    z = [[-b[size + i] for i in range(n)], b[:n]]

    def decide(lo, hi):
        return leaf(rng, context, question, corners, lo, hi, attempt)

    tree = tree_search.tree_of([*z[0], *context.lo], [*z[1], *context.hi], decide, depth)
    faces = [[uses(tube, row, size)[0] for row in (size + i, i)] for i in range(n)]
    box = {"lo": build.text(z[0]), "hi": build.text(z[1])}
    return {"kind": "bracket", "z": box, "faces": faces, "tree": tree}
