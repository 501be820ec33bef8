"""The box of end points z that holds every plan that can reach the goal, with the combinations that
prove it.
"""

import itertools
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import Basis, round_up
from parc_jax.common.spelling import fraction_text, hex_text
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.proof.absence.errors import BinErrors

MOST_COMBINATIONS = 50_000  # bases of goal rows tried per face


def goal_faces(problem: Problem, model: TrajectoryModel) -> tuple[np.ndarray, np.ndarray, list]:
    """Box lo, hi (n_p,) of z and the certificate's `faces`, from the goal shrunken by errors at the
    end that all bins allow.

    Exact: the combination of goal rows is the axis direction, the bound is rounded outward. Where
    the goal leaves no room at all the box is opened up, so that it has a volume; every plan in it
    then misses the goal.
    """
    tube = model.tube
    known = BinErrors(tube, problem.goal.A)
    errors = known.at_end(np.arange(tube.n_bins))
    rows = [[Fraction(v) for v in row] for row in problem.goal.A]
    bounds = []
    for row, end, error in zip(rows, problem.goal.b, errors, strict=True):
        lost = sum(a * Fraction(float(e)) for a, e in zip(row, error, strict=True))
        bounds.append(Fraction(end) - lost)
    lo = np.zeros(model.n_p)
    hi = np.zeros(model.n_p)
    faces = []
    for axis in range(model.n_p):
        pair = []
        for sign, side in ((-1, lo), (1, hi)):
            h, used = _tightest(rows, bounds, axis, sign)
            side[axis] = sign * round_up(h)
            pair.append([goal_entry(known, errors, row, m) for row, m in used])
        faces.append(pair)
        if not lo[axis] < hi[axis]:
            least_hi = hi[axis]
            hi[axis] = lo[axis] + 1.0
            lo[axis] = least_hi - 1.0
    return np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf), faces


def goal_entry(known: BinErrors, errors: np.ndarray, row: int, m: Fraction) -> list:
    """A row of the goal in a certificate, m times; between faces with the error (of all rows,
    `errors`) that violates it.
    """
    named = [hex_text(errors[row])] if known.names_errors else []
    return [row, fraction_text(m), *named]


def _tightest(
    rows: list[list[Fraction]], bounds: Sequence[Fraction], axis: int, sign: int
) -> tuple[Fraction, list[tuple[int, Fraction]]]:
    """Least bound h and multipliers with sum m row = sign * unit vector, from single rows or else
    bases of rows.
    """
    found = []
    for i, row in enumerate(rows):
        if row[axis] * sign > 0 and sum(v != 0 for v in row) == 1:
            found.append((bounds[i] / abs(row[axis]), [(i, 1 / abs(row[axis]))]))
    if not found:
        columns, coupled = _coupled(rows, axis)
        target = [Fraction(sign * (j == axis)) for j in columns]
        choices = itertools.combinations(coupled, len(columns))
        for used in itertools.islice(choices, MOST_COMBINATIONS):
            m = _combination([[rows[i][j] for j in columns] for i in used], target)
            if m is not None and min(m) >= 0:
                pairs = [(i, v) for i, v in zip(used, m, strict=True) if v > 0]
                found.append((sum(v * bounds[i] for i, v in pairs), pairs))
    if not found:
        raise InputError(
            f"goal: expected rows that bound axis {axis}; none of their combinations does. Add a "
            "row."
        )
    return min(found, key=lambda pair: pair[0])


def _coupled(rows: list[list[Fraction]], axis: int) -> tuple[list[int], list[int]]:
    """The coordinates that rows tie to an axis, directly or through others, and those rows."""
    columns = {axis}
    while True:
        tied = [i for i, row in enumerate(rows) if any(row[j] != 0 for j in columns)]
        wider = columns.union(*({j for j, v in enumerate(rows[i]) if v != 0} for i in tied))
        if wider == columns:
            return sorted(columns), tied
        columns = wider


def _combination(rows: list[list[Fraction]], target: list[Fraction]) -> list[Fraction] | None:
    """m with sum m_i rows_i = target for n rows of length n, None when they are dependent."""
    basis = Basis(len(target))
    if not all(basis.add(row) for row in rows):
        return None
    return basis.coordinates(target)
