"""Corners of planar polytopes, exact, with the rows that meet there. Floats are the rationals that
they hold.
"""

from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from parc_jax.errors import InputError
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.sets.rational import Point, rational_vertices

FARTHEST = 10**100  # [m] a corner beyond this is taken for a direction left open


class Corner(NamedTuple):
    """A vertex and the rows active at it. point: exact (x, y). rows: indices, sorted by the angle
    of their normals.
    """

    point: Point
    rows: tuple[int, ...]


def corners(poly: HPolytope, name: str = "polygon") -> tuple[Corner, ...]:
    """Corners of a bounded planar polytope, counter-clockwise, exact. Raises InputError when empty
    or unbounded.

    The last few hundred polytopes are remembered.
    """
    if poly.n != 2:
        raise InputError(
            f"{name}: expected a set in the plane; got {poly.n} dimensions. Only planar workspaces "
            "solve."
        )
    return _corners(poly.A.tobytes(), poly.b.tobytes(), name)


@lru_cache(maxsize=512)
def _corners(rows: bytes, offsets: bytes, name: str) -> tuple[Corner, ...]:
    A = np.frombuffer(rows).reshape(-1, 2)
    b = np.frombuffer(offsets)
    points = rational_vertices(HPolytope(A, b), name)
    if not points:
        raise InputError(
            f"{name}: expected a set with points in it; its rows contradict each other."
        )
    if any(abs(x) > FARTHEST for point in points for x in point):
        raise InputError(
            f"{name}: expected a bounded set; its rows leave a direction open. Add the missing far "
            "side."
        )
    exact = [(Fraction(a), Fraction(c), Fraction(e)) for (a, c), e in zip(A, b, strict=True)]
    by_angle = np.argsort(np.arctan2(A[:, 1], A[:, 0]), kind="stable").tolist()
    out = []
    for x, y in points:
        meeting = [i for i in by_angle if exact[i][0] * x + exact[i][1] * y == exact[i][2]]
        out.append(Corner((x, y), tuple(meeting)))
    return tuple(out)
