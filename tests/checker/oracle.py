"""A dense oracle in floats: plans in the plane, checked at 201 points of every segment against the grown obstacle.

One-sided: it reports contact deeper than 1e-9 m and a goal missed by more than 1e-9, so rounding never accuses a proof.
"""

import build
import numpy as np

DEPTH = 1e-9  # [m] far above rounding of these scenes, far below anything that matters


def array(x):
    return np.array([[float(v) for v in row] for row in build.value(x)])


def polygon(obstacle):
    """Vertices of {A x <= b} in the plane, () if it is empty; it must be bounded."""
    A, b = array(obstacle["A"]), np.array([float(v) for v in build.value(obstacle["b"])])
    points = []
    for i in range(len(b)):
        for j in range(i):
            M = A[[i, j]]
            if abs(np.linalg.det(M)) > 1e-12:
                x = np.linalg.solve(M, b[[i, j]])
                if (A @ x <= b + 1e-9 * (1 + np.abs(b))).all():
                    points.append(x)
    return np.array(points)


def turn(a, b, c):
    """Positive if a, b, c turn left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def hull(points):
    """Convex hull, counter-clockwise (monotone chain)."""
    points = sorted(map(tuple, points))
    halves = []
    for order in (points, points[::-1]):
        half = []
        for p in order:
            while len(half) > 1 and turn(half[-2], half[-1], p) <= 0:
                half.pop()
            half.append(p)
        halves += half[:-1]
    return np.array(halves)


def distance(vertices, points):
    """Distance of points (m, 2) to a convex polygon; negative inside."""
    a, b = vertices, np.roll(vertices, -1, axis=0)
    edge = b - a
    share = np.clip(np.einsum("mvi,vi->mv", points[:, None] - a[None], edge) / (edge**2).sum(1)[None], 0, 1)
    nearest = np.linalg.norm(points[:, None] - a[None] - share[..., None] * edge[None], axis=-1).min(1)
    outward = np.stack([edge[:, 1], -edge[:, 0]], 1) / np.linalg.norm(edge, axis=1)[:, None]
    beyond = np.einsum("mvi,vi->mv", points[:, None] - a[None], outward).max(1)
    return np.where(beyond > 0, nearest, beyond)


class Oracle:
    """The scene of an answer in floats."""

    def __init__(self, answer):
        self.problem, self.network, self.tube = answer["problem"], answer["network"], answer["tube"]
        body = self.problem["body"]
        self.radius = float(build.value(body["radius"])) if "radius" in body else 0.0
        shape = -array(body["vertices"]) if "vertices" in body else np.zeros((1, 2))
        self.grown = []
        for obstacle in self.problem["obstacles"]:
            first, last = obstacle.get("steps", [0, self.problem["steps"] - 1])
            base = polygon(obstacle)
            self.grown.append((first, last, base if len(base) == 0 else (base[:, None] + shape[None]).reshape(-1, 2)))

    def gap(self, knots, interval):
        """Smallest distance of a path to the obstacles grown by body and widths; negative in contact."""
        knots, gap = np.array([[float(v) for v in p] for p in knots]), np.inf
        for first, last, base in self.grown:
            for t in range(first, last + 1) if len(base) else ():
                e = np.array([float(v) for v in interval[t]])
                corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * e[None]
                share = np.linspace(0, 1, 201)[:, None]
                segment = (1 - share) * knots[t][None] + share * knots[t + 1][None]
                vertices = hull((base[:, None] + corners[None]).reshape(-1, 2))
                gap = min(gap, distance(vertices, segment).min() - self.radius)
        return gap

    def margin(self, knots, q, final):
        """Smallest slack of the goal and start rows, normalised; negative if missed."""
        end, slack = [*knots[-1], *q], np.inf
        for rows, x, e in ((self.problem["goal"], end, final), (self.problem["start"], knots[0], [0] * len(knots[0]))):
            for a, b in zip(build.value(rows["A"]), build.value(rows["b"]), strict=True) if rows else ():
                size = float(max(map(abs, a))) or 1.0
                slack = min(slack, float(b - build.dot(a, x) - build.dot(map(abs, a), e)) / size)
        return slack

    def safe(self, p0, k):
        """False if the plan is seen to fail by more than rounding could explain."""
        lo, hi = (build.value(self.problem["domain"][side]) for side in ("lo", "hi"))
        if not all(a <= x <= b for a, x, b in zip(lo, k, hi, strict=True)):
            return False
        knots, q = build.path(self.problem, self.network, p0, k)
        interval, final = build.widths(self.tube, k)
        return bool(self.margin(knots, q, final) >= -DEPTH and self.gap(knots, interval) >= -DEPTH)
