"""Cosine and sine of a rational angle, enclosed in rationals."""

from fractions import Fraction

from .exact import need

UNIT = 1 << 120  # of the fixed point in which both series are summed
TERMS = 60  # of both together
MOST = 8  # [rad] the largest angle, more than a turn
# More than all roundings, which are less than 2^14 units, and than what follows the last term,
# which is less than 8^60 / 60! * 1.2 < 2^-91
OFF = Fraction(1, 1 << 90)


def cosine_and_sine(angle):
    """Both, each within OFF of the truth."""
    need(abs(angle) <= MOST, f"a heading is beyond {MOST} rad")
    x = round(angle * UNIT)
    sums = [0, 0]
    term = UNIT
    for n in range(TERMS):
        sums[n % 2] += term if n % 4 < 2 else -term
        term = term * x // ((n + 1) * UNIT)
    return Fraction(sums[0], UNIT), Fraction(sums[1], UNIT)
