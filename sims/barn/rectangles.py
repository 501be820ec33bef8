"""Cells as few rectangles: obstacles that planes bound, which hold all cylinders of a world."""

import numpy as np

from sims.barn.worlds import CELL

GROW = 1e-9  # [m] outwards, for the rounding of places; obstacles grow


def rectangles(occupied: np.ndarray) -> np.ndarray:
    """Rectangles (r, 4) [m], x and y from, x and y to, whose union is the occupied cells (30, 64),
    grown by GROW. They may overlap.

    Greedy: for the first cell that none holds yet, the rectangle of occupied cells around it that
    holds most of those.
    """
    left = occupied.copy()
    found = []
    while left.any():
        a, b = np.argwhere(left)[0]
        rectangle = _best(occupied, left, int(a), int(b))
        a0, a1, b0, b1 = rectangle
        left[a0:a1, b0:b1] = False
        found.append(rectangle)
    return placed(np.array(found, int).reshape(-1, 4))


def placed(cells: np.ndarray) -> np.ndarray:
    """Where rectangles of cells (r, 4), rows from and to, columns from and to, lie [m]: (r, 4)."""
    a0, a1, b0, b1 = cells.T
    lo = np.stack([-CELL * a1, CELL * b0], axis=1) - GROW
    hi = np.stack([-CELL * a0, CELL * b1], axis=1) + GROW
    return np.concatenate([lo, hi], axis=1)


def _best(occupied: np.ndarray, left: np.ndarray, a: int, b: int) -> tuple[int, int, int, int]:
    """The rectangle around cell (a, b) with most cells that are left: rows and columns from, to."""
    tops = _reach(occupied[:, b], a)
    best, most = (a, a + 1, b, b + 1), 0
    for a0 in range(tops[0], a + 1):
        for a1 in range(a + 1, tops[1] + 1):
            b0, b1 = _reach(occupied[a0:a1].all(axis=0), b)
            held = int(left[a0:a1, b0:b1].sum())
            if held > most:
                best, most = (a0, a1, b0, b1), held
    return best


def _reach(line: np.ndarray, i: int) -> tuple[int, int]:
    """The stretch of true cells around i: from, to."""
    gaps = np.flatnonzero(~line)
    below, above = gaps[gaps < i], gaps[gaps > i]
    return (int(below[-1]) + 1 if len(below) else 0, int(above[0]) if len(above) else len(line))
