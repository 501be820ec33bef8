"""What `solve` prints."""

import json
from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.numbers import facts_of, table_of
from parc_jax.common.status import Status
from parc_jax.learning.labels import name_of, unit_of


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
    }
    return json.dumps(facts, indent=1)


def verdict(answer: Answer, path: Path, cold_s: float | None, short: bool = False) -> str:
    """For a terminal. cold_s: as of `facts_of`."""
    lines = []
    if answer.status.found and not short:
        n_p, names = answer.model.n_p, answer.model.labels
        plan = _some_plan(answer)
        lines += [
            *table_of(answer, cold_s),
            f"for example            start at {_named(plan[:n_p], names.p)}",
            f"                       with {_named(plan[n_p:], names.k)}",
            "",
        ]
    lines.append(answer.details())
    if not short:
        lines += ["", f"Written to {path}. Verify with: parc-jax check {path}"]
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
