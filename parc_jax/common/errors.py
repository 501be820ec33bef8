"""Errors people can act on: the expectation, the given value, a way out."""

import contextlib
from collections.abc import Iterator
from numbers import Integral
from typing import Any

# of data that are not as they were written, whoever reads them
_WRONG: tuple[type[Exception], ...] = (OSError, LookupError, TypeError, AttributeError)
_WRONG += (ValueError, ArithmeticError, RecursionError)


class ParcError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(ParcError, ValueError):
    """The caller's input cannot be used. One sentence: expected, got, what to try. Exit code 2."""


class BudgetError(ParcError, RuntimeError):
    """A stated cap (regions, memory, seconds) was reached before the work was complete."""


class SoundnessError(ParcError, RuntimeError):
    """A proof obligation failed (incomplete region table, refused probe): certification ends."""


def check_kind(name: str, value: object, kind: Any) -> None:
    """Raises InputError for a value that is none of a kind."""
    if not isinstance(value, kind):
        told = getattr(kind, "__name__", kind)  # of several
        raise InputError(f"{name}: expected {told}; got {shown(value)}.")


def check_count(name: str, value, least: int, hint: str) -> None:
    """Raises InputError for a value that is no whole number, or too small a one."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InputError(expected(name, f"a whole number >= {least}", value, hint))


def shown(value: object, most: int = 60) -> str:
    """The beginning of what is written of a value, on one line."""
    try:
        text = repr(value)
    except Exception:  # of thousands of digits, say
        text = f"<{type(value).__name__}>"
    return " ".join(text.split())[:most]


def is_text(value: object) -> bool:
    """Whether it is text that can be printed as it is and ends no line."""
    return isinstance(value, str) and value.isprintable()


def check_text(name: str, text: object) -> None:
    """Raises InputError for what is no `is_text`."""
    if not is_text(text):
        raise InputError(
            f"{name}: expected text on one line, of characters that can be printed; got "
            f"{shown(text)}. Leave line breaks and control characters out."
        )


@contextlib.contextmanager
def naming(name: object) -> Iterator[None]:
    """Sentences of an InputError within begin with `name`, too."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


@contextlib.contextmanager
def reading(name: object, what: str, *more: type[Exception]) -> Iterator[None]:
    """Errors of a file or a text that is not as it was written end in a sentence: `name` was
    expected to be `what`. more: errors of its reader, beside those of Python; of Exception the
    cause is kept. Raises InputError.
    """
    try:
        yield
    except ParcError:
        raise
    except FileNotFoundError:
        raise InputError(f"{name}: no such file.") from None
    except _WRONG + more as error:
        kind, why = type(error).__name__, " ".join(str(error).split())
        cause = error if Exception in more else None
        raise InputError(f"{name}: expected {what}; got {kind}: {why:.200}.") from cause


def expected(call: str, what: str, got: object, hint: str) -> str:
    """The sentence for an argument of a wrong type, with a hint."""
    told = shown(got) if isinstance(got, str | int | float) else type(got).__name__
    return f"{call}: expected {what}; got {told}. Try {hint}."
