"""Volumes of all cells at once, by pyramids over the face lattice.

A k-face F with a vertex c is the union of the pyramids from c over its facets G, so its k-vector
(volume times unit k-vector) is M(F) = (1/k) sum_G +-(p_G - c) ^ M(G) with p_G any point of G; all
terms are parallel, and the signs are those that make them point the same way. For k = n it is a
number: vol(F) = (1/n) sum_G |(p_G - c) ^ M(G)|. Each face is treated once, however many cells share
it. Facets that contain c add nothing: with c the vertex of least number and p_G that of G, they are
those with p_G = c, about half, and left out. Rounding: about u times the surface times the
diameter.
"""

from functools import lru_cache
from itertools import combinations, pairwise

import numpy as np

CHUNK = 1 << 15  # boundary entries treated at once, so that the working set stays in cache


def cell_volumes(x: np.ndarray, boundaries) -> np.ndarray:
    """Volumes (r,) of the n-faces. x: (V, n). boundaries[k - 1]: (k-1)-faces of the k-faces, flat,
    and offsets.
    """
    n = x.shape[1]
    ends = boundaries[0][0].reshape(-1, 2)
    apex = ends.min(axis=1)  # the vertex c of every face
    vector = x[ends[:, 1]] - x[ends[:, 0]]  # M of every face
    for k in range(2, n + 1):
        sub, offsets = boundaries[k - 1]
        top = np.minimum.reduceat(apex[sub], offsets[:-1])
        out = np.empty((len(offsets) - 1, len(_wedge_table(n, k))))
        for first, last in _chunks(offsets):
            entry = sub[offsets[first] : offsets[last]]
            at = apex[entry]
            here = np.repeat(top[first:last], np.diff(offsets[first : last + 1]))
            away = np.flatnonzero(at != here)
            to_facet = x.take(at[away], axis=0) - x.take(here[away], axis=0)
            terms = _wedge(to_facet.T.copy(), vector.take(entry[away], axis=0).T.copy(), k)
            # every face has a facet without c
            starts = np.searchsorted(away, offsets[first : last + 1] - offsets[first])
            out[first:last] = _add_parallel(terms, starts).T
        apex = top
        out /= k
        vector = out
    return np.abs(vector[:, 0])


def _add_parallel(terms: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Sum (C, rows) of parallel vectors, terms (C, m), over the rows of `offsets`, all turned to
    point the same way.
    """
    weight = np.add.reduceat(np.abs(terms), offsets[:-1], axis=1)
    if len(terms) == 1:
        return weight
    # the component that is largest over the whole row tells the orientation of each term
    lead = np.repeat(weight.argmax(axis=0), np.diff(offsets))
    orientation = np.sign(np.take_along_axis(terms, lead[None], axis=0))
    return np.add.reduceat(terms * orientation, offsets[:-1], axis=1)


def _chunks(offsets: np.ndarray):
    """Row ranges of about CHUNK entries each."""
    cuts = np.searchsorted(offsets, np.arange(0, offsets[-1], CHUNK))
    cuts = np.unique(np.append(cuts, len(offsets) - 1))
    return pairwise(cuts)


def _wedge(v: np.ndarray, M: np.ndarray, k: int) -> np.ndarray:
    """v ^ M by components: (n, m), (C(n, k - 1), m) -> (C(n, k), m); index sets in lexicographic
    order.
    """
    table = _wedge_table(len(v), k)
    out = np.zeros((len(table), v.shape[1]))
    for component, terms in zip(out, table, strict=True):
        for sign, axis, rest in terms:
            component += v[axis] * M[rest] if sign > 0 else -v[axis] * M[rest]
    return out


@lru_cache
def _wedge_table(n: int, k: int):
    """Per k-subset of axes: (sign, axis, number of the remaining (k-1)-subset)."""
    number = {subset: i for i, subset in enumerate(combinations(range(n), k - 1))}
    return [
        [((-1.0) ** p, subset[p], number[subset[:p] + subset[p + 1 :]]) for p in range(k)]
        for subset in combinations(range(n), k)
    ]
