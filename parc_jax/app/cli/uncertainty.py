"""What the shell says of uncertainty, on top of what the scene says."""

import dataclasses

from parc_jax.common.errors import InputError
from parc_jax.problem.problem import Problem
from parc_jax.problem.uncertainty import FREE, Uncertainty


def under_uncertainty(problem: Problem, asked: dict) -> Problem:
    """The problem with these entries of its uncertainty, where there are any, in place of the
    scene's; those of parameters as words of the shell. Raises InputError.
    """
    asked = dict(asked)
    for name, option in (("k", "uncertainty-k"), ("given", "given"), ("unknown", "unknown")):
        if name in asked:
            asked[name] = _by_name(option, asked[name])
    if not asked:
        return problem
    own = problem.uncertainty or Uncertainty()
    kept = {field.name: getattr(own, field.name) for field in dataclasses.fields(Uncertainty)}
    return problem.replace(uncertainty=Uncertainty(**kept | asked))


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
    found: list = []
    for word in words:
        name, _, text = word.partition("=")
        values = [FREE] if text == FREE else _values(text)
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
