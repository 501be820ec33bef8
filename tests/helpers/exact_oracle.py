"""Is a plan safe, in rational arithmetic and by the definition? Slow, and shares nothing with
engine or checker.

Floats are the rationals that they hold.
"""

import itertools
from fractions import Fraction as F

import numpy as np


def exact_path(net, T: int, p0, k):
    """Exact knots [(x, y)] of a plan and further states."""
    h = [F(float(v)) for v in k]
    for depth, (W, b) in enumerate(zip(net.weights, net.biases, strict=True)):
        rows = zip(W.tolist(), b.tolist(), strict=True)
        h = [sum((F(w) * x for w, x in zip(row, h, strict=True)), F(c)) for row, c in rows]
        if depth < len(net.weights) - 1:
            h = [max(x, F(0)) for x in h]
    start = [F(float(v)) for v in p0]
    knots = [tuple(start)] + [(start[0] + h[2 * t], start[1] + h[2 * t + 1]) for t in range(T)]
    return knots, h[2 * T :]


def polygon(obstacle, body, e):
    """Exact corners (hull) of obstacle + (-body) + box(e)."""
    return grown([[F(x) for x in row] for row in obstacle.A], [F(v) for v in obstacle.b], body, e)


def grown(A, b, body, e):
    """The same of an obstacle {x : A x <= b} in fractions."""
    points = set()
    for i in range(len(A)):
        for j in range(i):
            det = A[i][0] * A[j][1] - A[i][1] * A[j][0]
            if det != 0:
                x = (b[i] * A[j][1] - b[j] * A[i][1]) / det
                y = (A[i][0] * b[j] - A[j][0] * b[i]) / det
                if all(a[0] * x + a[1] * y <= c for a, c in zip(A, b, strict=True)):
                    points.add((x, y))
    corners = {
        (x - bx + sx * e[0], y - by + sy * e[1])
        for (x, y), (bx, by) in itertools.product(points, body)
        for sx, sy in itertools.product((-1, 1), repeat=2)
    }
    return hull(corners)


def hull(points):
    """Convex hull, counter-clockwise."""
    chains, points = [], sorted(points)
    for order in (points, points[::-1]):
        chain = []
        for p in order:
            while len(chain) > 1 and turn(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        chains += chain[:-1]
    return chains or points


def turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def to_segment(p, a, b):
    """Squared distance of a point to a segment."""
    u = (b[0] - a[0], b[1] - a[1])
    length2 = u[0] ** 2 + u[1] ** 2
    s = (
        F(0)
        if length2 == 0
        else max(F(0), min(F(1), ((p[0] - a[0]) * u[0] + (p[1] - a[1]) * u[1]) / length2))
    )
    return (p[0] - a[0] - s * u[0]) ** 2 + (p[1] - a[1] - s * u[1]) ** 2


def meets(a, b, corners):
    """Do a segment and a closed polygon share a point?"""
    sides = list(zip(corners, corners[1:] + corners[:1], strict=True))
    for p in (a, b):
        if len(corners) > 2 and all(turn(c, d, p) >= 0 for c, d in sides):
            return True
    return any(cross(a, b, c, d) for c, d in sides)


def cross(a, b, c, d):
    """Do two closed segments share a point?"""
    s1, s2, s3, s4 = turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b)
    if s1 * s2 < 0 and s3 * s4 < 0:
        return True
    return 0 in (to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b))


def exact_safe(problem, model, p0, k) -> bool:
    """The truth: strictly clear of every obstacle for every trajectory inside the tube, goal and
    start met.
    """
    T, tube = model.time.n_steps, model.tube
    number = int(tube.bin_of(np.asarray(k)))
    for axis, x in enumerate(k):
        if not F(model.domain.lo[axis]) <= F(float(x)) <= F(model.domain.hi[axis]):
            return False
    knots, q = exact_path(model.net, T, p0, k)
    end, final = [*knots[-1], *q], [F(v) for v in tube.final[number].tolist()]
    for rows, x, widths in ((problem.goal, end, final), (problem.start, knots[0], [F(0)] * 2)):
        for a, b in zip(rows.A.tolist(), rows.b.tolist(), strict=True) if rows is not None else ():
            a = [F(v) for v in a]
            if sum(v * y + abs(v) * w for v, y, w in zip(a, x, widths, strict=True)) > F(b):
                return False
    radius = F(problem.body.radius) if hasattr(problem.body, "radius") else F(0)
    body = [(F(0), F(0))]
    if hasattr(problem.body, "vertices"):
        body = [(F(x), F(y)) for x, y in problem.body.vertices]
    for obstacle, span in zip(problem.obstacles, problem.spans, strict=True):
        first, last = (0, T - 1) if span is None else span
        for t in range(first, last + 1):
            corners = polygon(obstacle, body, [F(v) for v in tube.interval[number, t].tolist()])
            a, b = knots[t], knots[t + 1]
            if meets(a, b, corners):
                return False
            sides = zip(corners, corners[1:] + corners[:1], strict=True)
            closest = min(
                min(to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b)) for c, d in sides
            )
            if closest <= radius**2:
                return False
    return True
