"""Polytopes of a few dozen rows in exact rationals: vertices, support, in the plane hull, area."""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import combinations
from operator import mul

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope

Point = tuple[Fraction, ...]
Row = tuple[int, ...]  # a normal and its offset, as whole numbers

FAR = 10**100  # [m] a set with no point nearer than this is taken for empty


def rational_vertices(p: HPolytope, name: str = "rational_vertices") -> list[Point]:
    """Vertices of {A x <= b} in the plane, counter-clockwise, or in space, sorted; exact for the
    floats A and b as they are.

    An empty set gives [], a single point one vertex, a segment two. Raises InputError, which begins
    with `name`, if it is unbounded.
    """
    if p.n not in (2, 3):
        raise InputError(f"{name}: expected a set in the plane or in space; got {p.n} dimensions.")
    rows = [whole(row) for row in np.column_stack([p.A, p.b]).tolist()]
    if any(row[-1] < 0 and not any(row[:-1]) for row in rows):
        return []  # a row 0 <= b with b < 0
    rows = [row for row in rows if any(row[:-1])]
    corners = _in_plane if p.n == 2 else _in_space
    found = corners(rows)
    eye = np.eye(p.n, dtype=int).tolist()
    far = [(*(sign * x for x in axis), FAR) for axis in eye for sign in (-1, 1)]
    if _is_open(rows, p.n) and (found or corners([*rows, *far])):
        raise unbounded(name)
    return convex_polygon(list(found)) if p.n == 2 else sorted(found)


def _in_plane(rows: list[Row]) -> set[Point]:
    """Points where two lines meet, inside of all rows."""
    found = set()
    for (a, c, e), (f, g, h) in combinations(rows, 2):
        det = a * g - c * f
        if det == 0:
            continue
        sign = 1 if det > 0 else -1
        x, y, det = sign * (e * g - c * h), sign * (a * h - e * f), sign * det
        if all(u * x + v * y <= w * det for u, v, w in rows):
            found.add((Fraction(x, det), Fraction(y, det)))
    return found


def _in_space(rows: list[Row]) -> set[Point]:
    """Points where three planes meet, inside of all rows."""
    found = set()
    for i, j, k in combinations(rows, 3):
        across = _cross(j, k), _cross(k, i), _cross(i, j)
        if (det := _dot(i, across[0])) == 0:  # they have no point in common, or many
            continue
        sign = 1 if det > 0 else -1
        bounds = [sign * row[3] for row in (i, j, k)]
        point, det = [_dot(bounds, axis) for axis in zip(*across, strict=True)], sign * det
        if all(_dot(row, point) <= row[3] * det for row in rows):
            found.add(tuple(Fraction(x, det) for x in point))
    return found


def _is_open(rows: list[Row], n: int) -> bool:
    """Is there d != 0 with A d <= 0? The extreme ones are perpendicular to a row, in space to two;
    where no rows are, or all are parallel, there is one.
    """
    if n == 2:
        rays = [(-c, a, 0) for a, c, _ in rows]
    else:
        rays = [ray for i, j in combinations(rows, 2) if any(ray := _cross(i, j))]
    heights = ([sum(map(mul, row[:n], ray)) for row in rows] for ray in rays)
    return not rays or any(max(along) <= 0 or min(along) >= 0 for along in heights)


def convex_polygon(points: list[Point]) -> list[Point]:
    """Hull, counter-clockwise from lowest-leftmost, without collinear ones (Andrew's chain)."""
    points = list(set(points))
    scaled = whole(x for point in points for x in point)
    named = dict(zip(zip(scaled[::2], scaled[1::2], strict=True), points, strict=True))
    in_order = sorted(named)
    if len(in_order) <= 2:
        return [named[q] for q in in_order]
    chains = []
    for sequence in (in_order, in_order[::-1]):
        chain: list[tuple[int, ...]] = []
        for q in sequence:
            while len(chain) >= 2 and _turn(chain[-2], chain[-1], q) <= 0:
                chain.pop()
            chain.append(q)
        chains.append(chain[:-1])
    return [named[q] for chain in chains for q in chain]


def whole(values: Iterable[float | Fraction]) -> tuple[int, ...]:
    """All values times their common denominator: products of these need no common divisors."""
    ratios = [value.as_integer_ratio() for value in values]
    scale = math.lcm(*(below for _, below in ratios))
    return tuple(above * (scale // below) for above, below in ratios)


def exact_support(vertices: list[Point], w: np.ndarray) -> Fraction:
    """max w.v over the vertices, w (n,) floats read as rationals."""
    exact = [Fraction(float(entry)) for entry in w]
    return max(sum(a * x for a, x in zip(exact, v, strict=True)) for v in vertices)


def area(vertices: list[Point]) -> Fraction:
    """Area of a counter-clockwise polygon (shoelace); 0 for fewer than three vertices."""
    pairs = zip(vertices, vertices[1:] + vertices[:1], strict=True)
    return sum((x * v - u * y for (x, y), (u, v) in pairs), Fraction(0)) / 2


def _turn(a: tuple[int, ...], b: tuple[int, ...], c: tuple[int, ...]) -> int:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _cross(u: Row, v: Row) -> Row:
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def _dot(u: Sequence[int], v: Sequence[int]) -> int:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def unbounded(name: str) -> InputError:
    """Why a set whose rows leave a direction open is refused."""
    return InputError(
        f"{name}: expected a bounded set; its rows leave a direction open. Add the missing far "
        "side."
    )
