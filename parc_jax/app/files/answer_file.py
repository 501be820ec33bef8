"""An answer again from its file, checked anew: for pictures, bags and further queries."""

from dataclasses import replace

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import looks_of_json
from parc_jax.checker import Rejected, check_answer, load, number
from parc_jax.common.errors import InputError, check_text, reading
from parc_jax.common.spelling import hex_floats, nearest_floats
from parc_jax.common.status import Ended
from parc_jax.learning.bound.statement import VALIDATED
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.body import Body
from parc_jax.problem.problem import Problem, Span
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.problem.robust.pose import Pose
from parc_jax.problem.robust.realisations import robustness_of_json
from parc_jax.problem.world.outlines import edge_of
from parc_jax.proof.absence.prove_no_plan import PROVED, UNDECIDED, NoPlan
from parc_jax.proof.certificate.prove import corridor_of, model_of_file, problem_of_file
from parc_jax.proof.certificate.write import FORMAT, part_hash
from parc_jax.safe_set.corridors.sampling import Place, points
from parc_jax.safe_set.corridors.search import Cover
from parc_jax.safe_set.corridors.stopping import Coverage
from parc_jax.safe_set.verdict.infeasible import why_none
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene, lowered, padded, pruned_scene, volume_of_all
from parc_jax.statement import about_file


def load_answer(path) -> Answer:
    """The answer of a file written by `Answer.save`, checked anew in exact arithmetic before
    anything is believed.

    Samples, corridors, sentences and pictures are as they were; timings are not in the file.
    Polytopes of the file are checked and not returned: `Answer.polytopes` cuts them again. Raises
    InputError when the file is no answer or its proof fails.
    """
    with reading(path, f"a file of `Answer.save` (format {FORMAT})"):
        try:
            data = load(path)
            report = check_answer(data)
        except Rejected as why:
            raise InputError(
                f"{path}: expected an answer whose certificates hold; the checker says: {why}."
            ) from None
        return _answer(data, report)


def _answer(data: dict, report) -> Answer:
    model, problem = model_of_file(data), problem_of_file(data["problem"])
    meta = _meta(data["meta"], model)
    spans, edges = list(problem.all_spans), list(problem.obstacles)
    if "spans" in meta:  # beside the intervals, for which moment and steps of what length
        spans = [
            s and Span(s, dt and float(dt), at and float(at), loop or None, said, mover)
            for s, of in zip(problem.all_spans, meta["spans"], strict=True)
            for dt, at, said, mover, loop in [of or [None] * 5]  # of none where it always exists
        ]
    if "edges" in meta:
        edges = [edge_of(*of) for of in zip(problem.obstacles, meta["edges"], strict=True)]
    problem = problem.replace(obstacles=edges, spans=spans)
    if "places" in meta:  # of a footprint
        check_text("places", "".join(name for name, *_ in meta["places"]))
        places = tuple((name, float(x), float(y)) for name, x, y in meta["places"])
        problem = problem.replace(body=Body(problem.parts, places))
    nominal = _nominal(problem, model, meta)
    scene = _scene(nominal, data)
    if "k" in meta:  # the part of K that was asked for
        lo, hi = map(np.array, hex_floats(meta["k"]))
        scene = replace(scene, k_lo=np.maximum(lo, scene.k_lo), k_hi=np.minimum(hi, scene.k_hi))
    plans = [nearest_floats(s["p0"]) + nearest_floats(s["k"]) for s in data["samples"]]
    samples = np.array(plans, np.float64).reshape(len(plans), model.n_p + model.n_k)
    p0, k = samples[:, : model.n_p], samples[:, model.n_p :]
    counts, told = meta["counts"], meta["coverage"]
    told = {name: x if isinstance(x, int) else nearest_floats(x) for name, x in told.items()}
    tally = counts["drawn"], counts["reaching"], counts["safe"], float(meta["volume_drawn"])
    sides = [np.array(hex_floats(side)) for side in meta.get("within", ())]
    ended = next((e for e in Ended if e.label == meta["ended"]), None)
    total = meta.get("volume_of_all")
    cover = Cover(
        *tally,
        points=points(p0, k, verdicts(scene, p0, k)),
        coverage=Coverage(**told),
        corridors=[corridor_of(scene, part) for part in data["corridors"]],
        within=Place(*sides) if sides else None,
        ended=ended,
        total_volume=volume_of_all(scene) if total is None else float(total),
        proved=True,
    )
    _require_shares(cover, known=ended is not None or meta["ended"] is None)
    no_plan = _no_plan(data["no_plan"], report.no_plan, ended, scene)
    looks = looks_of_json(meta.get("looks"))
    _require_start(nominal, [*p0, *(corridor.p0 for corridor in cover.corridors)])
    told = nominal.turned or any(s is not None and s.at is not None for s in problem.all_spans)
    found, robust = bool(samples.size or cover.corridors), nominal.uncertainty is not None
    unchecked = about_file(found, robust, told, bool(problem.rests_on), "k" in meta)
    return Answer(scene, cover, samples, data["samples"], no_plan, looks, unchecked=unchecked)


def _meta(part: dict, model: TrajectoryModel) -> dict:
    """What a file says beside its proof. Raises InputError where that was edited, or contradicts
    the claim: a heading without `rotation`, several realisations without an uncertainty.
    """
    if "counts" not in part:
        raise InputError(
            "answer: expected a set of plans, from `Answer.save`; got one plan's certificate: "
            "`parc-jax check` says what it proves."
        )
    told = {name: value for name, value in part.items() if name != "hash"}
    turned = told.get("pose", [None])[-1] is not None and model.rotation is None
    copies = "network_of_runs" in model.claim.evidence and "doubt" not in told
    if part.get("hash") != part_hash(told) or turned or copies:
        raise InputError(
            "answer: expected what was written beside its proof (pose, uncertainty, counts), and "
            "fits its claim; it was edited, or is of an earlier form. Save the answer anew."
        )
    return told


def _require_shares(cover: Cover, known: bool) -> None:
    """Refuse counts and shares that no search ends with, by InputError. known: so is its end."""
    (drawn, reaching, safe, volume), c = cover[:4], cover.coverage
    known &= 0 <= c.at_least <= c.share <= 1 and 0 < c.confidence < 1
    known &= 0 <= c.fresh_uncovered <= c.fresh_safe and 0 <= safe <= reaching <= drawn
    known &= c.share in (0, 1 - c.fresh_uncovered / max(c.fresh_safe, 1))
    known &= not (volume < 0 or cover.total_volume < 0)
    if not (known and (cover.share is None or 0 <= cover.share.at_least <= 1)):
        raise InputError(
            "answer: expected counts of draws and shares between 0 and 1, as a search has them; "
            f"got {c}, {drawn} drawn, {reaching} of them reaching, {safe} safe. Save it anew."
        )


def _require_start(nominal: NominalProblem, starts: list[np.ndarray]) -> None:
    """Refuse a pose that is not where all plans start. Raises InputError."""
    pose, at = nominal.pose, nominal.at
    if at is None or pose is None:
        here = at is pose  # both are None
    else:
        here = np.array_equal(at, pose.place if pose.heading is None else 0 * pose.place)
    if not here or any(at is not None and not np.array_equal(p0, at) for p0 in starts):
        raise InputError("answer: expected plans that start at its pose; got another pose.")


def _scene(nominal: NominalProblem, data: dict) -> Scene:
    """The scene of a file; of a validated set with all obstacles. Raises InputError for such a set
    with another place of draws: its scene and corridors are the checker's to compare.
    """
    claim = nominal.model.claim
    if claim.kind != VALIDATED:
        return pruned_scene(nominal)
    if any(claim.evidence.get(name) != data["meta"].get(name) for name in ("within", "at", "k")):
        raise InputError(
            "answer: expected the very set that was tested; this file draws from another place, or "
            "start, of which (V) says nothing, or is of an earlier form. Take the file as it was "
            "written, or validate anew."
        )
    return padded(lowered(nominal))


def _nominal(problem: Problem, model: TrajectoryModel, meta: dict) -> NominalProblem:
    """The nominal problem of a file, with the query where that differs in its place alone."""
    uncertainty = robustness_of_json(meta.get("doubt"))
    at = np.array(nearest_floats(meta["at"])) if "at" in meta else None
    pose = None
    if "pose" in meta:
        *place, heading = meta["pose"]
        pose = Pose(np.array(nearest_floats(place)), None if heading is None else float(heading))
    here = at is None if pose is None else pose.heading is None
    about = problem, model, uncertainty, at, pose
    query = NominalProblem(*about).told if here and uncertainty is None else None
    return NominalProblem(*about, query)


def _no_plan(certificate, volumes, ended: Ended | None, scene: Scene) -> NoPlan | None:
    """The proof of absence that the checker has just accepted. A safe box counts as undecided."""
    if certificate is None or volumes is None:
        return None
    safe, unsafe, undecided = (number(volumes[name]) for name in ("safe", "unsafe", "undecided"))
    kind = PROVED if volumes["kind"] == "proved" else UNDECIDED
    leaves = sum("split" not in node for node in certificate["tree"])
    total = safe + unsafe + undecided
    return NoPlan(
        kind,
        unsafe=unsafe,
        undecided=total - unsafe,
        total=total,
        certificate=certificate,
        leaves=leaves,
        reason=why_none(scene),
        uncertainty=scene.nominal.uncertainty,
        ended=ended,
        box=scene.model.claim.law.box,
    )
