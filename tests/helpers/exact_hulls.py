"""Exact distance of the origin from the hull of points, by trying every simplex of them; corners of
sets of errors, by trying every corner.
"""

from fractions import Fraction
from itertools import combinations, product

import numpy as np


def squared_distance(points) -> Fraction:
    """Squared distance of the origin from conv(points (n, d)), floats taken as they are."""
    points = list({tuple(Fraction(float(x)) for x in p) for p in points})
    d = len(points[0])
    best = None
    for size in range(1, d + 2):
        for simplex in combinations(points, size):
            foot = _foot(simplex)
            if foot is not None:
                square = sum(x * x for x in foot)
                best = square if best is None else min(best, square)
                if best == 0:
                    return best
    return best


def _foot(simplex):
    """Where the plane of a simplex is nearest to the origin, if that is in the simplex; None for
    points that depend on each other.
    """
    base, *others = simplex
    ways = [[x - y for x, y in zip(p, base, strict=True)] for p in others]
    gram = [[_dot(u, v) for v in ways] for u in ways]
    shares = _solved(gram, [-_dot(base, u) for u in ways])
    if shares is None or any(s < 0 for s in shares) or sum(shares) > 1:
        return None
    return [
        x + sum(s * u[c] for s, u in zip(shares, ways, strict=True)) for c, x in enumerate(base)
    ]


def _dot(u, v):
    return sum(x * y for x, y in zip(u, v, strict=True))


def _solved(A, b):
    """Solution of a small square system in rationals; None where it is singular."""
    rows = [[*row, x] for row, x in zip(A, b, strict=True)]
    n = len(rows)
    for i in range(n):
        pivot = next((j for j in range(i, n) if rows[j][i] != 0), None)
        if pivot is None:
            return None
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(n):
            if j != i:
                rows[j] = [x - rows[j][i] * y for x, y in zip(rows[j], rows[i], strict=True)]
    return [row[-1] for row in rows]


def differences(points, half, vertices):
    """All corners (n, d) of points (i, d) with boxes half (i, d) around them, less vertices."""
    signs = np.array(list(product((-1, 1), repeat=points.shape[1])))
    corners = (points[:, None] + signs[None] * half[:, None]).reshape(-1, points.shape[1])
    return (corners[:, None] - vertices[None]).reshape(-1, points.shape[1])


def corners_between(directions, centre, half):
    """All corners (v, n) of {e: |directions e - centre| <= half}."""
    found = []
    for rows in combinations(range(len(directions)), directions.shape[1]):
        normals = directions[list(rows)]
        if np.linalg.matrix_rank(normals) < len(rows):
            continue
        for signs in product((-1, 1), repeat=len(rows)):
            faces = centre[list(rows)] + np.array(signs) * half[list(rows)]
            found.append(np.linalg.solve(normals, faces))
    found = np.array(found)
    return found[(np.abs(found @ directions.T - centre) <= half + 1e-12).all(axis=1)]
