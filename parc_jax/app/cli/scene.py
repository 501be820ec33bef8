"""The scene of `solve`: its uncertainty from the shell; and the printed answer."""

import dataclasses
import json
from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.report import facts_of, in_the_way, said_of
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
        # the exact check may have refused every sample and accepted corridors
        one = None if len(answer.samples) else answer.corridors[0]
        plan = answer.samples[0] if one is None else np.concatenate([one.p0, one.k])
        where, how = _named(plan[:n_p], names.p), _named(plan[n_p:], names.k)
        turned = "in the robot's frame, " * answer.scene.nominal.turned
        lines.append(f"For example: {turned}start at {where}, with {how}.")
    if not short:
        lines.append(f"All sentences: parc-jax explain {path}; check: parc-jax check {path}")
    return "\n".join(lines)


def _named(values: np.ndarray, labels: tuple[str, ...]) -> str:
    parts = zip(values, labels, strict=True)
    return ", ".join(f"{name_of(n)} = {exact(v)} {unit_of(n)}".rstrip() for v, n in parts)
