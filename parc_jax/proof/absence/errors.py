"""Errors of the tube as absence proofs need them: of each bin, and at each place of contact.

Errors of the points of a mixture with which a contact is sought: some to try, and those that go
farthest towards a place. [T35]

The mixture errs by the same mixture of the errors of its points. Half widths give their corners at
once. Between faces, corners lie along many directions, and mixtures of these are errors again.

The errors that all bins allow which a box of k overlaps. [T30, T35]

Boxes allow together the box of their least half widths. Between faces, one bin allows its template
and several at least a box that lies in all of them: for the last bit a box of k is split until it
lies in one bin.
"""

import itertools
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.common.spelling import fraction_text, hex_text
from parc_jax.learning.bound.error_set import ErrorBox, ErrorSet, ErrorTemplate, Templates, at
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.predict import by_point

TOWARDS_MIDDLE = 2.0**-30  # corners are pulled towards their middle by this share
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
        pulled = corners + TOWARDS_MIDDLE * (middle - corners)
        self.candidates = np.concatenate([np.zeros_like(pulled[:1]), pulled])
        self._mixed = np.einsum("i,cij->cj", weights, self.candidates)

    def towards(self, way: np.ndarray) -> np.ndarray:
        """(m, i, n_p) errors with mixtures nearest to way (m, n_p), about, by least squares."""
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
    the plane, sums of neighbours: they reach every corner. In space the normals themselves, and
    those of a cube with its edges and corners cut off.
    """
    n = normals.shape[1]
    unit = normals / np.linalg.norm(normals, axis=1)[:, None]
    if n == 2:
        unit = unit[np.argsort(np.arctan2(unit[:, 1], unit[:, 0]))]
        return unit + np.roll(unit, -1, axis=0)
    cube = np.array([s for s in itertools.product((0.0, 1.0, -1.0), repeat=n) if any(s)])
    return np.concatenate([unit, cube])


INSIDE = 1 - 2.0**-30  # an error at the end is pulled towards none by this factor


class OverBins(NamedTuple):
    """The bins (b,) that a box of k overlaps with its interior, None in a batch, and their errors.

    straddles: (n_k,) 1.0 for several bins along this axis, else 0.0.
    common: errors that all of them allow; leading axes (T, n_points).
    blur: (T, n_c) by how much their widths differ, about.
    goal_least, goal_most: (g,) loss of the rows of the goal by errors at the end that all of them
        allow, and that any of them does.
    """

    bins: np.ndarray | None
    straddles: np.ndarray
    common: ErrorSet
    blur: np.ndarray
    goal_least: np.ndarray
    goal_most: np.ndarray


def bins_over(tube: Tube, lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (b,) of the bins that the interior of a box of k meets; axes (n_k,) with several."""
    number = np.zeros(1, int)
    straddles = []
    for edge, a, b in zip(tube.edges, lo, hi, strict=True):
        inside = np.flatnonzero((edge[:-1] < b) & (a < edge[1:]))
        straddles.append(len(inside) > 1)
        number = (number[:, None] * (len(edge) - 1) + inside[None]).ravel()
    return number, np.array(straddles, float)


class BinErrors:
    """The errors of a tube over boxes of k, for a goal with rows goal_A (g, n_c + n_q)."""

    def __init__(self, tube: Tube, goal_A: np.ndarray):
        self.tube = tube
        self.templates = tube.templates
        self.goal_A = goal_A
        # half widths that every bin allows, and those that none exceeds
        self._widest, final = tube.finite_widths
        self._inner, self._widest_at_end = self._widest, final
        if self.templates is not None:
            inner, final = (faces.inner_box for faces in self.templates)
            self._inner = inner.reshape(*inner.shape[:2], -1)
            errors = self.templates.final.errors
            self._goal_most = np.stack([errors.support(a) for a in goal_A], axis=1)
        # the end satisfies the final ones and, in its positions, those of the last interval [T30]
        last = self._inner[..., -1, :]
        positions, others = np.split(final, [last.shape[-1]], axis=-1)
        self._inner_at_end = np.concatenate([np.minimum(positions, last), others], axis=-1)
        self._farthest: dict[int, np.ndarray] = {}  # by bin: linear programs are slow

    def over(self, lo: np.ndarray, hi: np.ndarray) -> OverBins:
        """The bins and errors of a box of k."""
        bins, straddles = bins_over(self.tube, lo, hi)
        least = self._inner[bins].min(axis=0)
        common: ErrorSet = ErrorBox(by_point(least, self.tube.n_points))
        if self.templates is None:
            goal_most = np.abs(self.goal_A) @ self._widest_at_end[bins].max(axis=0)
        else:
            goal_most = self._goal_most[bins].max(axis=0)
            if len(bins) == 1:  # what several templates share is known by a box in them alone
                common = at(self.templates.interval.errors, int(bins[0]))
        blur = self._widest[bins].max(axis=0) - least
        goal_least = (self.at_end(bins) * self.goal_A).sum(axis=1)
        return OverBins(bins, straddles, common, blur, goal_least, goal_most)

    def at_end(self, bins: np.ndarray) -> np.ndarray:
        """(g, n_c + n_q) for every row of the goal, an error that all bins allow at the end by
        which it loses most, or at least much.
        """
        if self.templates is None or len(bins) > 1:
            return np.sign(self.goal_A) * self._inner_at_end[bins].min(axis=0)
        bin = int(bins[0])
        if bin not in self._farthest:
            self._farthest[bin] = self._farthest_of(bin, self.templates)
        return self._farthest[bin]

    def goal_entry(self, errors: np.ndarray, row: int, m: Fraction) -> list:
        """A row of the goal in a certificate, m times; between faces with the error (of all rows,
        `errors`) that violates it: of boxes the checker finds it by itself.
        """
        named = [] if self.templates is None else [hex_text(errors[row])]
        return [row, fraction_text(m), *named]

    def of_contact(
        self, over: OverBins, t: int, points: list[int], weights: Float[np.ndarray, " i"]
    ) -> ContactErrors:
        """The errors that all bins allow a mixture of points during interval t."""
        if self.templates is None or isinstance(over.common, ErrorBox):
            return WithinWidths(over.common.half[t][points], weights)
        rows = [self.templates.interval.rows((over.bins[0], t, i)) for i in points]
        return BetweenFaces(at(over.common, (t, points)), rows, weights)

    def _farthest_of(self, bin: int, templates: Templates) -> np.ndarray:
        """Errors at the end of one bin, where the result of a linear program is exactly an error of
        both the end and the last interval.
        """
        from scipy.optimize import linprog  # heavy to load, and seldom needed

        found = np.sign(self.goal_A) * self._inner_at_end[bin]
        if not self.tube.claimed[bin]:
            return found
        rows = end_rows(templates, bin)
        A = np.array([[float(x) for x in a] for a, _ in rows])
        b = np.array([float(x) for _, x in rows])
        for row, a in enumerate(self.goal_A):
            if not a.any():
                continue
            best = linprog(-a, A_ub=A, b_ub=b, bounds=(None, None))
            if best.status == 0:
                error = INSIDE * best.x
                if a @ error > a @ found[row] and holds(rows, error):
                    found[row] = error
        return found


def end_rows(templates: Templates, bin: int) -> list[tuple[list[Fraction], Fraction]]:
    """Exact rows (a, b), a . e <= b, of the errors that a bin allows at the end: those of the end,
    and for each point those of the last interval. [T35]
    """
    during, final = templates
    rows = final.rows(bin)
    n_steps, n_points = during.half.shape[1:3]
    n_p, n_end = during.directions.shape[-1], final.directions.shape[-1]
    for i in range(n_points):
        for a, b in during.rows((bin, n_steps - 1, i)):
            wide = [Fraction(0)] * n_end
            wide[i * n_p : (i + 1) * n_p] = a
            rows.append((wide, b))
    return rows


def as_template(errors: ErrorSet, n_bases: int) -> ErrorTemplate:
    """The same errors as a template of so many bases, for a batch of boxes of one shape."""
    if isinstance(errors, ErrorTemplate):
        return errors
    *lead, n = errors.half.shape
    half = np.full((*lead, n_bases, n), np.inf)
    half[..., 0, :] = errors.half
    dual = np.broadcast_to(np.eye(n), (*lead, n_bases, n, n))
    return ErrorTemplate(dual, np.zeros_like(half), half)
