"""An episode as a file, which the checker reads: all that was committed to, from first to last."""

import itertools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from parc_jax.checker.episode import EPISODE, PARTS
from parc_jax.checker.rests_on import IN_THE_WORLD, ON_THE_ROBOT, known_premises, part_of
from parc_jax.common.errors import InputError
from parc_jax.common.premises import ASSUMED, CHECKED, Premises, agree, premises
from parc_jax.common.spelling import hex_text, plain
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.learning.runs.files import write_atomic
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.proof.certificate.write import part_hash, problem_part, question_parts


def episode_part(
    commitments: Sequence[Commitment],
    meta: dict | None = None,
    drift: float = 0.0,
    assumed: Mapping[str, Any] | None = None,
) -> dict:
    """The whole file of an episode: commitments of one loop, in their order. meta: what needs no
    proof, as plain values. drift: [m] by which a place may be off against the one before, as that
    of odometry is; a chain of manoeuvres is checked with so much room. assumed: by name, what else
    the episode rests on, such as the time of a scan: text, whole numbers or lists of such. Raises
    InputError.
    """
    if not commitments:
        raise InputError("episode: expected at least one commitment; got none.")
    if not (np.isfinite(drift) and drift >= 0):
        raise InputError(f"episode: expected a drift >= 0 m; got {drift!r:.40}.")
    manoeuvres = [manoeuvre_part(one) for one in commitments]
    met = [met_with(one.asked, entry) for one, entry in zip(commitments, manoeuvres, strict=True)]
    for one, other in itertools.pairwise(met):
        agree("episode: commitments of one loop", one, other)
    part = head_part(commitments[0].asked, drift) | {"manoeuvres": manoeuvres}
    others = [(name, ASSUMED, value) for name, value in (assumed or {}).items()]
    part["premises"] = premises([*known_premises(part), *others]).to_json()
    hashes = {name: part_hash(part[name]) for name in ("network", "tube")}
    hashes["episode"] = part_hash({name: part[name] for name in PARTS})
    return {"format": EPISODE, "hash": hashes, **part, "meta": plain(meta)}


def met_with(asked: NominalProblem, entry: dict) -> Premises:
    """What a manoeuvre, an entry of the file, and the next one have in common."""
    model = asked.model
    start, heading = uncertainty_of(asked)
    parts = entry["problem"]["body"]["parts"]
    frame = IN_THE_WORLD if asked.pose.heading is None else ON_THE_ROBOT
    uncertainty = [f"±{x} m" for x in start.tolist()] + [f"±{heading} rad"]
    return premises(
        [
            ("model", CHECKED, [model.net.hash, model.tube.hash, model.claim.hash]),
            ("body", CHECKED, [part_of(part, copies_of(asked)) for part in parts]),
            ("frame", CHECKED, frame),
            ("doubt", ASSUMED, uncertainty),
        ]
    )


def copies_of(asked: NominalProblem) -> int:
    """Points of the plain question for each point of the robot."""
    return asked.model.n_points // asked.query.model.n_points


def uncertainty_of(asked: NominalProblem) -> tuple[np.ndarray, float]:
    """Half widths (n_p,) [m] of the start, and [rad] of the heading."""
    uncertainty = asked.query.problem.uncertainty
    if uncertainty is None:
        return np.zeros(asked.model.n_p), 0.0
    return uncertainty.shifts(asked.model.n_p), float(uncertainty.heading or 0.0)


def head_part(first: NominalProblem, drift: float = 0.0) -> dict:
    """What an episode that begins with this question says of all its manoeuvres; drift [m] as of
    `episode_part`.
    """
    model = first.model
    _, network, tube = question_parts(first.problem, model)
    hashes = {"network_hash": part_hash(network), "tube_hash": part_hash(tube)}
    start, heading = uncertainty_of(first)
    return {
        "network": network,
        "tube": tube,
        "claim": plain(model.claim.to_json() | hashes),
        "copies": copies_of(first),
        "doubt": hex_text([*start, heading, drift]),
    }


def save_episode(
    path: str | Path,
    commitments: Sequence[Commitment],
    meta: dict | None = None,
    drift: float = 0.0,
    assumed: Mapping[str, Any] | None = None,
) -> Path:
    """Write it whole or not at all; `parc-jax check` verifies it. meta, drift, assumed: as of
    `episode_part`: what needs no proof, by how much [m] odometry may be off from
    one pose to the next, and what else is assumed. Raises InputError.
    """
    text = json.dumps(episode_part(commitments, meta, drift, assumed), separators=(",", ":"))
    return write_atomic(path, text.encode())


def manoeuvre_part(one: Commitment) -> dict:
    """One of them."""
    pose = one.asked.pose
    values = pose.place if pose.heading is None else np.append(pose.place, pose.heading)
    return {
        "begin": str(one.begin),
        "pose": hex_text(values),
        "problem": problem_part(one.asked.problem, one.asked.model),
        "sample": one.part,
    }
