"""Exact numbers as text: certificates, claims and questions hold no JSON floats. A float is the
rational that it holds, and its text here is that rational; but for `rounded_up` and
`rounded_down`, for people, which say on which side of it they are. And counts, for people.
"""

import math
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction

import numpy as np

from parc_jax.checker import number

LONGEST_DECIMAL = 80  # characters of a decimal that a person still reads; beyond, hexadecimal
MOST_LISTED = 8  # things that a sentence names; of more it says that there are others


def hex_text(values):
    """Floats of any shape as nested lists of hexadecimal floats, a single one as a string."""
    values = np.asarray(values, np.float64)
    texts = np.array([x.hex() for x in values.ravel().tolist()], object)
    return texts.reshape(values.shape).tolist()  # all at once: a tube is ten thousands of numbers


def hex_floats(values):
    """The floats of `hex_text`, in lists nested in the same way."""
    return float.fromhex(values) if isinstance(values, str) else [hex_floats(v) for v in values]


def decimal_text(values):
    """Floats of any shape as nested lists of exact decimals without exponent, a single one as a
    string: 0.1 gives 0.1000000000000000055511151231257827…; hexadecimal where it would take more
    than LONGEST_DECIMAL characters.
    """
    values = np.asarray(values, np.float64)
    if values.ndim:
        return [decimal_text(v) for v in values]
    text = format(Decimal(values.item()), "f")
    return text if len(text) <= LONGEST_DECIMAL else values.item().hex()


def fraction_text(values):
    """Exact rationals in nested lists as "p/q", integers as "p"."""
    if isinstance(values, list | tuple):
        return [fraction_text(v) for v in values]
    return str(Fraction(values))


def rounded_up(value, digits: int = 2) -> str:
    """A bound of so many digits, never below the value: a rational, a float, a decimal in text."""
    return _rounded(value, digits, ROUND_CEILING)


def exact(value: float) -> str:
    """A number in its shortest decimal that reads back as the same one."""
    return repr(float(value)).removesuffix(".0")


def rounded_down(value, digits: int = 2) -> str:
    """A lower bound for people: never above the value. See `rounded_up`."""
    return _rounded(value, digits, ROUND_FLOOR)


def _rounded(value, digits: int, rounding: str) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return str(float(value))
    exact = Fraction(value)
    short = Context(prec=digits, rounding=rounding).divide(
        Decimal(exact.numerator), Decimal(exact.denominator)
    )
    return f"{float(short):.12g}"


def plain(value):
    """Plain data without floats: each as its shortest decimal, for people; no proof reads it."""
    if isinstance(value, dict):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    return repr(float(value)) if isinstance(value, float) else value


def nearest_floats(value):
    """The nearest floats of nested lists of numbers as text. Zeros keep their sign, for hashes."""
    if isinstance(value, list):
        return [nearest_floats(v) for v in value]
    if not isinstance(value, str):
        return float(value)
    return float(number(value)) or (-0.0 if value.startswith("-") else 0.0)


def counted(n: int, one: str, many: str | None = None) -> str:
    """So many of something, in English: "1 corridor", "52 corridors"."""
    return f"{n:,} {one if n == 1 else many or one + 's'}"


def listed(parts: Sequence[str]) -> str:
    """In English: "a", "a and b", "a, b and c"."""
    *first, last = parts
    return f"{', '.join(first)} and {last}" if first else last


def some_of(things: Sequence) -> str:
    """In English: the first MOST_LISTED, and that there are others, if so."""
    more = ["others"] if len(things) > MOST_LISTED else []
    return listed([*map(str, things[:MOST_LISTED]), *more])
