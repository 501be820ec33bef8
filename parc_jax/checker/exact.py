"""Exact numbers as certificates spell them, lists of them, and half-spaces."""

import contextlib
import math
import operator
import re
from fractions import Fraction

MAX_CHARS = 1000  # of one number
MAX_BITS = 1 << 13  # of a common denominator
FRACTION = 16  # work of one operation on fractions, in products of short integers

HEX = re.compile(r"(-?)0x([0-9a-f]{1,40})(?:\.([0-9a-f]{0,40}))?p([+-]?[0-9]{1,4})")
DECIMAL = re.compile(r"-?[0-9]+(?:/[0-9]+|(?:\.[0-9]+)?(?:e[+-]?[0-9]{1,3})?)")


class Rejected(Exception):
    """The answer is not accepted; the message says why in one sentence."""


class NotAnAnswer(Rejected):
    """The file is no answer file at all: there is nothing to accept or to reject."""


def need(ok, reason):
    """Rejects unless ok is True itself."""
    if ok is not True:
        raise Rejected(reason)


@contextlib.contextmanager
def rejecting(where=""):
    """Every exception inside becomes Rejected, so that nothing unforeseen can pass.

    Only a file that cannot be read (OSError) and a file of another kind stay what they are.
    """
    try:
        yield
    except (OSError, NotAnAnswer):
        raise
    except Rejected as error:
        raise Rejected(f"{where}{str(error)[:200]}") from error
    except Exception as error:
        kind = type(error).__name__
        raise Rejected(f"{where}malformed input, {kind}: {str(error)[:200]}") from error


def dyadic(text):
    """(n, i) of a hex float n 2^i, n odd unless i >= 0; None for what is spelled otherwise."""
    if len(text) > MAX_CHARS:
        raise Rejected("a number is too long")
    found = HEX.fullmatch(text)
    if found is None:
        return None
    sign, before, after, power = found.groups("")
    digits = int(sign + before + after, 16)
    exponent = int(power) - 4 * len(after)
    if digits & 1 or exponent >= 0:
        return digits, exponent
    if digits == 0:
        return 0, 0
    twos = min(-exponent, (digits & -digits).bit_length() - 1)
    return digits >> twos, exponent + twos


def number(text):
    """The rational that a hex float, a decimal or p/q spells, exactly; never through a float."""
    found = dyadic(text)
    if found is not None:
        digits, exponent = found
        if exponent >= 0:
            return Fraction(digits << exponent)
        return Fraction(digits, 1 << -exponent)
    need(DECIMAL.fullmatch(text) is not None, f"not a finite number: {text[:40]!r}")
    return Fraction(text)


def decimal(x: Fraction) -> str:
    """A number for people, to twelve decimals; a fraction where these are all zeros."""
    units = (abs(x.numerator) * 2 * 10**12 + x.denominator) // (2 * x.denominator)
    if x and not units:
        return f"{x.numerator}/{x.denominator}"
    whole_part, rest = divmod(units, 10**12)
    sign, digits = "-" if x < 0 else "", f"{rest:012d}".rstrip("0")
    return f"{sign}{whole_part}{'.' if digits else ''}{digits}"


def array(x, n=None):
    """x itself, if it is a list (of n entries)."""
    need(type(x) is list, "a list was expected")
    need(n is None or len(x) == n, f"a list of {n} entries was expected, got {len(x)}")
    return x


def vector(x, n):
    """The numbers of a list of n."""
    return [number(entry) for entry in array(x, n)]


def whole(x, least, most):
    """x itself, if it is an integer in least .. most; true and false are none."""
    need(type(x) is int, "a whole number was expected")
    need(least <= x <= most, f"the whole number {x} is not in {least}..{most}")
    return x


def fields(x, names, optional=()):
    """x itself, if it is an object with all of these names and none but these and the optional."""
    known = {*names, *optional}
    need(set(names) <= set(x) <= known, f"expected the fields {names}, got {list(x)[:20]}")
    return x


def integers(numbers):
    """Integers n_i and one denominator D > 0 with numbers_i = n_i / D, all of bounded length."""
    D = 1
    for x in numbers:
        D = math.lcm(D, x.denominator)
        need(D.bit_length() <= MAX_BITS, "a common denominator is too long")
    scaled = [x.numerator * (D // x.denominator) for x in numbers]
    longest = max((n.bit_length() for n in scaled), default=0)
    need(longest <= 2 * MAX_BITS, "a number is too large for its denominator")
    return scaled, D


def whole_numbers(texts):
    """The same of the numbers that texts spell."""
    found = hex_integers(texts)
    return integers([number(text) for text in texts]) if found is None else found


def hex_integers(texts):
    """The same of hex floats, None if any text is spelled otherwise. Networks and tubes are long
    lists of these, which go without fractions.
    """
    found = [dyadic(text) for text in texts]
    if None in found:
        return None
    shift = max([0, *(-exponent for _, exponent in found)])  # the denominator is 2^shift
    need(shift < MAX_BITS, "a common denominator is too long")
    scaled = [digits << (exponent + shift) for digits, exponent in found]
    longest = max(map(int.bit_length, scaled), default=0)
    need(longest <= 2 * MAX_BITS, "a number is too large for its denominator")
    return scaled, 1 << shift


def dot(a, b):
    """a . b, for lists of equal length."""
    return sum(map(operator.mul, a, b))


def halfspaces(x, n):
    """Rows (a, b) of the closed set {a . x <= b} in n dimensions, with denominators of bounded
    length together.
    """
    rows, scale = whole_halfspaces(x, n)
    return [([Fraction(v, scale) for v in a], Fraction(b, scale)) for a, b in rows]


def whole_halfspaces(x, n):
    """The same in integers over one scale: (rows, scale)."""
    A = array(x["A"])
    texts = list(array(x["b"], len(A)))
    for row in A:
        texts += array(row, n)
    found, scale = whole_numbers(texts)
    along = [found[i : i + n] for i in range(len(A), len(found), n)]
    return list(zip(along, found[: len(A)], strict=True)), scale


def box(x, n):
    """(lo, hi) of a box in n dimensions, lo <= hi."""
    fields(x, ("lo", "hi"))
    lo, hi = [vector(x[side], n) for side in ("lo", "hi")]
    need(all(a <= b for a, b in zip(lo, hi, strict=True)), "a box is reversed")
    return lo, hi


def combine(rows, multipliers, n):
    """Multipliers m_i >= 0 of rows a_i . x <= b_i in n dimensions give w . x <= h for all x in the
    set, where w = sum m_i a_i and h = sum m_i b_i: (w, h). [T12a]
    """
    parsed = parsed_multipliers(multipliers, len(rows))
    for _, m in parsed:
        need(m >= 0, "a multiplier is negative")
    return weighted(rows, parsed, n)


def parsed_multipliers(multipliers, n_rows):
    """[(number of a row, multiplier)] of a list [[row, "m"], ...]."""
    values = [number(m) for _, m in array(multipliers)]
    integers(values)  # bounds their length together
    numbers = [whole(row, 0, n_rows - 1) for row, _ in multipliers]
    return list(zip(numbers, values, strict=True))


def weighted(rows, multipliers, n):
    """The sum (w, h) of rows (a, b) in n dimensions with parsed multipliers."""
    w = [Fraction(0)] * n
    h = Fraction(0)
    for row, m in multipliers:
        a, b = rows[row]
        w = [x + m * y for x, y in zip(w, a, strict=True)]
        h += m * b
    return w, h
