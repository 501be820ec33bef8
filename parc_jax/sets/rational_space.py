"""Vertices of polytopes in space in exact rational arithmetic. For sets of a few dozen rows."""

from fractions import Fraction
from itertools import combinations

import numpy as np

from parc_jax.errors import InputError
from parc_jax.sets.hpolytope import HPolytope

Row = tuple[tuple[Fraction, ...], Fraction]  # a normal and its offset

# [of unit normals] Floats leave a triple of rows out only where they are sure: it is this far from
# dependent, and its point violates a row by this share of its size. Their own errors are 1e-9 then.
SURE = 1e-6
FAR = 10**100  # [m] a set with no point nearer than this is taken for empty


def vertices_in_space(p: HPolytope, name: str) -> list[tuple[Fraction, ...]]:
    """Vertices of {A x <= b} in space, sorted, exact for the floats A and b as they are.

    An empty set gives []. Raises InputError, which begins with `name`, if it is unbounded.
    """
    rows = [
        (tuple(map(Fraction, a)), Fraction(b))
        for a, b in zip(p.A.tolist(), p.b.tolist(), strict=True)
    ]
    if any(not any(a) and b < 0 for a, b in rows):
        return []  # a row 0 <= b with b < 0
    rows = [(a, b) for a, b in rows if any(a)]
    found = _vertices(rows)
    if _is_unbounded(rows) and (found or _vertices([*rows, *_far_box()])):
        raise InputError(
            f"{name}: expected a bounded set; its rows leave a direction open. Add the missing far "
            "side."
        )
    return found


def _vertices(rows: list[Row]) -> list[tuple[Fraction, ...]]:
    found = set()
    for triple in _likely_triples(rows):
        point = _meet(*(rows[i] for i in triple))
        if point is not None and all(_dot(a, point) <= b for a, b in rows):
            found.add(point)
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


def _meet(*rows: Row) -> tuple[Fraction, ...] | None:
    """The one point of three planes; None where they have none or many."""
    (i, b_i), (j, b_j), (k, b_k) = rows
    across = _cross(j, k), _cross(k, i), _cross(i, j)
    volume = _dot(i, across[0])
    if volume == 0:
        return None
    return tuple(_dot((b_i, b_j, b_k), axis) / volume for axis in zip(*across, strict=True))


def _is_unbounded(rows: list[Row]) -> bool:
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


def _far_box() -> list[Row]:
    signs = (-1, 1)
    return [
        (tuple(Fraction(s * (i == axis)) for i in range(3)), Fraction(FAR))
        for axis in range(3)
        for s in signs
    ]


def _cross(u, v) -> tuple[Fraction, ...]:
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def _dot(u, v) -> Fraction:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
