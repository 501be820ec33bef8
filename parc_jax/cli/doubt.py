"""What the shell says of doubt, on top of what the scene says."""

import dataclasses

from parc_jax.doubt import Doubt
from parc_jax.errors import InputError
from parc_jax.problem import ReachAvoid


def under_doubt(
    problem: ReachAvoid,
    *,
    start: tuple[float, ...] | None,
    heading: float | None,
    k: tuple[str, ...] | None,
    goal: tuple[float, ...] | None,
    given: tuple[str, ...] | None,
    unknown: tuple[str, ...] | None,
    sensing_eps: str | None,
) -> ReachAvoid:
    """The problem with these entries of its doubt, where there are any, in place of the scene's.
    Raises InputError.
    """
    asked = {
        "start": start,
        "heading": heading,
        "k": None if k is None else _by_name("doubt-k", k),
        "goal": goal,
        "given": None if given is None else _by_name("given", given),
        "unknown": None if unknown is None else _by_name("unknown", unknown),
        "sensing_eps": sensing_eps,
    }
    asked = {name: value for name, value in asked.items() if value is not None}
    if not asked:
        return problem
    own = problem.doubt or Doubt()
    kept = {field.name: getattr(own, field.name) for field in dataclasses.fields(Doubt)}
    return problem.replace(doubt=Doubt(**kept | asked))


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
    """name=value or name=lo:hi, by name or by number."""
    found = []
    for word in words:
        name, _, text = word.partition("=")
        values = _values(text)
        if not name or not 1 <= len(values) <= 2:
            raise InputError(
                f"--{option}: expected NAME=VALUE or NAME=LO:HI, such as speed=9.2; got "
                f"{word!r:.40}."
            )
        found.append((name, values[0] if len(values) == 1 else tuple(values)))
    return tuple(found)


def _values(text: str) -> list[float]:
    try:
        return [float(x) for x in text.split(":")]
    except ValueError:
        return []
