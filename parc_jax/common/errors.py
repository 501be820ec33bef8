"""Errors people can act on: the expectation, the given value, a way out."""


class ParcError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(ParcError, ValueError):
    """The caller's input cannot be used. One sentence: expected, got, what to try. Exit code 2."""


class BudgetError(ParcError, RuntimeError):
    """A stated cap (regions, memory, seconds) was reached before the work was complete."""


class SoundnessError(ParcError, RuntimeError):
    """A proof obligation failed (incomplete region table, refused probe): certification ends."""


def check_kind(name: str, value: object, kind: type) -> None:
    """Raises InputError for a value that is none of a kind."""
    if not isinstance(value, kind):
        raise InputError(f"{name}: expected {kind.__name__}; got {value!r:.60}.")


def expected(call: str, what: str, got: object, hint: str) -> str:
    """The sentence for an argument of a wrong type, with a hint."""
    shown = f"{got!r:.60}" if isinstance(got, str | int | float) else type(got).__name__
    return f"{call}: expected {what}; got {shown}. Try {hint}."
