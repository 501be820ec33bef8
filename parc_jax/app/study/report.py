"""The report of a study and of a query: tables for people, facts for other programs, pictures."""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.why import SMALL
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.study.replay import Replay
from parc_jax.checker.entries import hash_of
from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError, reading
from parc_jax.common.spelling import exact, rounded_down, rounded_up
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.labels import name_of, unit_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.proof.certificate.write import problem_part
from parc_jax.proof.regions import RegionTable

METRICS = "metrics.json"
VALIDATED_SET = "validated.json"  # the answer of the validated set


class Studied(NamedTuple):
    """Everything a study produced.

    runs: of every returned plan, study.repeats each, grouped by plan; None when there is no plan.
    """

    answer: Answer
    runs: Replay | None
    table: RegionTable
    metrics: dict


def report(outcome: Studied, out: Path) -> str:
    """The end of a study for a terminal, in at most fifteen lines. out: its folder."""
    m, answer = outcome.metrics, outcome.answer
    lines = ["", *said_of(answer).split("\n")]
    if m["replay"] is not None:
        lines += _replayed(m["replay"], answer.model.claim)
    if d := m.get("driven"):
        numbers = zip((*answer.model.labels.p, *answer.model.labels.k), d["plan"], strict=True)
        plan = ", ".join(f"{name} = {exact(x)}" for name, x in numbers)
        sure = f"with confidence {d['sure']} a new one does with probability <= {d['at_most']}"
        seen = f"{d['failures']:,} of {d['runs']:,} fresh runs of {d['law']} failed"
        more = f"; assumed beside: {', '.join(d['beside'])}" * bool(d["beside"])
        lines.append(f"To drive: {plan}; {seen}: {sure}{more}.")
    left = [f"{what} ({why})" for what, why in m.get("not_made", {}).items()]
    lines += [f"Not made: {', '.join(left)}."] * bool(left)
    lines.append(f"All sentences: parc-jax explain {out}; check: parc-jax check {out}/answer.json")
    if validated(answer) is not None:
        lines[-1] += f", and of the validated set: parc-jax check {out}/{VALIDATED_SET}"
    return "\n".join(lines)


def validated(answer: Answer) -> Answer | None:
    """The answer of its validated set, where tests accepted one."""
    return None if answer.validation is None else answer.validation.answer


def said_of(answer: Answer) -> str:
    """The summary of an answer for a terminal; if few or no plans are safe, with `in_the_way`."""
    words = answer.summary()
    return "\n".join([words, *in_the_way(answer, words)])


def in_the_way(answer: Answer, words: str = "") -> list[str]:
    """The obstacles in the way, a line each, if few or no plans are safe; less those in `words`."""
    if answer.status.found and (answer.share is None or answer.share.share >= SMALL):
        return []
    return [line for line in answer.why().sentences if line[1:] not in words]


def asked_of(answer: Answer, claim: str | None) -> str:
    """SHA-256 of the problem of an answer, the pose of its robot and the hash of a claim."""
    at = answer.scene.nominal.pose
    pose = at and [*map(exact, at.place), at.heading if at.heading is None else exact(at.heading)]
    return hash_of([claim, pose, problem_part(answer.problem, answer.model)])


def explained(place: Path) -> str:
    """All sentences of a saved answer, which is checked anew; of a study's folder also those of its
    validated set, and in the study's own words those of the replay of these plans and of the plan
    to drive, and the times of its stages. Raises InputError.
    """
    folder = place.is_dir()
    answer = load_answer(place / "answer.json" if folder else place)
    lines, asked = [answer.details()], asked_of(answer, answer.model.claim.hash)
    if folder and (place / VALIDATED_SET).is_file():
        tested = load_answer(place / VALIDATED_SET)
        if asked_of(tested, tested.model.claim.evidence.get("of")) != asked:
            raise InputError(
                f"{place / VALIDATED_SET}: expected a set of the claim, problem and pose of "
                "answer.json; got one of others. Explain each file by itself."
            )
        lines += ["", "The validated set:", tested.details()]
    if not (folder and (place / METRICS).is_file()):
        return "\n".join(lines)
    with reading(place / METRICS, "the numbers of a study"):
        m = json.loads((place / METRICS).read_text(encoding="utf-8"))
        same = m["replay"] and m.get("plans") == content_hash(answer.samples)
        told = _replayed(m["replay"], answer.model.claim) if same else []
        told += [] if m["driven"] is None else [m["driven"]["statement"]]
        stages = [
            f"{name:<26}{s['seconds']:>9.1f}{s['compile_seconds']:>17.1f}"
            for name, s in m["stages"].items()
        ]
    if m.get("asked") != asked:
        raise InputError(
            f"{place / METRICS}: expected numbers of the claim, problem and pose of answer.json; "
            "got those of others. Explain answer.json by itself."
        )
    head = f"{'stage':<26}{'seconds':>9}{'of it compiling':>17}"
    words = "As the study wrote, which nothing checks:"
    return "\n".join([*lines, "", words, *told, head, *stages])


def _replayed(r: dict, claim: ErrorClaim) -> list[str]:
    often = "" if r["repeats"] == 1 else f", {r['repeats']} runs each"
    lost = [f"WORKERS_LOST({r['lost']}, independent of the run)"] * (r["lost"] > 0)
    more = ", ".join([*lost, *(r.get("start") or [])])
    first = (
        f"Replay: {r['plans']} plans{often}, of {r.get('law', 'the simulator')}: "
        f"{r['reached']} reached, {r['touched']} touched, {r['left_tube']} left the tube "
        f"(claimed of {claim.law.describe()}: {in_short(claim)})"
    )
    if r["repeats"] == 1:
        return [f"{first}{f'; assumed: {more}' * bool(more)}"]
    mean, every = (rounded_up(r[n]) for n in ("failure_mean_at_most", "every_plan_at_most"))
    return [
        first,
        f"        {r['failed']} of {r['runs']} runs failed, or would where the start matters as "
        "the claim allows: with confidence "
        f"{rounded_down(str(r['confidence']), 10)}, a run of one of these plans, drawn at random,",
        f"        fails with probability at most {mean}; no plan of them with more than {every} "
        f"(worst: {r['worst_plan_failed']} of {r['repeats']})",
        "        Runs are made from the origin, moved to the starts of plans and judged at their "
        "records; assumed of them is what (E) assumes, of their plant"
        f"{f', and {more}' * bool(more)}.",
    ]


def figures(outcome: Studied, out: Path) -> list[Path]:
    """Draw everything that this outcome supports; returns the files."""
    from parc_jax.app.plot.of_answer import figures_of

    drawn = []
    for name, draw in figures_of(outcome.answer, outcome.runs, outcome.table).items():
        drawn.append(out / f"{name}.png")
        draw(drawn[-1])
    return drawn


def final_error(model: TrajectoryModel) -> np.ndarray:
    """Median half widths (n_c + n_q,) of the tube at the end, over the bins with a bound; infinite
    where there is none.
    """
    final = model.tube.final[model.tube.claimed]
    return np.median(final, axis=0) if len(final) else np.full(model.n_c + model.n_q, np.inf)


def facts_of(answer: Answer, cold_s: float | None) -> dict:
    """Counts, shares, status and times of an answer as plain data.

    cold_s: [s] to the first sample of a first query, compiling included; None if it is this one.
    """
    cover, share, tested = answer.cover, answer.share, answer.validation
    facts = {
        "counts": {"drawn": cover.drawn, "reaching": cover.reaching, "safe": cover.safe},
        "share": None if share is None else share._asdict(),
        "volume": None if share is None else share.volume,
        "corridors": len(answer.corridors),
        "coverage": answer.coverage._asdict(),
        "status": answer.status.label,
        "ended": None if cover.ended is None else cover.ended.label,
        "refused": cover.refused,
        "first_sample_cold_s": cover.timings["first_sample_s"] if cold_s is None else cold_s,
        "timings": cover.timings,
        "validated": None,
        "asked": asked_of(answer, answer.model.claim.hash),
        "plans": content_hash(answer.samples),
    }
    if tested is not None:
        # the share of all that is safe under its tube; the set is the coverage of it
        both, found = ("share", "coverage"), tested.answer
        of_set = {name: None if found is None else getattr(found, name)._asdict() for name in both}
        facts["validated"] = of_set | {"steps": [list(step) for step in tested.steps]}
    return facts


def spread(values: np.ndarray, model: TrajectoryModel, digits: str = ".2f") -> str:
    """Half widths (n_c + n_q,) at the end in words; per axis of the point where it is widest."""
    values = np.asarray(values)
    places = values[: model.n_c].reshape(model.n_points, model.n_p).max(axis=0)
    parts = zip([*places, *values[model.n_c :]], model.labels.goal, strict=True)
    words = ", ".join(
        f"±{v:{digits}} {unit_of(n)} {name_of(n)}".replace("  ", " ") for v, n in parts
    )
    return words if model.n_points == 1 else f"{words}, at the widest of {model.n_points} points"
