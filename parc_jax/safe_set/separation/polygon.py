"""Corners of polytopes in the plane and in space, exact, with the rows that meet there. Floats are
the rationals that they hold.
"""

from fractions import Fraction
from functools import lru_cache
from operator import mul
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.rational import Point, rational_vertices, whole

FARTHEST = 10**100  # [m] a corner beyond this is taken for a direction left open


class Corner(NamedTuple):
    """A vertex and the rows active at it. point: exact (n_p,). rows: indices, in the plane by the
    angle of their normals.
    """

    point: Point
    rows: tuple[int, ...]


def corners(poly: HPolytope, name: str = "polygon") -> tuple[Corner, ...]:
    """Corners of a bounded polytope in the plane, counter-clockwise, or in space; exact. Raises
    InputError when empty or unbounded.

    The last few hundred polytopes are remembered.
    """
    return _corners(poly.A.tobytes(), poly.b.tobytes(), poly.n, name)


@lru_cache(maxsize=512)
def _corners(rows: bytes, offsets: bytes, n: int, name: str) -> tuple[Corner, ...]:
    A = np.frombuffer(rows).reshape(-1, n)
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
    exact = [whole(row) for row in np.column_stack([A, b]).tolist()]
    in_order = np.argsort(np.arctan2(A[:, 1], A[:, 0]), kind="stable") if n == 2 else range(len(A))
    out = []
    for point in points:
        *x, one = whole((*point, Fraction(1)))
        active = [sum(map(mul, normal, x)) == bound * one for *normal, bound in exact]
        out.append(Corner(point, tuple(int(i) for i in in_order if active[i])))
    return tuple(out)
