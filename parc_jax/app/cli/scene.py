"""The scene of `solve`: its uncertainty from the shell, scenes that cannot have a plan for a reason
that fits in a sentence, and the printed answer.
"""

import dataclasses
import json
from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.report import facts_of, in_the_way, said_of
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.vertices import vertices
from parc_jax.common.status import Status
from parc_jax.learning.labels import degrees_hint, name_of, unit_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import outputs
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem, finite_box, goal_box
from parc_jax.problem.uncertainty import FREE, Uncertainty

MOST_PARAMETERS = 6  # of the exact enumeration of regions


def under_uncertainty(problem: Problem, entries: dict) -> Problem:
    """The problem with these entries of its uncertainty in place of the scene's. Those of
    parameters are words of the shell. Raises InputError.
    """
    entries = dict(entries)
    for name, option in (("k", "uncertainty-k"), ("given", "given"), ("unknown", "unknown")):
        if name in entries:
            entries[name] = _by_name(option, entries[name])
    if not entries:
        return problem
    return problem.replace(
        uncertainty=dataclasses.replace(problem.uncertainty or Uncertainty(), **entries)
    )


def numbers_of_option(option: str, text: str) -> list[float]:
    """Numbers with commas between. Raises InputError."""
    try:
        return [float(x) for x in text.split(",")]
    except ValueError:
        raise InputError(
            f"--{option}: expected numbers with commas between, such as 1.5,-2,0.1; got "
            f"{text!r:.40}."
        ) from None


def _by_name(option: str, words: tuple[str, ...]) -> tuple:
    """name=value, name=lo:hi or name=free, by name or by number."""
    pairs: list = []
    for word in words:
        name, _, text = word.partition("=")
        values = [FREE] if text == FREE else _values(text)
        if not name or not 1 <= len(values) <= 2:
            raise InputError(
                f"--{option}: expected NAME=VALUE or NAME=LO:HI, such as speed=9.2; got "
                f"{word!r:.40}."
            )
        pairs.append((name, values[0] if len(values) == 1 else tuple(values)))
    return tuple(pairs)


def _values(text: str) -> list[float]:
    try:
        return [float(x) for x in text.split(":")]
    except ValueError:
        return []


def require_goal_in_reach(problem: Problem, planner: Planner) -> None:
    """Refuse a goal inside one obstacle, or one that no plan of the model ends in.

    For messages only: a scene that passes may still have no safe plan, which is then proved or left
    open by the query. Raises InputError.
    """
    model, goal = planner.model, problem.goal
    if goal.n != model.n_c + model.n_q:
        return  # the planner says it better
    lo, hi = goal_box(goal, model.layout)
    corners = _corners_of_first(goal, model)
    for j, (obstacle, span) in enumerate(zip(problem.obstacles, problem.spans, strict=True)):
        at_the_end = span is None or span[1] >= model.time.n_steps - 1
        if (
            at_the_end
            and obstacle.n == model.n_p
            and len(corners)
            and obstacle.contains(corners).all()
        ):
            raise InputError(
                f"goal: expected some room outside the obstacles; all of it lies in obstacle {j}. "
                "Move one of them."
            )
    if model.n_k > MOST_PARAMETERS:
        return
    end_lo, end_hi = _ends(problem, planner)
    missed = (lo > end_hi) | (hi < end_lo)
    if missed.any():
        axis = int(np.argmax(missed))
        kind = _name(model, axis)
        raise InputError(
            f"goal: expected some of it within reach; it asks for {kind} in [{lo[axis]:.5g}, "
            f"{hi[axis]:.5g}] and the "
            f"plans of this model end in [{end_lo[axis]:.5g}, {end_hi[axis]:.5g}]. Move the "
            "goal"
            f"{' or the start set' if axis < model.n_c else ''}, or learn over a wider K."
            f"{degrees_hint(kind, lo[axis], hi[axis])}"
        )


def _ends(problem: Problem, planner: Planner) -> tuple[np.ndarray, np.ndarray]:
    """Box of predicted final (p, q): a piecewise affine map takes its extremes at vertices of its
    regions.
    """
    model = planner.model
    n_c = model.n_c
    k = np.asarray(planner.regions.points)
    final = outputs(model.net, k, slice(model.layout.n_offsets - n_c, None))
    lo, hi = final.min(axis=0), final.max(axis=0)
    if problem.start is None or problem.start.n != model.n_p:
        lo[:n_c], hi[:n_c] = -np.inf, np.inf
        return lo, hi
    start_lo, start_hi = finite_box(problem.start, "start")
    lo[:n_c] += np.tile(start_lo, model.n_points)
    hi[:n_c] += np.tile(start_hi, model.n_points)
    return lo, hi


def _corners_of_first(goal: HPolytope, model: TrajectoryModel) -> np.ndarray:
    """(v, n_p) corners of where the goal lets the first reference point end; none where it asks for
    several points together.
    """
    if model.n_points == 1:
        return vertices(goal)[:, : model.n_p]
    first = (goal.A[:, : model.n_p] != 0).any(axis=1)
    if (goal.A[first, model.n_p :] != 0).any():
        return np.zeros((0, model.n_p))
    return vertices(HPolytope(goal.A[first, : model.n_p], goal.b[first]))


def _name(model: TrajectoryModel, axis: int) -> str:
    """The label of a coordinate of the goal."""
    if axis >= model.n_c:
        return model.labels.q[axis - model.n_c]
    label = model.labels.p[axis % model.n_p]
    return label if model.n_points == 1 else f"{label} of {model.points[axis // model.n_p]}"


def as_json(answer: Answer, path: Path, cold_s: float | None) -> str:
    """The facts of an answer for other programs; the answer itself is in its file."""
    facts = {
        "answer": str(path),
        "found": answer.status.found,
        "proved_no_plan": answer.status is Status.NO_PLAN,
        "samples": len(answer.samples),
        **facts_of(answer, cold_s),
        "first": answer.samples[0].tolist() if len(answer.samples) else None,
        "statement": answer.details(),
        "in_the_way": in_the_way(answer),
    }
    return json.dumps(facts, indent=1)


def verdict(answer: Answer, path: Path, short: bool = False) -> str:
    """For a terminal, in at most fifteen lines."""
    lines = [said_of(answer)]
    if answer.status.found and not short:
        n_p, names = answer.model.n_p, answer.model.labels
        plan = _some_plan(answer)
        where, how = _named(plan[:n_p], names.p), _named(plan[n_p:], names.k)
        lines.append(f"For example: start at {where}, with {how}.")
    if not short:
        lines.append(f"All sentences: parc-jax explain {path}; check: parc-jax check {path}")
    return "\n".join(lines)


def _some_plan(answer: Answer) -> np.ndarray:
    """A plan of the answer: the exact check may have refused every sample and accepted others."""
    if len(answer.samples):
        return answer.samples[0]
    one = answer.corridors[0]
    return np.concatenate([one.p0, one.k])


def _named(values: np.ndarray, labels: tuple[str, ...]) -> str:
    """Values with names and units."""
    parts = zip(values, labels, strict=True)
    return ", ".join(f"{name_of(n)} = {v:.5g} {unit_of(n)}".rstrip() for v, n in parts)
