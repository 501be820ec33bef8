"""An episode as a file, which the checker reads: all that was committed to, from first to last."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from parc_jax.base.spelling import hex_text, plain
from parc_jax.certificate.write import part_hash, problem_part, question_parts
from parc_jax.errors import InputError
from parc_jax.loop.commitment import Commitment
from parc_jax.robust.question import Plain
from parc_jax.rollout.files import write_atomic

FORMAT = "parc_jax.episode/1"


def episode_part(
    commitments: Sequence[Commitment], meta: dict | None = None, drift: float = 0.0
) -> dict:
    """The whole file of an episode: commitments of one loop, in their order. meta: what needs no
    proof, as plain values. drift: [m] by which a place may be off against the one before, as that
    of odometry is; a chain of manoeuvres is checked with so much room. Raises InputError.
    """
    if not commitments:
        raise InputError("episode: expected at least one commitment; got none.")
    first = commitments[0].asked
    if any(one.asked.model is not first.model for one in commitments):
        raise InputError("episode: expected commitments of one loop; got some of another model.")
    if not (np.isfinite(drift) and drift >= 0):
        raise InputError(f"episode: expected a drift >= 0 m; got {drift!r:.40}.")
    return head_part(first, drift) | {
        "manoeuvres": [manoeuvre_part(one) for one in commitments],
        "meta": plain(meta),
    }


def head_part(first: Plain, drift: float = 0.0) -> dict:
    """What an episode that begins with this question says of all its manoeuvres; drift [m] as of
    `episode_part`.
    """
    model = first.model
    _, network, tube = question_parts(first.problem, model)
    hashes = {"network": part_hash(network), "tube": part_hash(tube)}
    claim = model.claim.to_json() | {f"{name}_hash": value for name, value in hashes.items()}
    doubt = first.question.problem.doubt
    start = np.zeros(model.n_p) if doubt is None else doubt.shifts(model.n_p)
    start = start + drift / (2 * model.n_p)  # of both places, along all axes: together the drift
    heading = 0.0 if doubt is None else float(doubt.heading or 0.0)
    return {
        "format": FORMAT,
        "network": network,
        "tube": tube,
        "claim": plain(claim),
        "hash": hashes,
        # points of the plain question for each point of the robot
        "copies": model.n_points // first.question.model.n_points,
        "doubt": hex_text(np.append(start, heading)),
    }


def save_episode(
    path: str | Path,
    commitments: Sequence[Commitment],
    meta: dict | None = None,
    drift: float = 0.0,
) -> Path:
    """Write it whole or not at all; `parc-jax check` verifies it. meta, drift: as of
    `parc_jax.loop.log.episode_part`: what needs no proof, and by how much [m] odometry may be off
    from one pose to the next. Raises InputError.
    """
    text = json.dumps(episode_part(commitments, meta, drift), separators=(",", ":"))
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
