"""Which points are inside which pieces: one compiled test over (point, piece) pairs of equal cells."""

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import on_all_cores, x64
from parc_jax.avoid.segment import dot2
from parc_jax.certify.draw import groups

CHUNK = 1024  # pairs per compiled call
PIECES = (32, 128, CHUNK)  # padded numbers of pieces in one call


def inside(path, w, need):
    """path (T + 1, 2), w (o, T, 2), need (o, T) -> bool: w . p > need at both ends of every interval. Kernel."""
    start, end = dot2(w, path[None, :-1]), dot2(w, path[None, 1:])
    return (jnp.minimum(start, end) > need).all()


_inside_pairs = jax.jit(lambda path, w, need, of: jax.vmap(inside)(path, w[of], need[of]))


def pairs_of_cells(cells: np.ndarray, by_cell: dict[bytes, list[int]]) -> tuple[np.ndarray, np.ndarray]:
    """All pairs (point, number) where the numbers are what `by_cell` lists for the point's cell (b,)."""
    at, of = [np.zeros(0, int)], [np.zeros(0, int)]
    for cell, index in groups(cells):
        numbers = by_cell.get(cell, ())
        at.append(np.repeat(index, len(numbers)))
        of.append(np.tile(np.array(numbers, int), len(index)))
    return np.concatenate(at), np.concatenate(of)


def inside_pairs(path, w, need, at, of) -> np.ndarray:
    """Pairs: point at[i] of path (b, T + 1, 2) in piece of[i] of w (n, o, T, 2), need (n, o, T) -> bool (pairs,)."""

    order = np.argsort(of, kind="stable")  # few pieces per call, so that little is copied

    def some(rows):
        pieces, whose = np.unique(of[rows], return_inverse=True)
        size = next(n for n in PIECES if n >= len(pieces))
        padded = np.resize(pieces, size)
        with x64():
            found = _inside_pairs(path[np.resize(at[rows], CHUNK)], w[padded], need[padded], np.resize(whose, CHUNK))
        return np.asarray(found)[: len(rows)]

    parts = [order[first : first + CHUNK] for first in range(0, len(at), CHUNK)]
    out = np.zeros(len(at), bool)
    for rows, found in zip(parts, on_all_cores(some, parts), strict=True):
        out[rows] = found
    return out
