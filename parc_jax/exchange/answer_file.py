"""An answer again from its file, for pictures and further questions: nothing else is needed."""

import json

import numpy as np

from parc_jax.answer import LEVELS, Answer
from parc_jax.avoid.directions import Multiplier, direction
from parc_jax.certify.certificate import FORMAT
from parc_jax.certify.corridor import Corridor
from parc_jax.certify.cover import Cover, Coverage, nothing_covered
from parc_jax.certify.draw import points
from parc_jax.certify.evaluate import evaluate
from parc_jax.certify.no_plan import BRACKET, PROVED, UNDECIDED, NoPlan
from parc_jax.certify.piece import Piece
from parc_jax.certify.scene import Scene, scene
from parc_jax.checker import Rejected, check_answer, load, number
from parc_jax.error.claim import claim_from_json
from parc_jax.error.tube import NO_CLAIM, tube
from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.relu import relu_network
from parc_jax.problem import Polygon, ReachAvoid, reach_avoid
from parc_jax.sets.box import box
from parc_jax.sets.hpolytope import HPolytope, hpolytope
from parc_jax.system import time_grid


def load_answer(path) -> Answer:
    """The answer of a file written by `Answer.save`, checked anew in exact arithmetic before anything is believed.

    Samples, polytopes, statement and pictures are as they were; timings are not in the file. The record grid of the
    time is not either: it is taken as the model's. Raises InputError when the file is no answer or its proof fails.
    """
    try:
        data = load(path)
        report = check_answer(data)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error}).") from None
    except Rejected as why:
        raise InputError(f"{path}: expected an answer whose certificates hold; the checker says: {why}.") from None
    try:
        return _answer(data, report)
    except (KeyError, TypeError, IndexError, AttributeError, json.JSONDecodeError) as error:
        raise InputError(
            f"{path}: expected a file of `Answer.save` (format {FORMAT}); {type(error).__name__}: {error}."
        ) from None


def _answer(data: dict, report) -> Answer:
    model, problem, meta = _model(data), problem_of_file(data["problem"]), data["meta"]
    laid_out = scene(problem, model)
    samples = np.array([_floats(s["p0"]) + _floats(s["k"]) for s in data["samples"]], np.float64)
    samples = samples.reshape(len(data["samples"]), model.n_p + model.n_k)
    pieces = [_piece(model, problem, laid_out, part) for part in data["sets"]]
    p0, k = samples[:, : model.n_p], samples[:, model.n_p :]
    seen = points(p0, k, evaluate(model, laid_out, p0, k))
    counts = meta["counts"]
    coverage = _coverage(meta["coverage"])
    kept = _coverage(meta["corridor_coverage"]) if "corridor_coverage" in meta else nothing_covered(coverage.confidence)
    corridors = [_corridor(problem, laid_out, part) for part in data.get("corridors", [])]
    tally = counts["drawn"], counts["reaching"], counts["safe"], float(meta["volume_drawn"])
    cover = Cover(*tally, seen, kept, coverage, corridors, pieces)
    no_plan = _no_plan(data["no_plan"], report.no_plan)
    return Answer(model, problem, laid_out, cover, samples, data["samples"], LEVELS[1], 0, {}, no_plan)


def _model(data: dict) -> TrajectoryModel:
    asked, network, widths = data["problem"], data["network"], data["tube"]
    net = relu_network([_floats(W) for W in network["weights"]], [_floats(b) for b in network["biases"]])
    interval, final = (np.array(_floats(widths[name])) for name in ("interval", "final"))
    interval, final = (np.where(wide >= NO_CLAIM, np.inf, wide) for wide in (interval, final))
    shape = tube([_floats(e) for e in widths["edges"]], interval, final)
    dt = _floats(asked["dt"])
    domain = box(_floats(asked["domain"]["lo"]), _floats(asked["domain"]["hi"]))
    time = time_grid(dt, dt * asked["steps"])
    return trajectory_model(net, claim_from_json(data["claim"], shape), domain, time, data["meta"]["system"])


def problem_of_file(asked: dict) -> ReachAvoid:
    """The problem in the parsed part `problem` of an answer file, in float64."""
    body = asked["body"]
    return reach_avoid(
        goal=_polytope(asked["goal"]),
        obstacles=[_polytope(o) for o in asked["obstacles"]],
        body=_floats(body["radius"]) if "radius" in body else Polygon(np.array(_floats(body["vertices"]))),
        start=None if asked["start"] is None else _polytope(asked["start"]),
        steps=[tuple(o["steps"]) if "steps" in o else None for o in asked["obstacles"]],
    )


def _piece(model: TrajectoryModel, problem: ReachAvoid, laid_out: Scene, part: dict) -> Piece:
    """The piece of its certificate."""
    corridor = _corridor(problem, laid_out, part)
    pattern = np.array([bit == "1" for bit in part["pattern"]], bool)
    return Piece(model, laid_out, corridor.p0, corridor.k, pattern, part["bin"], corridor, float("nan"))


def _corridor(problem: ReachAvoid, laid_out: Scene, part: dict) -> Corridor:
    """The corridor of its certificate, each direction rounded as when it was grown."""
    active = laid_out.obstacles.active
    w, reach, spelled = np.zeros((*active.shape, 2)), np.full(active.shape, -np.inf), np.empty(active.shape, object)
    for o, runs in enumerate(part["sep"]):
        first = int(np.argmax(active[o]))
        for end, terms in runs:
            m = Multiplier(tuple(row for row, _ in terms), tuple(number(v) for _, v in terms))
            along, need = direction(problem, o, m)
            w[o, first:end], reach[o, first:end] = along, need + laid_out.slack * np.abs(along).sum()
            for t in range(first, end):
                spelled[o, t] = m
            first = end
    return Corridor(w, reach, spelled, np.array(_floats(part["p0"])), np.array(_floats(part["k"])))


def _no_plan(certificate: dict | None, volumes: dict | None) -> NoPlan | None:
    """What the checker has just proved of it."""
    if certificate is None or volumes is None:
        return None
    safe, unsafe, undecided = (number(volumes[name]) for name in ("safe", "unsafe", "undecided"))
    kind = PROVED if volumes["kind"] == "proved" else BRACKET if safe else UNDECIDED
    leaves = sum("split" not in node for node in certificate["tree"])
    return NoPlan(kind, safe, unsafe, undecided, safe + unsafe + undecided, certificate, leaves, None, 0.0, 0.0)


def _polytope(part: dict) -> HPolytope:
    return hpolytope(_floats(part["A"]), _floats(part["b"]))


def _coverage(part: dict) -> Coverage:
    return Coverage(**{name: _count(value) for name, value in part.items()})


def _count(value):
    return value if isinstance(value, int) else _floats(value)


def _floats(value):
    """Nested lists of numbers as the file spells them -> the nearest floats."""
    if isinstance(value, list):
        return [_floats(v) for v in value]
    return float(number(value)) or (-0.0 if value.startswith("-") else 0.0)  # the sign of a zero is in the hashes
