"""Linear algebra over the rationals: one elimination for everything that must come out exact."""

from collections.abc import Sequence
from fractions import Fraction

ZERO = Fraction(0)


class Basis:
    """Independent vectors of Q^n, added one by one.

    Kept is the matrix M with M v = unit vector, another one for each vector v of the basis.
    """

    def __init__(self, n: int):
        self._matrix = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
        self._row_of: list[int] = []  # of each vector of the basis: the 1 of its unit vector

    def __len__(self) -> int:
        return len(self._row_of)

    @property
    def full(self) -> bool:
        """Do the vectors span the whole space?"""
        return len(self) == len(self._matrix)

    def add(self, vector: Sequence[Fraction], least: Fraction = ZERO) -> bool:
        """Add a vector unless it depends on the others; returns whether it was added.

        least: a vector also stays out when its independent part is no longer than this.
        """
        column = _product(self._matrix, vector)
        free = [row for row in range(len(column)) if row not in self._row_of]
        if not free:
            return False
        pivot = max(free, key=lambda row: abs(column[row]))
        if abs(column[pivot]) <= least:
            return False
        self._row_of.append(pivot)
        pivot_row = [entry / column[pivot] for entry in self._matrix[pivot]]
        self._matrix[pivot] = pivot_row
        for row, factor in enumerate(column):
            if row != pivot and factor != 0:
                self._matrix[row] = [
                    entry - factor * other
                    for entry, other in zip(self._matrix[row], pivot_row, strict=True)
                ]
        return True

    def coordinates(self, vector: Sequence[Fraction]) -> list[Fraction] | None:
        """Coefficients c with sum c_i v_i = vector, in order of adding; None outside the span."""
        column = _product(self._matrix, vector)
        if any(column[row] != 0 for row in range(len(column)) if row not in self._row_of):
            return None
        return [column[row] for row in self._row_of]


def _product(matrix, vector) -> list[Fraction]:
    return [sum((m * v for m, v in zip(row, vector, strict=True)), ZERO) for row in matrix]
