"""A dense oracle in floats: plans of one point in the plane, checked at 201 points of every segment
against the grown obstacle.

One-sided: it reports contact deeper than 1e-9 m and a goal missed by more than 1e-9, so rounding
never accuses a proof.
"""

import answer_files as build
import numpy as np
from dense_oracle import convex_hull, distance, polygon_corners

DEPTH = 1e-9  # [m] far above rounding of these scenes, far below anything that matters


def array(x):
    """Nested number strings as a float array."""
    return np.array([array(v) if isinstance(v, list) else float(build.value(v)) for v in x])


def polygon(obstacle):
    """Vertices of {A x <= b} in the plane, none if it is empty; it must be bounded."""
    return polygon_corners(array(obstacle["A"]), array(obstacle["b"]))


class Oracle:
    """The scene of an answer in floats."""

    def __init__(self, answer):
        self.problem, self.network, self.tube = answer["problem"], answer["network"], answer["tube"]
        self.layers = [(array(W), array(b)) for W, b in zip(*self.network.values(), strict=True)]
        self.edges, self.final = ([array(v) for v in self.tube[key]] for key in ("edges", "final"))
        self.interval = [array(v)[:, 0] for v in self.tube["interval"]]  # of the only point
        (body,) = self.problem["body"]["parts"]
        self.radius = float(build.value(body["radius"])) if "radius" in body else 0.0
        shape = -array(body["vertices"]) if "vertices" in body else np.zeros((1, 2))
        self.grown = []
        for obstacle in self.problem["obstacles"]:
            first, last = obstacle.get("steps", [0, self.problem["steps"] - 1])
            base = polygon(obstacle)
            self.grown.append(
                (
                    first,
                    last,
                    base if len(base) == 0 else (base[:, None] + shape[None]).reshape(-1, 2),
                )
            )

    def path(self, p0, k):
        """(knots (T + 1, 2), q) of a plan."""
        x = k
        for depth, (W, b) in enumerate(self.layers, 1):
            x = W @ x + b
            x = np.maximum(x, 0) if depth < len(self.layers) else x
        T = self.problem["steps"]
        return p0[None] + np.vstack([np.zeros((1, 2)), x[: 2 * T].reshape(T, 2)]), x[2 * T :]

    def widths(self, k):
        """Widths (interval, final) of every closed bin that contains k."""
        bins = [0]
        for edge, x in zip(self.edges, k, strict=True):
            inside = [i for i in range(len(edge) - 1) if edge[i] <= x <= edge[i + 1]]
            bins = [n * (len(edge) - 1) + i for n in bins for i in inside]
        return [(self.interval[b], self.final[b]) for b in bins]

    def gap(self, knots, interval):
        """Smallest distance of a path to the obstacles grown by body and widths, at most 0.1;
        negative in contact.
        """
        gap = 0.1
        for first, last, base in self.grown:
            for t in range(first, last + 1) if len(base) else ():
                around = interval[t] + self.radius + gap
                ends = knots[t : t + 2]
                if (ends.max(0) + around < base.min(0)).any() or (
                    ends.min(0) - around > base.max(0)
                ).any():
                    continue  # too far away to matter
                corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * interval[t][None]
                share = np.linspace(0, 1, 201)[:, None]
                segment = (1 - share) * ends[0][None] + share * ends[1][None]
                vertices = convex_hull((base[:, None] + corners[None]).reshape(-1, 2))
                gap = min(gap, distance(vertices, segment).min() - self.radius)
        return gap

    def margin(self, knots, q, final):
        """Smallest slack of the goal and start rows, normalised; negative if missed."""
        end, slack = np.concatenate([knots[-1], q]), np.inf
        for rows, x, e in (
            (self.problem["goal"], end, final),
            (self.problem["start"], knots[0], np.zeros(2)),
        ):
            if rows is not None:
                A = array(rows["A"])
                size = np.maximum(np.abs(A).max(1), 1e-300)
                slack = min(slack, ((array(rows["b"]) - A @ x - np.abs(A) @ e) / size).min())
        return slack

    def safe(self, p0, k):
        """False if the plan is seen to fail by more than rounding could explain."""
        p0, k = np.array(p0, float), np.array(k, float)
        if (k < array(self.problem["domain"]["lo"])).any() or (
            k > array(self.problem["domain"]["hi"])
        ).any():
            return False
        knots, q = self.path(p0, k)
        return all(
            self.margin(knots, q, final) >= -DEPTH and self.gap(knots, interval) >= -DEPTH
            for interval, final in self.widths(k)
        )
