"""The last word: the independent checker, in exact arithmetic, on everything that is returned.

Parsed files of answers and episodes as records: model, problem, corridors.
"""

import jax
import numpy as np

from parc_jax import checker
from parc_jax.checker import number
from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, hpolytope
from parc_jax.common.spelling import hex_text, nearest_floats
from parc_jax.learning.bound.claim_file import claim_from_json
from parc_jax.learning.bound.error_set import NO_CLAIM, Faces, faces
from parc_jax.learning.bound.tube import Tube, fitted_tube, tube
from parc_jax.learning.model import TrajectoryModel, check_parts
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.body import Body, Disc, Part, Polygon, body_of
from parc_jax.problem.problem import Problem, reach_avoid
from parc_jax.proof.certificate.write import (
    by_pair,
    corridor_part,
    polytope_part,
    problem_part,
    question_parts,
)
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.separation.directions import Multiplier
from parc_jax.safe_set.verdict.scene import Scene


def corridor_of(scene: Scene, part: dict) -> Corridor:
    """The corridor of a certificate, each direction rounded as when it was chosen."""
    table = scene.directions
    n = len(table.multipliers)
    active = scene.obstacles.active[:n]
    w = np.zeros((*active.shape, table.w.shape[2]))
    support = np.full(active.shape, -np.inf)
    multipliers = np.empty(active.shape, object)
    said = by_pair(part["sep"])
    own = said if scene.apart is None else [said[pair] for pair in scene.apart.kept]
    for o, runs in enumerate(own):
        first = int(np.argmax(active[o]))
        for end, terms in runs:
            m = Multiplier(tuple(row for row, _ in terms), tuple(number(v) for _, v in terms))
            along, exact = table.direction(o, m)
            w[o, first:end] = along
            support[o, first:end] = exact + scene.slack * np.abs(along).sum()
            for t in range(first, end):
                multipliers[o, t] = m
            first = end
    p0, k = (np.array(nearest_floats(part[name])) for name in ("p0", "k"))
    return Corridor(w, support, multipliers, scene.obstacles.points[:n], p0, k, scene.apart)


def model_of_file(data: dict) -> TrajectoryModel:
    """The float64 model of a parsed file. Raises InputError where K or time are not the claim's."""
    asked, network, widths = data["problem"], data["network"], data["tube"]
    layers = ([nearest_floats(x) for x in network[part]] for part in ("weights", "biases"))
    net = relu_network(*layers)
    claim = claim_from_json(data["claim"], _tube(widths, asked["points"]))
    domain = box(nearest_floats(asked["domain"]["lo"]), nearest_floats(asked["domain"]["hi"]))
    proved = (hex_text(domain.lo), hex_text(domain.hi), nearest_floats(asked["dt"]), asked["steps"])
    K, time = claim.domain, claim.subject.time
    if proved != (hex_text(K.lo), hex_text(K.hi), time.dt, time.n_steps):
        raise InputError(
            "answer: expected a problem over the K and on the time grid of its claim; got others."
        )
    model = TrajectoryModel(net, claim)
    check_parts(model)  # of any kind: also of a set in one scene
    return model


def _tube(widths: dict, n_points: int) -> Tube:
    edges = [nearest_floats(e) for e in widths["edges"]]
    if isinstance(widths["final"][0], dict):
        during = _faces(widths["interval"], frames=False)
        return fitted_tube(edges, during, _faces(widths["final"], frames=True))
    interval, final = (np.array(nearest_floats(widths[name])) for name in ("interval", "final"))
    interval, final = (np.where(wide >= NO_CLAIM, np.inf, wide) for wide in (interval, final))
    return tube(edges, interval.reshape(*interval.shape[:2], -1), final, n_points)


def _pairs_of(error: dict) -> tuple[list, list, list]:
    """Directions, centres and half widths of rows that come in pairs, one face and its other."""
    directions = nearest_floats(error["A"][::2])
    far, near = ([number(b) for b in error["b"][side::2]] for side in (0, 1))
    centre = [float((x - y) / 2) for x, y in zip(far, near, strict=True)]
    half = [float((x + y) / 2) for x, y in zip(far, near, strict=True)]
    return directions, centre, [np.inf if s >= NO_CLAIM else s for s in half]


def _faces(errors: list, frames: bool) -> Faces:
    sets = np.array(errors, object)
    parts = zip(*map(_pairs_of, sets.ravel()), strict=True)
    arrays = (np.array(part) for part in parts)
    return faces(*(x.reshape(*sets.shape, *x.shape[1:]) for x in arrays), frames)


def problem_of_file(asked: dict) -> Problem:
    """The problem in the parsed part `problem` of an answer file, in float64."""
    return reach_avoid(
        goal=_polytope(asked["goal"]),
        obstacles=[_polytope(o) for o in asked["obstacles"]],
        body=_body(asked["body"]),
        start=None if asked["start"] is None else _polytope(asked["start"]),
        spans=[tuple(o["steps"]) if "steps" in o else None for o in asked["obstacles"]],
    )


def _body(body: dict) -> Disc | Polygon | Body:
    """One part about the first point alone is written as a plain shape."""
    parts = [Part(tuple(part["points"]), _shape(part)) for part in body["parts"]]
    return parts[0].shape if [part.points for part in parts] == [(0,)] else body_of(parts)


def _shape(part: dict) -> Disc | Polygon:
    if "radius" in part:
        return Disc(nearest_floats(part["radius"]))
    return Polygon(np.array(nearest_floats(part["vertices"])))


def _polytope(part: dict) -> HPolytope:
    return hpolytope(nearest_floats(part["A"]), nearest_floats(part["b"]))


def prove(
    problem: Problem, model: TrajectoryModel, samples: list[dict], corridors=(), polytopes=()
):
    """Which sample certificates, corridors and polytopes the checker accepts: three bool arrays.

    A corridor is certified as a sample is: directions that hold for all plans, and one plan that
    satisfies them. Raises InputError for a problem or a model beyond the limits of the checker.
    """
    if not (len(samples) or len(corridors) or len(polytopes)):
        return tuple(np.zeros(0, bool) for _ in range(3))
    context = _context(problem, model)
    asked = (
        (context.check_sample, samples),
        (context.check_sample, [corridor_part(c, problem) for c in corridors]),
        (context.check_set, [polytope_part(p) for p in polytopes]),
    )
    return tuple(
        np.array([_accepts(check, part) for part in parts], bool) for check, parts in asked
    )


def proves_box(problem: Problem, model: TrajectoryModel, part: dict) -> bool:
    """Does the checker take a box of safe plans, as of `check_doubt`? [T21] Raises as `prove`."""
    context = _context(problem, model)
    return _accepts(lambda entry: checker.check_doubt(context, entry), part)


def _context(problem: Problem, model: TrajectoryModel) -> checker.Context:
    """The checker's exact form of a question. The last few networks and tubes are read once."""
    question = problem_part(problem, model)
    asked = [question[part] for part in _SIZES]
    if model.tube.templates is not None:
        asked.append(question["goal"])  # the tube names multipliers for its rows
    # by every bit: an array changed in place is another model
    name = repr(asked), content_hash(*jax.tree.leaves((model.net, model.tube)))
    if (known := _RECENT.pop(name, None)) is None:
        try:
            known = checker.Context(*question_parts(problem, model))
        except checker.Rejected as error:
            raise InputError(
                f"proof: expected a question within the limits of the exact checker; {error}. "
                "Ask with proof=False, or for a smaller model."
            ) from None
        if len(_RECENT) >= _KEPT:
            _RECENT.pop(next(iter(_RECENT)), None)
    _RECENT[name] = known
    return known.about(question)


# all that a network and a tube have to do with a problem
_SIZES = ("n_p", "n_q", "n_k", "points", "steps", "domain")
_KEPT = 4  # models
_RECENT: dict[tuple, checker.Context] = {}  # the oldest first


def _accepts(check, part: dict) -> bool:
    try:
        check(part)
    except checker.Rejected:
        return False
    return True
