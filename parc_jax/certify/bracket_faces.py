"""The box of end points z that holds every plan that can reach the goal, with the combinations that prove it."""

import itertools
from fractions import Fraction

import numpy as np

from parc_jax.avoid.polygon import decimal
from parc_jax.errors import InputError
from parc_jax.lp.exact import round_up
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

MOST_COMBINATIONS = 50_000  # bases of goal rows looked through per face


def goal_faces(problem: ReachAvoid, model: TrajectoryModel) -> tuple[np.ndarray, np.ndarray, list]:
    """Box lo, hi (n_p,) of z and the certificate's `faces`, from the goal shrunken by the least final widths.

    Exact: the combination of goal rows is the axis direction, the bound is rounded outward. Where the goal leaves no
    room at all the box is opened up, so that it has a volume; every plan in it then misses the goal.
    """
    least = [Fraction(float(e)) for e in model.tube.finite_widths[1].min(axis=0)]
    rows = [[decimal(v) for v in row] for row in problem.goal.A]
    ends = [decimal(v) for v in problem.goal.b]
    bounds = [b - sum(abs(a) * e for a, e in zip(row, least, strict=True)) for row, b in zip(rows, ends, strict=True)]
    lo, hi, faces = np.zeros(model.n_p), np.zeros(model.n_p), []
    for axis in range(model.n_p):
        pair = []
        for sign, side in ((-1, lo), (1, hi)):
            h, used = _tightest(rows, bounds, axis, sign)
            side[axis] = sign * round_up(h)
            pair.append([[row, str(m)] for row, m in used])
        faces.append(pair)
        if not lo[axis] < hi[axis]:
            lo[axis], hi[axis] = hi[axis] - 1.0, lo[axis] + 1.0
    return np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf), faces


def _tightest(rows, bounds, axis: int, sign: int) -> tuple[Fraction, list[tuple[int, Fraction]]]:
    """Least bound h and multipliers with sum m row = sign * unit vector, from single rows or else bases of rows."""
    n = len(rows[0])
    target = [Fraction(sign * (j == axis)) for j in range(n)]
    single = [i for i, row in enumerate(rows) if row[axis] * sign > 0 and sum(v != 0 for v in row) == 1]
    found = [(bounds[i] / abs(rows[i][axis]), [(i, 1 / abs(rows[i][axis]))]) for i in single]
    if not found:
        for used in itertools.islice(itertools.combinations(range(len(rows)), n), MOST_COMBINATIONS):
            m = _solve([[rows[i][j] for i in used] for j in range(n)], target)
            if m is not None and min(m) >= 0:
                pairs = [(i, v) for i, v in zip(used, m, strict=True) if v > 0]
                found.append((sum(v * bounds[i] for i, v in pairs), pairs))
    if not found:
        raise InputError(f"goal: expected rows that bound axis {axis}; none of their combinations does. Add a row.")
    return min(found, key=lambda pair: pair[0])


def _solve(M, target) -> list[Fraction] | None:
    """x with M x = target for a square matrix of fractions, None when it is singular."""
    rows = [[*row, t] for row, t in zip(M, target, strict=True)]
    for c in range(len(rows)):
        pivot = next((r for r in range(c, len(rows)) if rows[r][c] != 0), None)
        if pivot is None:
            return None
        rows[c], rows[pivot] = rows[pivot], rows[c]
        rows[c] = [v / rows[c][c] for v in rows[c]]
        for r in range(len(rows)):
            if r != c and rows[r][c] != 0:
                rows[r] = [v - rows[r][c] * p for v, p in zip(rows[r], rows[c], strict=True)]
    return [row[-1] for row in rows]
