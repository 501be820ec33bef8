"""Vertices of planar polytopes in exact arithmetic, counter-clockwise, with the rows that meet there."""

from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from parc_jax.errors import InputError
from parc_jax.sets.hpolytope import HPolytope


class Corner(NamedTuple):
    """A vertex and the rows active at it. point: exact (x, y). rows: indices, sorted by the angle of their normals."""

    point: tuple[Fraction, Fraction]
    rows: tuple[int, ...]


def decimal(value: float) -> Fraction:
    """The number that a certificate spells for a number of the problem: its shortest decimal, exactly.

    0.1 means 1/10. The float nearest to it is another number, and where two rows are almost parallel their corner
    depends on the difference.
    """
    return Fraction(repr(float(value)))


def corners(poly: HPolytope, name: str = "polygon") -> tuple[Corner, ...]:
    """Corners of a bounded planar polytope, counter-clockwise, exact. Raises InputError when empty or unbounded.

    The last few hundred polytopes are remembered.
    """
    if poly.n != 2:
        raise InputError(f"{name}: expected a set in the plane; got {poly.n} dimensions. Only planar workspaces solve.")
    return _corners(poly.A.tobytes(), poly.b.tobytes(), name)


@lru_cache(maxsize=512)
def _corners(rows: bytes, offsets: bytes, name: str) -> tuple[Corner, ...]:
    normals = np.frombuffer(rows).reshape(-1, 2)
    A = [(decimal(x), decimal(y)) for x, y in normals]
    b = [decimal(v) for v in np.frombuffer(offsets)]
    angles = np.arctan2(normals[:, 1], normals[:, 0])
    gaps = np.diff(np.sort(angles), append=np.sort(angles)[0] + 2 * np.pi)
    if len(A) < 3 or gaps.max() >= np.pi - 1e-12:
        raise InputError(f"{name}: expected a bounded set; its rows leave a direction open. Add the missing far side.")
    found: dict[tuple[Fraction, Fraction], set[int]] = {}
    for i, j in combinations(range(len(A)), 2):
        det = A[i][0] * A[j][1] - A[i][1] * A[j][0]
        if det == 0:
            continue
        x = (b[i] * A[j][1] - b[j] * A[i][1]) / det
        y = (A[i][0] * b[j] - A[j][0] * b[i]) / det
        if all(a[0] * x + a[1] * y <= c for a, c in zip(A, b, strict=True)):
            found.setdefault((x, y), set()).update((i, j))
    if not found:
        raise InputError(f"{name}: expected a set with points in it; its rows contradict each other.")
    centre = (sum(v[0] for v in found) / len(found), sum(v[1] for v in found) / len(found))
    order = sorted(found, key=lambda v: float(np.arctan2(float(v[1] - centre[1]), float(v[0] - centre[0]))))
    return tuple(Corner(v, tuple(sorted(found[v], key=lambda i: angles[i]))) for v in order)
