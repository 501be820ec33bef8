"""What the interactive page needs of an answer, as plain numbers."""

from itertools import combinations

import numpy as np

from parc_jax.app.plot import shapes
from parc_jax.app.plot.views import views_of
from parc_jax.checker import PARTS
from parc_jax.common.sets.vertices import vertices
from parc_jax.learning.bound.error_set import NO_CLAIM
from parc_jax.learning.bound.statement import in_short
from parc_jax.problem.body import Disc, numbered
from parc_jax.proof.certificate.read import corridor_of
from parc_jax.proof.certificate.write import corridor_part, part_hash, question_parts
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.verdict.scene import unpruned_scene

DIGITS = 6  # significant digits of an outline: enough for a screen


def page_data(answer) -> dict:
    """JSON-able numbers of an answer: scene, network, tube, certificates, outlines of the safe
    polytopes.
    """
    model, problem = answer.model, answer.problem
    sides = [view.axes for view in views_of(model.n_p)]
    goals = shapes.goals(problem.goal, model.n_p, model.n_points, sides)
    return {
        **model_data(model, problem),
        **_plans(answer),
        "system": model.system,
        "labels": model.labels._asdict(),
        "level": answer.status.label,
        "statement": answer.statement(),
        "claim": in_short(model.claim),
        "hash": {
            name: part_hash(part)
            for name, part in zip(PARTS, question_parts(problem, model), strict=True)
        },
        "share": answer.coverage.share,
        "corridor_share": answer.corridor_coverage.share,
        "views": [view._asdict() for view in views_of(model.n_p)],
        "goal_box": {"lo": answer.scene.z_lo.tolist(), "hi": answer.scene.z_hi.tolist()},
        "goals": [
            {"points": points, "outlines": [outline.tolist() for outline in outlines]}
            for points, outlines in goals
        ],
        "outlines": outlines(answer),
    }


def model_data(model, problem) -> dict:
    """What the page's verdict on a plan needs, without corridors and polytopes: network, tube,
    body, goal, start, obstacles.
    """
    tube = model.tube
    lost = tube.support_at_end(problem.goal.A, np.arange(tube.n_bins))
    return {
        "n_p": model.n_p,
        "n_k": model.n_k,
        "points": model.points,
        "steps": model.time.n_steps,
        "dt": model.time.dt,
        "domain": {"lo": model.domain.lo.tolist(), "hi": model.domain.hi.tolist()},
        "goal": _rows(problem.goal),
        "start": None if problem.start is None else _rows(problem.start),
        "parts": [_part(part, model.n_p) for part in numbered(problem.body, model.points)],
        "obstacles": _obstacles(problem, model.time.n_steps, views_of(model.n_p)),
        "network": {
            "weights": [W.tolist() for W in model.net.weights],
            "biases": [b.tolist() for b in model.net.biases],
        },
        "tube": {
            "edges": [edge.tolist() for edge in map(np.asarray, tube.edges)],
            "interval": tube.finite_widths[0].tolist(),
            "faces": None if tube.templates is None else _faces(tube.templates.interval),
            "lost": np.minimum(lost, NO_CLAIM).tolist(),
        },
    }


def _plans(answer) -> dict:
    """Samples, corridors and polytopes, with their directions by number."""
    n_p, problem = answer.model.n_p, answer.problem
    active = _active(problem, len(problem.parts), answer.model.time.n_steps)
    directions = _DirectionTable(active)
    scene = unpruned_scene(answer.scene)

    def whole(corridor: Corridor) -> Corridor:
        if corridor.apart is None:
            return corridor
        return corridor_of(scene, corridor_part(corridor, problem))

    return {
        "samples": [
            {
                "p0": plan[:n_p].tolist(),
                "k": plan[n_p:].tolist(),
                "sep": directions.number(corridor_of(scene, certificate)),
            }
            for plan, certificate in zip(answer.samples, answer.sample_parts, strict=True)
        ],
        "corridors": [{"sep": directions.number(whole(corridor))} for corridor in answer.corridors],
        "polytopes": [
            {
                "sep": directions.number(whole(polytope.corridor)),
                "bin": int(polytope.bin),
                "pattern": "".join("1" if on else "0" for on in polytope.pattern),
            }
            for polytope in answer.polytopes
        ],
        "directions": directions.all,
    }


def outlines(answer) -> dict[str, list]:
    """Per pair of coordinates of (p0, k), written "i,j", the outlines [[x, y], ...] of the safe
    polytopes, if the answer has any: of every view of the workspace, and of all pairs of
    parameters.
    """
    n_p, n_k = answer.model.n_p, answer.model.n_k
    seen = [view.axes for view in views_of(n_p)]
    pairs = [*seen, *((n_p + i, n_p + j) for i, j in combinations(range(n_k), 2))]
    return {
        f"{i},{j}": [
            [[_short(x), _short(y)] for x, y in shapes.hull(points)]
            for points in (answer.project((i, j)) if answer.polytopes else ())
        ]
        for i, j in pairs
    }


class _DirectionTable:
    """Separating directions by number, each kept once: per obstacle and part of the body its runs
    [first, end, w, support of obstacle and part along w].

    active (o, T): which pair of obstacle and part exists when.
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
    """Runs of equal directions of one pair: w (T, n_p), support (T,), active (T,)."""
    runs: list[list] = []
    for t in np.flatnonzero(active).tolist():
        now = [w[t].tolist(), float(support[t])]
        if runs and runs[-1][2:] == now:
            runs[-1][1] = t + 1
        else:
            runs.append([t, t + 1, *now])
    return runs


def _steps(problem, n_steps: int) -> list[tuple[int, int]]:
    """First and last interval of every obstacle."""
    return [span or (0, n_steps - 1) for span in problem.all_spans]


def _active(problem, n_parts: int, n_steps: int) -> np.ndarray:
    """(o, T) bool: the intervals in which each pair of obstacle and part counts."""
    active = np.zeros((len(problem.obstacles), n_parts, n_steps), bool)
    for obstacle, (first, last) in enumerate(_steps(problem, n_steps)):
        active[obstacle, :, first : last + 1] = True
    return active.reshape(-1, n_steps)


def _faces(faces) -> dict:
    """Faces of the errors, where there are any instead of boxes."""
    return {
        "directions": faces.directions.tolist(),
        "centre": faces.centre.tolist(),
        "half": np.minimum(faces.half, NO_CLAIM).tolist(),
    }


def _part(part, n_p: int) -> dict:
    """A part: its points by number, and what it is grown by: the hull of a shape, and a radius."""
    disc = isinstance(part.shape, Disc)
    return {
        "points": list(part.points),
        "shape": [[0.0] * n_p] if disc else part.shape.vertices.tolist(),
        "radius": float(part.shape.radius) if disc else 0.0,
    }


def _obstacles(problem, n_steps: int, views) -> list[dict]:
    """Corners, an outline for every view, first and last interval."""
    corners = [vertices(obstacle) for obstacle in problem.obstacles]
    return [
        {
            "vertices": v.tolist(),
            "outlines": [shapes.hull(view.of(v)).tolist() for view in views],
            "steps": [int(step) for step in steps],
        }
        for v, steps in zip(corners, _steps(problem, n_steps), strict=True)
    ]


def _rows(polytope) -> dict:
    return {"A": polytope.A.tolist(), "b": polytope.b.tolist()}


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
