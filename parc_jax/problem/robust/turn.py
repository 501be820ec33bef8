"""A heading within an angle: maps of the plane whose mixtures are all its turns. [T22]"""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.system import TURNS

BITS = 48  # of the entries of the maps
LEAST = 1e-4  # [rad] a smaller angle is taken for this one


class Turn(NamedTuple):
    """maps (R, n_p, n_p): every turn by at most the angle is a mixture of them, for all vectors
    alike. sine: at least that of the angle. of_q (n_q,): what the other goal states turn by.
    """

    maps: np.ndarray
    sine: float
    of_q: np.ndarray

    def widened(self, widths: np.ndarray) -> np.ndarray:
        """Half widths (..., n_p) of errors that turn too."""
        if not self.sine:
            return widths
        return widths + self.sine * widths[..., ::-1]


def no_turn(n_p: int, n_q: int) -> Turn:
    """The heading is known."""
    return Turn(np.eye(n_p)[None], 0.0, np.zeros(n_q))


def turn_by(angle: float, rotation: tuple[str, ...]) -> Turn:
    """All turns of the plane by at most an angle [rad] below 1. rotation: which of the other goal
    states turn.

    As complex numbers, turns are an arc of the unit circle, in the triangle of a + ib, a - ib and
    g: a is no larger than its cosine, and the lines from a ± ib to g miss the circle.
    """
    if not 0 < angle < 1:
        raise InputError(f"heading: expected a half angle between 0 and 1 rad; got {angle:g}.")
    unit = Fraction(1, 2**BITS)
    # less than the cosine, however that was rounded
    a = math.floor((math.cos(max(angle, LEAST)) - 2.0**-46) / unit) * unit
    b = unit * (math.isqrt(math.floor((1 - a * a) / unit**2)) + 2)
    g = math.ceil(a / (1 - b * b) / unit) * unit
    if not (a * a + b * b >= 1 and misses_circle(a, b, g)):
        raise InputError(f"heading: expected an angle that a triangle holds; got {angle:g}.")
    a, b, g = float(a), float(b), float(g)
    maps = np.array([[[a, -b], [b, a]], [[a, b], [-b, a]], [[g, 0.0], [0.0, g]]])
    turns = np.array([word == TURNS for word in rotation], float)
    return Turn(maps, b, turns * math.nextafter(angle, math.inf))


def misses_circle(a: Fraction, b: Fraction, g: Fraction) -> bool:
    """The line through a + ib and g is at least 1 away from the origin, which lies before it."""
    return 0 < a < g and b > 0 and g * g * b * b >= b * b + (g - a) ** 2
