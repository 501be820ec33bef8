"""Is there a point on one hyperplane strictly inside all others? Decided in rational arithmetic by pivoting.

The last word where float LPs leave a facet open. Least-index criss-cross: no starting point, no tolerance, always ends.
"""

from fractions import Fraction


def meets_strictly(row, others, lo) -> bool:
    """Whether some x >= lo has row(x) = 0 and other(x) < 0 for all others; rows (a, c) stand for a.x + c.

    row: n + 1 rationals. others: list of such. lo: (n,) rationals, a bound that costs no solution.
    """
    # Variables u = x - lo >= 0 and s = 1 - t >= 0; maximise t subject to other(x) + t <= 0, row(x) = 0.
    n = len(lo)
    constraints = [([*a[:n], Fraction(-1)], -_at(a, lo) - 1) for a in others]
    constraints += [([sign * v for v in row[:n]] + [Fraction(0)], -sign * _at(row, lo)) for sign in (1, -1)]
    table = [[Fraction(v) for v in a] + [Fraction(beta)] for a, beta in constraints]
    best = _maximise([Fraction(0)] * n + [Fraction(-1)], table)
    return best is not None and 1 + best > 0


def _at(row, x):
    return sum((Fraction(a) * v for a, v in zip(row, x, strict=False)), Fraction(row[-1]))


def _maximise(cost, table) -> Fraction | None:
    """Maximum of cost.v over {v >= 0, A v <= b}, table rows (A, b); None if infeasible. Bounded by construction."""
    n = len(cost)
    # dictionary: basic = b - A nonbasic, value = z + cost.nonbasic; variables numbered nonbasic first
    objective = [*cost, Fraction(0)]
    outside, inside = list(range(n)), list(range(n, n + len(table)))
    while True:
        wrong = [(v, None, i) for i, v in enumerate(inside) if table[i][n] < 0]
        wrong += [(v, j, None) for j, v in enumerate(outside) if objective[j] > 0]
        if not wrong:
            return objective[n]
        _, column, line = min(wrong, key=lambda item: item[0])
        if column is None:
            candidates = [(v, j) for j, v in enumerate(outside) if table[line][j] < 0]
            if not candidates:
                return None
            column = min(candidates)[1]
        else:
            line = min((v, i) for i, v in enumerate(inside) if table[i][column] > 0)[1]
        _pivot(objective, table, line, column, n)
        outside[column], inside[line] = inside[line], outside[column]


def _pivot(objective, table, line: int, column: int, n: int) -> None:
    """Exchange a basic and a nonbasic variable."""
    pivot = table[line][column]
    row = [v / pivot for v in table[line]]
    row[column] = 1 / pivot
    for i, other in enumerate(table):
        if i != line and other[column]:
            factor = other[column]
            table[i] = [v - factor * r for v, r in zip(other, row, strict=True)]
            table[i][column] = -factor / pivot
    factor = objective[column]
    if factor:
        for j in range(n):
            objective[j] -= factor * row[j]
        objective[column] = -factor / pivot
        objective[n] += factor * row[n]
    table[line] = row
