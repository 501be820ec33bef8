"""Errors of the points of a mixture with which a contact is sought: some to try, and those that go
farthest towards a place. [T35]

The mixture errs by the same mixture of the errors of its points. Half widths tell their corners at
once. Between faces, corners lie along many directions, and mixtures of these are errors again.
"""

import itertools
from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np

from parc_jax.learning.bound.error_set import ErrorTemplate, at

INSIDE = 2.0**-30  # corners are pulled towards their middle by this share
ONE = 1e3  # [largest coordinate] weight of "the shares sum to one" in least squares


class WithinWidths:
    """Errors of points with half widths half (i, n_p), mixed by weights (i,).

    candidates: (c, i, n_p) none, and the corners and middles of the box of errors.
    """

    def __init__(self, half: np.ndarray, weights: np.ndarray):
        self.half = half
        self.weights = weights
        signs = itertools.product((0.0, 1.0, -1.0), repeat=half.shape[1])
        self.candidates = np.array(list(signs))[:, None] * half

    def towards(self, way: np.ndarray) -> np.ndarray:
        """(m, i, n_p) errors whose mixtures are nearest to way (m, n_p): each point errs by the
        same share of what it may.
        """
        mixed = self.weights @ self.half
        share = np.divide(way, mixed, out=np.zeros_like(way), where=mixed > 0)
        return np.clip(share, -1, 1)[:, None] * self.half

    def admits(self, errors: np.ndarray) -> bool:
        """Whether these errors (i, n_p) are exactly among them: all that are named here are."""
        return bool((np.abs(errors) <= self.half).all())


class BetweenFaces:
    """Errors of points between faces (i,), mixed by weights (i,). rows: of each point, exact rows
    (a, b) with a . e <= b.

    candidates: (c, i, n_p) none, and corners that are farthest along one direction each.
    """

    def __init__(self, errors: ErrorTemplate, rows: list, weights: np.ndarray):
        self.weights = weights
        self._rows = rows
        normals = {tuple(map(float, a)) for of_point in rows for a, _ in of_point}
        ways = corner_ways(np.array(sorted(normals)))
        corners = np.moveaxis(at(errors, np.s_[:, None]).vertex(ways), 0, 1)
        middle = corners.mean(axis=0)
        pulled = corners + INSIDE * (middle - corners)
        self.candidates = np.concatenate([np.zeros_like(pulled[:1]), pulled])
        self._mixed = np.einsum("i,cij->cj", weights, self.candidates)

    def towards(self, way: np.ndarray) -> np.ndarray:
        """(m, i, n_p) errors whose mixtures are nearest to way (m, n_p), about: mixtures of the
        candidates by least squares.
        """
        from scipy.optimize import nnls  # heavy to load, and seldom needed

        size = ONE * max(float(np.abs(self._mixed).max()), np.finfo(float).tiny)
        system = np.vstack([self._mixed.T, np.full(len(self._mixed), size)])
        shares = np.array([nnls(system, np.append(x, size))[0] for x in way])
        shares /= shares.sum(axis=1, keepdims=True)
        return np.einsum("mc,cij->mij", shares, self.candidates)

    def admits(self, errors: np.ndarray) -> bool:
        """Whether these errors (i, n_p) are exactly among them."""
        return all(holds(rows, error) for error, rows in zip(errors, self._rows, strict=True))


ContactErrors = WithinWidths | BetweenFaces


def holds(rows: Iterable[tuple[Sequence[Fraction], Fraction]], error: np.ndarray) -> bool:
    """Whether a . error <= b for all rows (a, b), exactly."""
    exact = [Fraction(float(x)) for x in error]
    return all(sum(x * y for x, y in zip(a, exact, strict=True)) <= b for a, b in rows)


def corner_ways(normals: np.ndarray) -> np.ndarray:
    """Directions (d, n_p) along which corners are sought of sets with these normals (r, n_p). In
    the plane, sums of neighbours: they tell every corner. In space the normals themselves, and
    those of a cube with its edges and corners cut off.
    """
    n = normals.shape[1]
    unit = normals / np.linalg.norm(normals, axis=1)[:, None]
    if n == 2:
        unit = unit[np.argsort(np.arctan2(unit[:, 1], unit[:, 0]))]
        return unit + np.roll(unit, -1, axis=0)
    cube = np.array([s for s in itertools.product((0.0, 1.0, -1.0), repeat=n) if any(s)])
    return np.concatenate([unit, cube])
