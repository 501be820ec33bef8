"""From the finished complex to the region table: numbering, volumes, proof.

Volumes of all cells at once, by pyramids over the face lattice.

A k-face F with a vertex c is the union of the pyramids from c over its facets G, so its k-vector
(volume times unit k-vector) is M(F) = (1/k) sum_G +-(p_G - c) ^ M(G) with p_G any point of G; all
terms are parallel, and the signs are those that make them point the same way. Each face is treated
once, however many cells share it. Facets that contain c add nothing: with c the vertex of least
number and p_G that of G, they are those with p_G = c, about half, and left out. Rounding: about u
times the surface times the diameter.
"""

from functools import lru_cache
from itertools import combinations

import numpy as np

from parc_jax.common.sets.box import Box
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.domain import UnitProblem
from parc_jax.proof.regions.proof import prove_complete, recheck_signs
from parc_jax.proof.regions.signs import SignOracle
from parc_jax.proof.regions.storage import CHUNK, or_over_cells, row_chunks, unpack
from parc_jax.proof.regions.table import RegionTable


def cell_volumes(
    x: np.ndarray, boundaries: tuple[tuple[np.ndarray, np.ndarray], ...]
) -> np.ndarray:
    """Volumes (r,) of n-faces of x (V, n). boundaries[k - 1]: of k-faces, flat, with offsets."""
    n = x.shape[1]
    ends = boundaries[0][0].reshape(-1, 2)
    apex = ends.min(axis=1)  # the vertex c of every face
    vector = (x[ends[:, 1]] - x[ends[:, 0]]).T  # M of every face, component by component
    for k in range(2, n + 1):
        sub, offsets = boundaries[k - 1]
        top = np.empty(len(offsets) - 1, apex.dtype)
        out = np.empty((len(_wedge_table(n, k)), len(top)))
        for first, last in row_chunks(offsets, CHUNK):
            rows = offsets[first : last + 1]
            entry = sub[rows[0] : rows[-1]]
            at = apex[entry]
            top[first:last] = np.minimum.reduceat(at, rows[:-1] - rows[0])
            here = np.repeat(top[first:last], np.diff(rows))
            away = np.flatnonzero(at != here)
            # every face has a facet without c
            starts = np.searchsorted(away, rows[:-1] - rows[0])
            v = np.ascontiguousarray((x.take(at[away], axis=0) - x.take(here[away], axis=0)).T)
            terms = _wedge(v, vector.take(entry[away], axis=1), k)
            out[:, first:last] = _sums_of_parallel(terms, starts) / k
        apex, vector = top, out
    return np.abs(vector[0])


def _wedge(v: np.ndarray, M: np.ndarray, k: int) -> np.ndarray:
    """v ^ M (C(n, k), m) of v (n, m), M (C(n, k - 1), m) of k - 1; lexicographic index sets."""
    table = _wedge_table(len(v), k)
    out = np.empty((len(table), v.shape[1]))
    for component, terms in zip(out, table, strict=True):
        component[:] = sum(sign * v[axis] * M[rest] for sign, axis, rest in terms)
    return out


def _sums_of_parallel(terms: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """(C, f) sums of parallel vectors (C, m), row by row from starts (f,) on, with the signs that
    make them point as the longest of the row does.
    """
    size = np.diff(starts, append=terms.shape[1])
    length = np.einsum("cm,cm->m", terms, terms)
    longest = np.flatnonzero(length == np.repeat(np.maximum.reduceat(length, starts), size))
    longest = longest[np.searchsorted(longest, starts)]  # of several the first
    along = np.einsum("cm,cm->m", terms, np.repeat(terms[:, longest], size, axis=1))
    return np.add.reduceat(np.where(along < 0, -terms, terms), starts, axis=1)


@lru_cache
def _wedge_table(n: int, k: int):
    """Per k-subset of axes: (sign, axis, number of the remaining (k-1)-subset)."""
    number = {subset: i for i, subset in enumerate(combinations(range(n), k - 1))}
    return [
        [((-1.0) ** p, subset[p], number[subset[:p] + subset[p + 1 :]]) for p in range(k)]
        for subset in combinations(range(n), k)
    ]


def build_table(
    net: ReLUNetwork, domain: Box, unit: UnitProblem, oracle: SignOracle
) -> RegionTable:
    """The proved table of a finished subdivision. Raises SoundnessError when the proof fails."""
    lattice, scale = oracle.lattice, unit.scale
    n = lattice.n
    n_rows = len(oracle.exact.rows)
    boundaries = tuple(lattice.all_rows(drop=True))
    volumes = cell_volumes(lattice.x.view, boundaries)
    column = lattice.label.view[min(n - 1, 1) :]
    facet_label = np.where(column < n_rows, -1 - column, column - n_rows)
    facet_regions, facet_count = _sides(*boundaries[-1], len(column))

    points = lattice.x.view * scale
    point_error = lattice.rho.view[:, None] * scale
    plus, minus = lattice.bits.plus.view, lattice.bits.minus.view
    recheck_signs(net, points, point_error, plus, minus, n_rows)
    both = or_over_cells(np.concatenate([plus, minus], axis=1), boundaries)
    plus, minus = np.split(both, 2, axis=1)
    faces = [lattice.count(k) - (k > 0) for k in range(n + 1)]
    effort = oracle.n_signs, oracle.n_exact
    whole = float(np.prod(unit.hi - unit.lo))
    proof = prove_complete(volumes, whole, faces, plus, minus, facet_label, facet_count, effort)
    size = float(np.prod(scale))
    return RegionTable(
        net=net,
        domain=domain,
        patterns=unpack(plus, n_rows + sum(net.hidden))[:, n_rows:],
        volumes=volumes * size,
        points=points,
        point_error=point_error,
        boundaries=boundaries,
        facet_label=facet_label,
        facet_regions=facet_regions,
        proof=proof.replace(volume=proof.volume * size, domain_volume=proof.domain_volume * size),
    )


def _sides(facets: np.ndarray, offsets: np.ndarray, n_facets: int) -> tuple[np.ndarray, np.ndarray]:
    """The regions (f, 2) on the two sides of each facet, -1 for outside, and their number (f,)."""
    region = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    count = np.bincount(facets, minlength=n_facets)
    sides = np.full((n_facets, 2), -1)
    # of several assignments to one facet the last one stays: the first region, then the last
    sides[facets[::-1], 0] = region[::-1]
    sides[facets, 1] = region
    sides[count == 1, 1] = -1
    return sides, count
