"""An answer again from its file, for pictures and further questions: nothing else is needed."""

import json

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import looks_of_json
from parc_jax.checker import Rejected, check_answer, load, number
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, hpolytope
from parc_jax.common.spelling import hex_floats, hex_text, nearest_floats
from parc_jax.common.status import Ended
from parc_jax.learning.bound.claim import claim_from_json
from parc_jax.learning.bound.error_set import NO_CLAIM, Faces, faces
from parc_jax.learning.bound.tube import Tube, fitted_tube, tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import relu_network
from parc_jax.planner import answer_to
from parc_jax.problem.body import Body, Disc, Part, Polygon, body_of
from parc_jax.problem.problem import Problem, reach_avoid
from parc_jax.problem.robust.nominal import NominalProblem, Query
from parc_jax.problem.robust.pose import Pose
from parc_jax.problem.robust.realisations import robustness_of_json
from parc_jax.proof.absence.prove_no_plan import PROVED, UNDECIDED, NoPlan
from parc_jax.proof.certificate.read import corridor_of
from parc_jax.proof.certificate.write import FORMAT
from parc_jax.safe_set.corridors.found import Cover
from parc_jax.safe_set.corridors.place import Place
from parc_jax.safe_set.corridors.polytope import SafePolytope
from parc_jax.safe_set.corridors.sampling import points
from parc_jax.safe_set.corridors.stopping import Coverage
from parc_jax.safe_set.verdict.infeasible import why_none
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene, pruned_scene


def load_answer(path) -> Answer:
    """The answer of a file written by `Answer.save`, checked anew in exact arithmetic before
    anything is believed.

    Samples, polytopes, statement and pictures are as they were; timings are not in the file. Raises
    InputError when the file is no answer or its proof fails.
    """
    try:
        data = load(path)
        report = check_answer(data)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error}).") from None
    except Rejected as why:
        raise InputError(
            f"{path}: expected an answer whose certificates hold; the checker says: {why}."
        ) from None
    try:
        return _answer(data, report)
    except (KeyError, TypeError, IndexError, AttributeError, json.JSONDecodeError) as error:
        raise InputError(
            f"{path}: expected a file of `Answer.save` (format {FORMAT}); {type(error).__name__}: "
            f"{error}."
        ) from None


def _answer(data: dict, report) -> Answer:
    model, problem, meta = model_of_file(data), problem_of_file(data["problem"]), data["meta"]
    asked = _asked(problem, model, meta)
    scene = pruned_scene(asked)
    samples = np.array(
        [nearest_floats(s["p0"]) + nearest_floats(s["k"]) for s in data["samples"]], np.float64
    )
    samples = samples.reshape(len(data["samples"]), model.n_p + model.n_k)
    polytopes = [_safe_polytope(scene, part) for part in data["sets"]]
    p0, k = samples[:, : model.n_p], samples[:, model.n_p :]
    seen = points(p0, k, verdicts(scene, p0, k))
    counts = meta["counts"]
    coverage = _coverage(meta["coverage"])
    kept = _coverage(meta["corridor_coverage"])
    corridors = [corridor_of(scene, part) for part in data["corridors"]]
    tally = counts["drawn"], counts["reaching"], counts["safe"], float(meta["volume_drawn"])
    sides = [np.array(hex_floats(side)) for side in meta.get("within", ())]
    within = Place(*sides) if sides else None
    ended = next((e for e in Ended if e.label == meta["ended"]), None)
    cover = Cover(*tally, seen, kept, coverage, corridors, polytopes, within=within, ended=ended)
    no_plan = _no_plan(data["no_plan"], report.no_plan, ended)
    if no_plan is not None:
        no_plan = no_plan._replace(reason=why_none(scene), uncertainty=asked.uncertainty)
    looks = looks_of_json(meta.get("looks"))
    whole = float(meta["volume_of_all"]) if "volume_of_all" in meta else None
    return Answer(
        scene,
        cover,
        samples,
        data["samples"],
        proved=True,
        no_plan=no_plan,
        looks=looks,
        told_whole=whole,
        solve=answer_to,
    )


def _asked(problem: Problem, model: TrajectoryModel, meta: dict) -> NominalProblem:
    """The plain question of a file; as it was asked where that is the same but for a place."""
    uncertainty = robustness_of_json(meta.get("doubt"))
    at = np.array(nearest_floats(meta["at"])) if "at" in meta else None
    pose = _pose(meta)
    here = at is None if pose is None else pose.heading is None
    asked = Query(problem, model, pose) if here and uncertainty is None else None
    return NominalProblem(problem, model, uncertainty, at, pose, asked)


def _pose(meta: dict) -> Pose | None:
    if "pose" not in meta:
        return None
    *place, heading = meta["pose"]
    return Pose(np.array(nearest_floats(place)), None if heading is None else float(heading))


def model_of_file(data: dict) -> TrajectoryModel:
    asked, network, widths = data["problem"], data["network"], data["tube"]
    net = relu_network(
        [nearest_floats(W) for W in network["weights"]],
        [nearest_floats(b) for b in network["biases"]],
    )
    claim = claim_from_json(data["claim"], _tube(widths, asked["points"]))
    domain = box(nearest_floats(asked["domain"]["lo"]), nearest_floats(asked["domain"]["hi"]))
    proved = (hex_text(domain.lo), hex_text(domain.hi), nearest_floats(asked["dt"]), asked["steps"])
    K, time = claim.domain, claim.subject.time
    if proved != (hex_text(K.lo), hex_text(K.hi), time.dt, time.n_steps):
        raise InputError(
            "answer: expected a problem over the K and on the time grid of its claim; got others."
        )
    return trajectory_model(net, claim)


def _tube(widths: dict, n_points: int) -> Tube:
    """The tube in the parsed part `tube`, boxes or faces."""
    edges = [nearest_floats(e) for e in widths["edges"]]
    if isinstance(widths["final"][0], dict):
        during = [[[_pairs_of(e) for e in at] for at in part] for part in widths["interval"]]
        at_end = [_pairs_of(error) for error in widths["final"]]
        return fitted_tube(edges, _faces(during, frames=False), _faces(at_end, frames=True))
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


def _faces(pairs: list, frames: bool) -> Faces:
    """Faces of nested lists of what `_pairs_of` gives."""
    parts = [_each(pairs, i) for i in range(3)]
    directions, centre, half = (np.array(part) for part in parts)
    return faces(directions, centre, half, frames)


def _each(pairs, i: int):
    return pairs[i] if isinstance(pairs, tuple) else [_each(part, i) for part in pairs]


def problem_of_file(asked: dict) -> Problem:
    """The problem in the parsed part `problem` of an answer file, in float64."""
    body = asked["body"]
    return reach_avoid(
        goal=_polytope(asked["goal"]),
        obstacles=[_polytope(o) for o in asked["obstacles"]],
        body=_body(body),
        start=None if asked["start"] is None else _polytope(asked["start"]),
        spans=[tuple(o["steps"]) if "steps" in o else None for o in asked["obstacles"]],
    )


def _body(body: dict) -> Disc | Polygon | Body:
    """One part about the first point alone is what a plain shape says."""
    parts = [Part(tuple(part["points"]), _shape(part)) for part in body["parts"]]
    return parts[0].shape if [part.points for part in parts] == [(0,)] else body_of(parts)


def _shape(part: dict) -> Disc | Polygon:
    if "radius" in part:
        return Disc(nearest_floats(part["radius"]))
    return Polygon(np.array(nearest_floats(part["vertices"])))


def _safe_polytope(scene: Scene, part: dict) -> SafePolytope:
    """The polytope of its certificate."""
    corridor = corridor_of(scene, part)
    pattern = np.array([bit == "1" for bit in part["pattern"]], bool)
    return SafePolytope(
        scene, corridor.p0, corridor.k, pattern, part["bin"], corridor, float("nan")
    )


def _no_plan(certificate: dict | None, volumes: dict | None, ended: Ended | None) -> NoPlan | None:
    """What the checker has just proved of it. A safe box is not proved unsafe: it counts as
    undecided.
    """
    if certificate is None or volumes is None:
        return None
    safe, unsafe, undecided = (number(volumes[name]) for name in ("safe", "unsafe", "undecided"))
    kind = PROVED if volumes["kind"] == "proved" else UNDECIDED
    leaves = sum("split" not in node for node in certificate["tree"])
    total = safe + unsafe + undecided
    return NoPlan(kind, unsafe, total - unsafe, total, certificate, leaves, ended=ended)


def _polytope(part: dict) -> HPolytope:
    return hpolytope(nearest_floats(part["A"]), nearest_floats(part["b"]))


def _coverage(part: dict) -> Coverage:
    return Coverage(**{name: _count(value) for name, value in part.items()})


def _count(value):
    return value if isinstance(value, int) else nearest_floats(value)
