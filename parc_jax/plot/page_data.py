"""What the interactive page needs of an answer.json, as plain numbers."""

from fractions import Fraction

import numpy as np

from parc_jax.avoid.grown import grown_obstacles
from parc_jax.certify.certificate import FORMAT
from parc_jax.checker import Rejected
from parc_jax.errors import InputError
from parc_jax.exchange.answer_file import problem_of_file
from parc_jax.plot import shapes
from parc_jax.plot.page_pieces import piece_outlines
from parc_jax.problem import Polygon, ReachAvoid


def page_data(answer: dict) -> dict:
    """JSON-able numbers of an answer file: scene, network, tube, certificates, outlines of the safe polytopes.

    answer: the parsed file. Floats are those nearest to the file's numbers. Raises InputError.
    """
    if answer.get("format") != FORMAT:
        raise InputError(f"page: expected an answer of format {FORMAT}; got {answer.get('format')!r}.")
    try:
        return _data(answer)
    except (KeyError, TypeError, IndexError, ZeroDivisionError, Rejected) as error:
        raise InputError(
            f"page: expected a complete answer file; {type(error).__name__}: {error}. Save the answer again."
        ) from None


def _data(answer: dict) -> dict:
    asked, meta, claim = answer["problem"], answer.get("meta") or {}, answer.get("claim") or {}
    if asked["n_p"] != 2:
        raise InputError(f"page: expected a planar workspace; this answer's has {asked['n_p']} dimensions.")
    problem = problem_of_file(asked)
    grown = grown_obstacles(problem, asked["steps"])
    spans = [o.get("steps", [0, asked["steps"] - 1]) for o in asked["obstacles"]]
    network = {name: _numbers(part) for name, part in answer["network"].items()}
    tube = {name: _numbers(part) for name, part in answer["tube"].items()}
    samples = [_certificate(part, problem, spans) for part in answer["samples"]]
    sets = [_certificate(part, problem, spans) for part in answer["sets"]]
    outlines = piece_outlines(network, tube, problem, sets, asked["steps"], asked["n_k"])
    return {
        "system": meta.get("system", ""),
        "level": meta.get("level", "float-bounded"),
        "statement": meta.get("statement", claim.get("statement", "")),
        "claim": claim.get("kind", "none"),
        "hash": answer.get("hash", {}),
        "coverage": {name: _float(v) for name, v in meta.get("coverage", {}).items()},
        **{name: asked[name] for name in ("n_p", "n_q", "n_k", "steps")},
        "dt": _float(asked["dt"]),
        "domain": {side: _numbers(asked["domain"][side]) for side in ("lo", "hi")},
        "goal": {"A": problem.goal.A.tolist(), "b": problem.goal.b.tolist()},
        "goal_outline": shapes.shadow(problem.goal).tolist(),
        "start": None if problem.start is None else {"A": problem.start.A.tolist(), "b": problem.start.b.tolist()},
        "radius": float(grown.radius),
        "body": shapes.body_outline(problem.body).tolist(),
        "obstacles": [
            {
                "outline": shapes.shadow(obstacle).tolist(),
                "corner": grown.corner[o].tolist(),
                "sign": grown.sign[o].tolist(),
                "steps": spans[o],
            }
            for o, obstacle in enumerate(problem.obstacles)
        ],
        "network": network,
        "tube": tube,
        "samples": samples,
        "sets": sets,
        "outlines": outlines,
    }


def _certificate(part: dict, problem: ReachAvoid, spans) -> dict:
    """A sample or set piece; runs are [first, end, w_x, w_y, reach of obstacle and body along w]."""
    out = {"p0": _numbers(part["p0"]), "k": _numbers(part["k"]), "sep": []}
    for obstacle, span, runs in zip(problem.obstacles, spans, part["sep"], strict=True):
        first, mine = span[0], []
        for end, multipliers in runs:
            rows, values = [row for row, _ in multipliers], np.array([_float(v) for _, v in multipliers])
            w, reach = values @ obstacle.A[rows], float(values @ obstacle.b[rows])
            mine.append([first, end, float(w[0]), float(w[1]), reach + _body_reach(problem.body, w)])
            first = end
        out["sep"].append(mine)
    return out | {name: part[name] for name in ("bin", "pattern") if name in part}


def _body_reach(body, w: np.ndarray) -> float:
    """Support of the mirrored body along w."""
    if isinstance(body, Polygon):
        return float((-body.vertices @ w).max())
    return float(body.radius * np.hypot(*w))


def _numbers(value):
    return [_numbers(v) for v in value] if isinstance(value, list) else _float(value)


def _float(text) -> float:
    """The float64 nearest to a number of the file: hexadecimal, p/q or decimal."""
    if isinstance(text, str) and "x" in text.lower():
        return float.fromhex(text)
    return float(Fraction(text))
