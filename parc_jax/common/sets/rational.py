"""Polytopes of a few dozen rows in exact rationals: vertices, support, in the plane hull, area."""

import math
from collections.abc import Iterable
from fractions import Fraction
from itertools import combinations

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope

Point = tuple[Fraction, ...]
Row = tuple[Point, Fraction]  # a normal and its offset

# [of unit normals] Floats leave a triple of rows out only where they are sure: it is this far from
# dependent, and its point violates a row by this share of its size. Their own errors are 1e-9 then.
SURE = 1e-6
FAR = 10**100  # [m] a set with no point nearer than this is taken for empty


def rational_vertices(p: HPolytope, name: str = "rational_vertices") -> list[Point]:
    """Vertices of {A x <= b} in the plane, counter-clockwise, or in space, sorted; exact for the
    floats A and b as they are.

    An empty set gives [], a single point one vertex, a segment two. Raises InputError, which begins
    with `name`, if it is unbounded.
    """
    if p.n not in (2, 3):
        raise InputError(f"{name}: expected a set in the plane or in space; got {p.n} dimensions.")
    return _in_plane(p, name) if p.n == 2 else _in_space(p, name)


def _in_plane(p: HPolytope, name: str) -> list[Point]:
    rows = [whole(row) for row in np.column_stack([p.A, p.b]).tolist()]
    rows = [row for row in rows if row[0] or row[1] or row[2] < 0]
    if any(not (a or c) for a, c, _ in rows):
        return []  # a row 0 <= b with b < 0
    found = _corners(rows)
    # extreme directions d with A d <= 0 are perpendicular to a row
    rays = [ray for a, c, _ in rows for ray in ((-c, a), (c, -a))]
    open_ = [(x, y) for x, y in rays if all(u * x + v * y <= 0 for u, v, _ in rows)]
    far = [(a, c, FAR) for a, c in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    if (open_ or not rows) and (found or _corners([*rows, *far])):
        raise unbounded(name)
    return convex_polygon(list(found))


def _corners(rows: list[tuple[int, ...]]) -> set[Point]:
    """Points where two lines meet, inside of all rows (a, c, e): a x + c y <= e."""
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


def _in_space(p: HPolytope, name: str) -> list[Point]:
    told = zip(p.A.tolist(), p.b.tolist(), strict=True)
    rows = [(tuple(map(Fraction, a)), Fraction(b)) for a, b in told]
    if any(not any(a) and b < 0 for a, b in rows):
        return []  # a row 0 <= b with b < 0
    rows = [(a, b) for a, b in rows if any(a)]
    found = _vertices(rows)
    eye = np.eye(3, dtype=int).tolist()
    far = [(tuple(Fraction(s * x) for x in e), Fraction(FAR)) for e in eye for s in (-1, 1)]
    if _is_open(rows) and (found or _vertices([*rows, *far])):
        raise unbounded(name)
    return found


def _vertices(rows: list[Row]) -> list[Point]:
    found = set()
    for triple in _likely_triples(rows):
        (i, b_i), (j, b_j), (k, b_k) = (rows[n] for n in triple)
        across = _cross(j, k), _cross(k, i), _cross(i, j)
        if (volume := _dot(i, across[0])) != 0:  # else the planes have no point in common, or many
            of_axes = zip(*across, strict=True)
            point = tuple(_dot((b_i, b_j, b_k), axis) / volume for axis in of_axes)
            found |= {point} if all(_dot(a, point) <= b for a, b in rows) else set()
    return sorted(found)


def _likely_triples(rows: list[Row]) -> np.ndarray:
    """Triples of rows whose point may be a vertex: floats leave most of the others out."""
    triples = np.array(list(combinations(range(len(rows)), 3)), int).reshape(-1, 3)
    A, b = _unit_rows(rows)
    i, j, k = A[triples].transpose(1, 0, 2)
    b_i, b_j, b_k = b[triples].T[:, :, None]
    across = np.cross(j, k)
    volume = (i * across).sum(axis=1)
    sure = np.abs(volume) > SURE
    points = b_i * across + b_j * np.cross(k, i) + b_k * np.cross(i, j)
    points = points / np.where(sure, volume, 1)[:, None]
    size = np.abs(points).max(axis=1, initial=0.0)[:, None] + np.abs(b)[None]
    outside = (points @ A.T > b[None] + SURE * size).any(axis=1)
    return triples[~(sure & outside)]


def _is_open(rows: list[Row]) -> bool:
    """Is there d != 0 with A d <= 0? The extreme ones are perpendicular to two rows."""
    normals = [a for a, _ in rows]
    A, _ = _unit_rows(rows)
    parallel = True
    for i, j in combinations(range(len(rows)), 2):
        ray = _cross(normals[i], normals[j])
        if not any(ray):
            continue
        parallel = False
        across = np.cross(A[i], A[j])
        steepest = A @ across
        sure = SURE * np.linalg.norm(across) + SURE**2
        if steepest.max() > sure and steepest.min() < -sure:
            continue
        along = [_dot(a, ray) for a in normals]
        if all(x <= 0 for x in along) or all(x >= 0 for x in along):
            return True
    return parallel


def _unit_rows(rows: list[Row]) -> tuple[np.ndarray, np.ndarray]:
    """A, b in floats, the normals at length one."""
    A = np.array([[float(x) for x in a] for a, _ in rows]).reshape(-1, 3)
    size = np.linalg.norm(A, axis=1)
    return A / size[:, None], np.array([float(b) for _, b in rows]) / size


def _cross(u, v) -> Point:
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def _dot(u, v) -> Fraction:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def unbounded(name: str) -> InputError:
    """Why a set whose rows leave a direction open is refused."""
    return InputError(
        f"{name}: expected a bounded set; its rows leave a direction open. Add the missing far "
        "side."
    )
