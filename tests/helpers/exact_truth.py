"""Is a plan of an answer file safe, by the definition and in plain fractions? It shares nothing
with the checker: no separating directions and no affine maps, but polygons and distances.

At a border between bins a plan is safe if it is so in every closed bin that contains k.
"""

import itertools
from fractions import Fraction as F

import answer_files as build
import exact_oracle


class Truth:
    """The scene of an answer in the plane; polygons grown by body and tube are remembered."""

    def __init__(self, answer):
        self.problem, self.network, self.tube = (answer[p] for p in ("problem", "network", "tube"))
        (body,) = self.problem["body"]["parts"]
        self.radius = build.value(body.get("radius", "0"))
        self.body = build.value(body["vertices"]) if "vertices" in body else [[F(0), F(0)]]
        self.interval = build.value(self.tube["interval"])
        self.grown = {}

    def safe(self, p0, k):
        """Strictly clear of every obstacle, for every trajectory in the tube; start and goal
        met.
        """
        bins = build.bins_of(self.tube, k)
        lo, hi = (build.value(self.problem["domain"][side]) for side in ("lo", "hi"))
        if not bins or not all(a <= x <= b for a, x, b in zip(lo, k, hi, strict=True)):
            return False
        knots, q = build.path(self.problem, self.network, p0, k)
        if not build.reaches(self.problem, self.tube, knots, q, k):
            return False
        for o, obstacle in enumerate(self.problem["obstacles"]):
            first, last = obstacle.get("steps", [0, self.problem["steps"] - 1])
            for t, b in itertools.product(range(first, last + 1), bins):
                if not self.clear(o, t, b, knots[t], knots[t + 1]):
                    return False
        return True

    def clear(self, o, t, number, a, b):
        """Whether the segment from a to b is farther than the radius from the obstacle, grown by
        the widths of a bin.
        """
        if (o, t, number) not in self.grown:
            (error,) = self.interval[number][t]
            corners = grown_polygon(self.problem["obstacles"][o], self.body, error)
            box = [(min(c[j] for c in corners), max(c[j] for c in corners)) for j in (0, 1)]
            self.grown[o, t, number] = corners, box
        corners, box = self.grown[o, t, number]
        for j in (0, 1):  # far apart along an axis
            if min(a[j], b[j]) > box[j][1] + self.radius:
                return True
            if max(a[j], b[j]) < box[j][0] - self.radius:
                return True
        if exact_oracle.meets(a, b, corners):
            return False
        sides = zip(corners, corners[1:] + corners[:1], strict=True)
        closest = min(
            min(
                exact_oracle.to_segment(a, c, d),
                exact_oracle.to_segment(b, c, d),
                exact_oracle.to_segment(c, a, b),
            )
            for c, d in sides
        )
        return closest > self.radius**2


def grown_polygon(obstacle, body, error):
    """Corners, counter-clockwise, of obstacle + (-body) + box(error)."""
    rows = (build.value(obstacle[side]) for side in ("A", "b"))
    return exact_oracle.grown(*rows, body, error)
