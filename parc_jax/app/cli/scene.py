"""The scene of `solve`: its uncertainty from the shell; and the printed answer."""

import dataclasses
import json
from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.report import facts_of, in_the_way, said_of, validated
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import exact
from parc_jax.common.status import Status
from parc_jax.learning.labels import name_of, unit_of
from parc_jax.problem.problem import Problem
from parc_jax.problem.uncertainty import FREE, Uncertainty


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
    known = problem.uncertainty or Uncertainty()
    return problem.replace(uncertainty=dataclasses.replace(known, **entries))


def place_of_option(text: str | None) -> list[float] | None:
    """The numbers of --at. Raises InputError."""
    numbers = None if text is None else _numbers(text, ",")
    if numbers == []:
        raise InputError(
            f"--at: expected numbers with commas between, such as 1.5,-2,0.1; got {text!r:.40}."
        )
    return numbers


def _by_name(option: str, words: tuple[str, ...]) -> tuple:
    """name=value, name=lo:hi or name=free, by name or by number."""
    pairs: list = []
    for word in words:
        name, _, text = word.partition("=")
        values = [FREE] if text == FREE else _numbers(text, ":")
        if not name or not 1 <= len(values) <= 2:
            raise InputError(
                f"--{option}: expected NAME=VALUE or NAME=LO:HI, such as speed=9.2; got "
                f"{word!r:.40}."
            )
        pairs.append((name, values[0] if len(values) == 1 else tuple(values)))
    return tuple(pairs)


def _numbers(text: str, between: str) -> list[float]:
    """The numbers in a text; none where anything else is in it."""
    try:
        return [float(x) for x in text.split(between)]
    except ValueError:
        return []


def beside(path: Path) -> Path:
    """The file of the validated set of the answer in a file."""
    return path.with_suffix(".validated.json")


def as_json(answer: Answer, path: Path, cold_s: float | None) -> str:
    """The facts of an answer for other programs; the answer itself is in its file."""
    plan, turned = first_plan(answer), answer.scene.nominal.turned
    facts = {
        "answer": str(path),
        "found": answer.status.found,
        "proved_no_plan": answer.status is Status.NO_PLAN,
        "samples": len(answer.samples),
        **facts_of(answer, cold_s),
        "first": None if plan is None else plan.tolist(),
        "frame": "robot" if turned else "world",
        "statement": answer.details(),
        "in_the_way": in_the_way(answer),
    }
    if validated(answer) is not None:
        facts["validated"]["answer"] = str(beside(path))
    return json.dumps(facts, indent=1)


def code_of(answer: Answer) -> int:
    """The exit code: 0 with plans, of the safe set or of a validated one, else 1."""
    return 0 if answer.status.found or validated(answer) is not None else 1


def first_plan(answer: Answer) -> np.ndarray | None:
    """(n_p + n_k,) its first sample, or the plan of its first corridor; None without any."""
    if len(answer.samples) or not answer.corridors:
        return answer.samples[0] if len(answer.samples) else None
    # the exact check may have refused every sample and accepted corridors
    return np.concatenate([answer.corridors[0].p0, answer.corridors[0].k])


def verdict(answer: Answer, path: Path, short: bool = False) -> str:
    """For a terminal, in at most fifteen lines."""
    lines = [said_of(answer)]
    if (plan := first_plan(answer)) is not None and not short:
        n_p, names = answer.model.n_p, answer.model.labels
        where, how = _named(plan[:n_p], names.p), _named(plan[n_p:], names.k)
        turned = "in the robot's frame, " * answer.scene.nominal.turned
        lines.append(f"For example: {turned}start at {where}, with {how}.")
    if not short:
        lines.append(f"All sentences: parc-jax explain {path}; check: parc-jax check {path}")
    if validated(answer) is not None:
        own = beside(path)
        lines.append(f"The validated set: parc-jax explain {own}; parc-jax check {own}")
    return "\n".join(lines)


def _named(values: np.ndarray, labels: tuple[str, ...]) -> str:
    parts = zip(values, labels, strict=True)
    return ", ".join(f"{name_of(n)} = {exact(v)} {unit_of(n)}".rstrip() for v, n in parts)
