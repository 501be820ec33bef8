"""Volumes of all cells at once, by pyramids over the face lattice.

A k-face F with a vertex c is the union of the pyramids from c over its facets G, so its k-vector (volume times unit
k-vector) is M(F) = (1/k) sum_G +-(p_G - c) ^ M(G) with p_G any point of G; all terms are parallel, and the signs are those
that make them point the same way. For k = n the k-vector is a number and vol(F) = (1/n) sum_G |(p_G - c) ^ M(G)|.
Each face is treated once, however many cells share it. Rounding: about u times the surface times the diameter.
"""

from functools import lru_cache
from itertools import combinations

import numpy as np


def cell_volumes(x: np.ndarray, rows: dict[int, tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Volumes (r,) of the n-faces. x: (V, n). rows[k]: boundaries of all k-faces, flat, and row sizes (no empty row)."""
    n = x.shape[1]
    ends = rows[1][0].reshape(-1, 2)
    apex, vector = ends[:, 0], x[ends[:, 1]] - x[ends[:, 0]]
    if n == 1:
        return np.abs(vector[:, 0])
    for k in range(2, n + 1):
        sub, size = rows[k]
        start = np.cumsum(size) - size
        top = apex[sub[start]]
        terms = _wedge(x[apex[sub]] - np.repeat(x[top], size, axis=0), vector[sub], k)
        apex = top
        if k < n:
            # the component that is largest over the whole face tells the orientation of each term
            weight = np.add.reduceat(np.abs(terms), start, axis=0)
            lead = np.repeat(weight.argmax(axis=1), size)
            terms *= np.sign(np.take_along_axis(terms, lead[:, None], axis=1))
        else:
            np.abs(terms, out=terms)
        vector = np.add.reduceat(terms, start, axis=0) / k
    return vector[:, 0]


def _wedge(v: np.ndarray, M: np.ndarray, k: int) -> np.ndarray:
    """v ^ M: v (m, n) vectors, M (m, C(n, k - 1)) in the basis of index sets in lexicographic order -> (m, C(n, k))."""
    out = np.zeros((len(v), len(_wedge_table(v.shape[1], k))))
    for column, terms in zip(out.T, _wedge_table(v.shape[1], k), strict=True):
        for sign, axis, rest in terms:
            column += sign * (v[:, axis] * M[:, rest])
    return out


@lru_cache
def _wedge_table(n: int, k: int):
    """Per k-subset of axes: (sign, axis, number of the remaining (k-1)-subset)."""
    number = {subset: i for i, subset in enumerate(combinations(range(n), k - 1))}
    return [
        [((-1.0) ** p, subset[p], number[subset[:p] + subset[p + 1 :]]) for p in range(k)]
        for subset in combinations(range(n), k)
    ]
