"""Templates of a tube as certificates: the exact rows of their faces, and for the end, which has
too many axes for the checker to search, multipliers that give each row of a goal. [T26]
"""

from fractions import Fraction

from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import fraction_text
from parc_jax.learning.bound.error_set import Faces


def rows_part(faces: Faces, index) -> dict:
    """One set of errors, a . e <= b for all rows."""
    rows = faces.rows(index)
    return {"A": fraction_text([a for a, _ in rows]), "b": fraction_text([b for _, b in rows])}


def end_part(faces: Faces, index, goal: HPolytope) -> dict:
    """The same for the end, with the ways in which rows of its frames give each row of a goal."""
    frames = _inverse_frames(faces.directions[index])
    ways = []
    for a in goal.A:
        exact = [Fraction(x) for x in a]
        ways.append([_way(exact, inverse, first) for first, inverse in frames])
    return rows_part(faces, index) | {"goal": ways}


def _way(a: list[Fraction], inverse: list[list[Fraction]], first: int) -> list:
    """Multipliers [[row, "m"], ...], of one frame's faces, that give a. Row 2 j is the upper face
    of direction j, 2 j + 1 the lower one.
    """
    way = []
    for j, column in enumerate(zip(*inverse, strict=True), first):
        share = sum(x * y for x, y in zip(a, column, strict=True))
        if share:
            way.append([2 * j + int(share < 0), fraction_text(abs(share))])
    return way


def _inverse_frames(directions) -> list[tuple[int, list[list[Fraction]]]]:
    """(number of its first direction, inverse) of every n directions that span; directions (R,
    n).
    """
    n_rows, n = directions.shape
    frames = []
    for first in range(0, n_rows - n_rows % n, n):
        inverse = _inverse([[Fraction(x) for x in u] for u in directions[first : first + n]])
        if inverse is not None:
            frames.append((first, inverse))
    return frames


def _inverse(rows: list[list[Fraction]]) -> list[list[Fraction]] | None:
    """The inverse of a square matrix by elimination; None if there is none."""
    n = len(rows)
    table = [row + [Fraction(int(i == j)) for j in range(n)] for i, row in enumerate(rows)]
    for i in range(n):
        pivot = next((r for r in range(i, n) if table[r][i]), None)
        if pivot is None:
            return None
        table[i], table[pivot] = table[pivot], table[i]
        table[i] = [x / table[i][i] for x in table[i]]
        for r in range(n):
            if r != i and table[r][i]:
                share = table[r][i]
                table[r] = [x - share * y for x, y in zip(table[r], table[i], strict=True)]
    return [row[n:] for row in table]
