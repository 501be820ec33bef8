"""An episode as a file: written for the checker, read again for pictures and bags. [T37]"""

import json
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from parc_jax.checker import Rejected, check_episode, load, number
from parc_jax.checker.answer import allowance_of
from parc_jax.checker.episode import EPISODE, PARTS, summary_of_episode
from parc_jax.checker.rests_on import known_premises, seconds
from parc_jax.common.arrays import at_least
from parc_jax.common.errors import InputError, reading
from parc_jax.common.premises import ASSUMED, MEASURED, assumptions, premises
from parc_jax.common.said import about_said, most_and_often
from parc_jax.common.spelling import hex_text, nearest_floats, plain, rounded_down, rounded_up
from parc_jax.drive.loop.commitment import COPIED, Commitment, copies_of, require_whole
from parc_jax.drive.loop.statement import about_drift
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.files import write_atomic
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.pose import Pose
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.proof.certificate.prove import model_of_file, problem_of_file
from parc_jax.proof.certificate.write import part_hash, problem_part, question_parts


def episode_part(
    commitments: Sequence[Commitment],
    meta: dict | None = None,
    drift: float = 0.0,
    assumed: Mapping[str, Any] | None = None,
) -> dict:
    """The file of an episode: commitments of one loop, in their order, none left out in between.
    meta: plain values that need no proof. drift: [m] by which a place may be off against the one
    before, as that of odometry, at least that of the loop; the chain of manoeuvres is checked
    with this margin. assumed: further assumptions by name, such as the time of a scan: text, whole
    numbers or lists of such. Raises InputError.
    """
    require_whole("episode", commitments)
    drift = max(at_least("episode drift", drift), *(one.drift for one in commitments))
    first = commitments[0].asked
    model, known = first.model, first.query.problem.uncertainty or Uncertainty()
    _, network, tube = question_parts(first.problem, model)
    hashes = {"network": part_hash(network), "tube": part_hash(tube)}
    claim = model.claim.to_json() | {f"{name}_hash": value for name, value in hashes.items()}
    part = {
        "network": network,
        "tube": tube,
        "claim": plain(claim),
        "copies": copies_of(first),
        "doubt": hex_text([*known.shifts(model.n_p), known.heading, drift]),
        "manoeuvres": [
            {
                "begin": str(one.begin),
                "pose": hex_text(one.asked.pose.values),
                "problem": problem_part(one.asked.problem, one.asked.model),
                "sample": one.part,
            }
            for one in commitments
        ],
    }
    assumed = dict(assumed or {})
    for name, value in commitments[0].episode.assumed.items():
        if assumed.setdefault(name, value) != value:
            raise InputError(f"episode: expected {name} as its loop assumes it, {value!r:.60}.")
    others: list[tuple] = [*assumptions("episode", assumed)]
    if first.uncertainty:
        n, eps = len(commitments), known.sensing_eps
        most = f"; for all {n} manoeuvres at most {rounded_up(min(1, n * eps))}"
        said = f"{first.uncertainty.words}{most * (n > 1 and eps > 0)}"
        others.append(("errors allowed for", ASSUMED, said))
    if drifted := max(commitments[-1].drifted, drift * (commitments[-1].number + 1)):
        others.append(("drift of the frame", ASSUMED, about_drift(drifted)))
    rests, told = most_and_often(
        (x := one.asked.problem.rests_on, dict.fromkeys(x, 1)) for one in commitments
    )
    if rests:
        least = min(x.told_until - x.begin for x in commitments if x.asked.problem.rests_on)
        said = f"for the first {rounded_down(least, 4)} s of each manoeuvre that rests on this, at "
        said += f"least. {about_said(rests, told, len(commitments))}"
        others.append(("said of obstacles", ASSUMED, said))
    others += [(name, ASSUMED, value) for name, value in commitments[0].untold.items()]
    if given := [name_of(first.query.model.labels.k[axis]) for axis in commitments[0].given]:
        others.append(("measured of k", ASSUMED, given))
    before, last = commitments[0].number, commitments[-1]
    said = [f"those before number {before}, the first of these"] * (before > 0)
    after = [at for at in last.episode.begins if at > last.begin]
    said += [f"those from {seconds(at)} on, until when the last was followed" for at in after[:1]]
    others += [("NOT_IN_THE_FILE", MEASURED, said)][: len(said)]
    if command := commitments[0].command:
        others.append(("COMMAND", ASSUMED, f"of each manoeuvre {command}"))
    if any(one.episode.copied for one in commitments):
        others.append(("COPIED", ASSUMED, f"of some manoeuvre: {COPIED}"))
    outside = [(i, one.seen_outside[0]) for i, one in enumerate(commitments) if one.seen_outside]
    said = [f"manoeuvres[{i}], by {seconds(at)}: it is none inside the tube" for i, at in outside]
    said += [
        f"manoeuvres[{i}]: {x.others_left}" for i, x in enumerate(commitments) if x.others_left
    ]
    others += [("TUBE_LEFT", MEASURED, said)][: len(said)]
    part["premises"] = premises([*known_premises(part), *others]).to_json()
    hashes["episode"] = part_hash({name: part[name] for name in PARTS})
    return {"format": EPISODE, "hash": hashes, **part, "meta": plain(meta)}


def save_episode(
    path: str | Path,
    commitments: Sequence[Commitment],
    meta: dict | None = None,
    drift: float = 0.0,
    assumed: Mapping[str, Any] | None = None,
) -> Path:
    """Write an episode, whole or not at all; `parc-jax check` verifies it. Arguments as of
    `episode_part`. Raises InputError.
    """
    part = episode_part(commitments, meta, drift, assumed)
    with reading("meta", "plain values, as JSON has them"):
        text = json.dumps(part, separators=(",", ":"))
    return write_atomic(path, text.encode())


class Manoeuvre(NamedTuple):
    """A commitment of a file. begin: [s] of the loop's clock. problem: in the robot's frame where
    the pose has a heading, else in the world's. p0 (n_p,), k (n_k,): the plan there.
    """

    begin: Fraction
    pose: Pose
    problem: Problem
    p0: np.ndarray
    k: np.ndarray


class Episode(NamedTuple):
    """An episode of a file. model: of the nominal problems. statement: proofs and assumptions.
    meta: of the file, unchecked. copies: of each point, for what is uncertain of its motion.
    """

    model: TrajectoryModel
    manoeuvres: tuple[Manoeuvre, ...]
    statement: str
    meta: Any = None
    copies: int = 1


def load_episode(path: str | Path) -> Episode:
    """Read an episode of `save_episode`, after its file was checked anew in exact arithmetic.
    Raises InputError when the file is no episode or its proof fails.
    """
    with reading(path, "a file of `save_episode`", Rejected):
        data = load(path)
    return episode_of(data, str(path))


def episode_of(data: dict, name: str) -> Episode:
    """The episode of a parsed file. Raises InputError, which begins with `name`."""
    try:
        report = check_episode(data, allowance_of)
    except Rejected as why:
        raise InputError(
            f"{name}: expected an episode ({EPISODE}) whose proofs hold; the checker says: {why}."
        ) from None
    with reading(name, "a file of `save_episode`"):
        entries = data["manoeuvres"]
        model = model_of_file(data | {"problem": entries[0]["problem"]})
        manoeuvres = []
        for entry in entries:
            sample, values = entry["sample"], np.array(nearest_floats(entry["pose"]))
            pose = Pose(values[: model.n_p], *values[model.n_p :].tolist())
            p0, k = (np.array(nearest_floats(sample[name])) for name in ("p0", "k"))
            problem = problem_of_file(entry["problem"])
            manoeuvres.append(Manoeuvre(number(entry["begin"]), pose, problem, p0, k))
    statement = "\n".join(summary_of_episode(report))
    return Episode(model, tuple(manoeuvres), statement, data.get("meta"), data["copies"])
