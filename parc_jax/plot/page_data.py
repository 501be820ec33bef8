"""What the interactive page needs of an answer, as plain numbers."""

from itertools import combinations

import numpy as np

from parc_jax.certificate.write import network_part, part_hash, problem_part, tube_part
from parc_jax.errors import InputError
from parc_jax.io.answer_file import corridor_of
from parc_jax.plot import shapes

DIGITS = 6  # significant digits of an outline: enough for a screen


def page_data(answer) -> dict:
    """JSON-able numbers of an answer: scene, network, tube, certificates, outlines of the safe
    polytopes. Raises InputError.
    """
    model, problem = answer.model, answer.problem
    if model.n_p != 2:
        raise InputError(
            f"page: expected a planar workspace; this answer's has {model.n_p} dimensions."
        )
    directions = _Directions(np.asarray(answer.scene.obstacles.active)[: len(problem.obstacles)])
    interval, final = model.tube.finite_widths
    samples = [
        {
            "p0": part[:2].tolist(),
            "k": part[2:].tolist(),
            "sep": directions.number(corridor_of(answer.scene, certificate)),
        }
        for part, certificate in zip(answer.samples, answer.sample_parts, strict=True)
    ]
    corridors = [{"sep": directions.number(corridor)} for corridor in answer.corridors]
    polytopes = [
        {
            "sep": directions.number(polytope.corridor),
            "bin": int(polytope.bin),
            "pattern": "".join("1" if on else "0" for on in polytope.pattern),
        }
        for polytope in answer.polytopes
    ]
    return {
        "system": model.system,
        "labels": model.labels._asdict(),
        "level": answer.status.label,
        "statement": answer.statement(),
        "claim": model.claim.kind,
        "hash": {
            "problem": part_hash(problem_part(problem, model)),
            "network": part_hash(network_part(model.net)),
            "tube": part_hash(tube_part(model.tube)),
        },
        "share": answer.coverage.share,
        "corridor_share": answer.corridor_coverage.share,
        "n_k": model.n_k,
        "steps": model.time.n_steps,
        "dt": model.time.dt,
        "domain": {"lo": model.domain.lo.tolist(), "hi": model.domain.hi.tolist()},
        "goal": _rows(problem.goal),
        "goal_outline": shapes.shadow(problem.goal).tolist(),
        "start": None if problem.start is None else _rows(problem.start),
        "radius": float(answer.scene.obstacles.radius),
        "body": shapes.body_outline(problem.body).tolist(),
        "obstacles": _obstacles(answer),
        "network": {
            "weights": [W.tolist() for W in model.net.weights],
            "biases": [b.tolist() for b in model.net.biases],
        },
        "tube": {
            "edges": [edge.tolist() for edge in map(np.asarray, model.tube.edges)],
            "interval": interval.tolist(),
            "final": final.tolist(),
        },
        "samples": samples,
        "corridors": corridors,
        "polytopes": polytopes,
        "directions": directions.all,
        "outlines": outlines(answer),
    }


def outlines(answer) -> dict[str, list]:
    """Per pair of coordinates of (p0, k), written "i,j", the outlines [[x, y], ...] of the safe
    polytopes: of the workspace, and of all pairs of parameters.
    """
    n_p, n_k = answer.model.n_p, answer.model.n_k
    pairs = [(0, 1), *((n_p + i, n_p + j) for i, j in combinations(range(n_k), 2))]
    return {
        f"{i},{j}": [
            [[_short(x), _short(y)] for x, y in shapes.hull(points)]
            for points in answer.project((i, j))
        ]
        for i, j in pairs
    }


class _Directions:
    """Separating directions by number, each kept once: per obstacle its runs
    [first, end, w_x, w_y, support of obstacle and body along w].

    active (o, T): which obstacle exists when.
    """

    def __init__(self, active: np.ndarray):
        self.active, self.all = active, []
        self._known: dict[bytes, int] = {}

    def number(self, corridor) -> int:
        """The number of a corridor's directions."""
        w = np.asarray(corridor.w, np.float64)
        support = np.asarray(corridor.support, np.float64)
        spelled = w.tobytes() + support.tobytes()
        if spelled not in self._known:
            self._known[spelled] = len(self.all)
            n = len(self.active)  # those behind it only pad
            rows = zip(w[:n], support[:n], self.active, strict=True)
            self.all.append([_runs(*row) for row in rows])
        return self._known[spelled]


def _runs(w: np.ndarray, support: np.ndarray, active: np.ndarray) -> list[list]:
    """Runs of equal directions of one obstacle: w (T, 2), support (T,), active (T,)."""
    runs: list[list] = []
    for t in np.flatnonzero(active).tolist():
        now = [float(w[t, 0]), float(w[t, 1]), float(support[t])]
        if runs and runs[-1][2:] == now:
            runs[-1][1] = t + 1
        else:
            runs.append([t, t + 1, *now])
    return runs


def _obstacles(answer) -> list[dict]:
    grown, last = answer.scene.obstacles, answer.model.time.n_steps - 1
    return [
        {
            "outline": shapes.shadow(obstacle).tolist(),
            "corner": grown.corner[o].tolist(),
            "sign": grown.sign[o].tolist(),
            "steps": [0, last] if span is None else [int(i) for i in span],
        }
        for o, (obstacle, span) in enumerate(
            zip(answer.problem.obstacles, answer.problem.spans, strict=True)
        )
    ]


def _rows(polytope) -> dict:
    return {"A": polytope.A.tolist(), "b": polytope.b.tolist()}


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
