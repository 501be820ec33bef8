"""From the finished complex to the region table: numbering, volumes, proof.

Volumes of all cells at once, by pyramids over the face lattice.

A k-face F with a vertex c is the union of the pyramids from c over its facets G, so its k-vector
(volume times unit k-vector) is M(F) = (1/k) sum_G +-(p_G - c) ^ M(G) with p_G any point of G; all
terms are parallel, and the signs are those that make them point the same way. For k = n it is a
number: vol(F) = (1/n) sum_G |(p_G - c) ^ M(G)|. Each face is treated once, however many cells share
it. Facets that contain c add nothing: with c the vertex of least number and p_G that of G, they are
those with p_G = c, about half, and left out. Of parallel terms one component says how long they
are: one term of each face is computed in full, of the others that component alone. Rounding: about
u times the surface times the diameter.
"""

from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.common.sets.box import Box
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.complex import Complex
from parc_jax.proof.regions.proof import prove_complete, recheck_signs
from parc_jax.proof.regions.signs import SignOracle
from parc_jax.proof.regions.storage import CHUNK, or_over_cells, row_chunks, unpack
from parc_jax.proof.regions.table import RegionTable

SHORT = 16  # a term this many times shorter than another of its face does not say the direction
FLAT = 2.0**-40  # [1] sine of an angle below which rounding leaves nothing of the direction


class Pyramids(NamedTuple):
    """The pyramids of some k-faces that have volume, face by face.

    entry: (m,) their facets G. v: (m, n) p_G - c. sides: (m,) (|v| |M(G)|)^2.
    starts: (f + 1,) where those of each face lie.
    """

    entry: np.ndarray
    v: np.ndarray
    sides: np.ndarray
    starts: np.ndarray


def cell_volumes(
    x: np.ndarray, boundaries: tuple[tuple[np.ndarray, np.ndarray], ...]
) -> np.ndarray:
    """Volumes (r,) of the n-faces. x: (V, n). boundaries[k - 1]: (k-1)-faces of the k-faces, flat,
    and offsets.
    """
    n = x.shape[1]
    ends = boundaries[0][0].reshape(-1, 2)
    apex = ends.min(axis=1)  # the vertex c of every face
    vector = x[ends[:, 1]] - x[ends[:, 0]]  # M of every face
    for k in range(2, n + 1):
        sub, offsets = boundaries[k - 1]
        top = np.empty(len(offsets) - 1, apex.dtype)
        out = np.empty((len(top), len(_wedge_table(n, k))))
        squares = np.einsum("ij,ij->i", vector, vector)
        for first, last in row_chunks(offsets, CHUNK):
            rows = offsets[first : last + 1]
            entry = sub[rows[0] : rows[-1]]
            at = apex[entry]
            top[first:last] = np.minimum.reduceat(at, rows[:-1] - rows[0])
            here = np.repeat(top[first:last], np.diff(rows))
            away = np.flatnonzero(at != here)
            # every face has a facet without c
            starts = np.searchsorted(away, rows - rows[0])
            v = x.take(at[away], axis=0) - x.take(here[away], axis=0)
            entry = entry[away]
            sides = np.einsum("ij,ij->i", v, v) * squares[entry]
            out[first:last] = _vectors(Pyramids(entry, v, sides, starts), vector, k)
        apex = top
        vector = out
    return np.abs(vector[:, 0])


def _vectors(pyramids: Pyramids, M: np.ndarray, k: int) -> np.ndarray:
    """M(F) of some k-faces F, (f, C(n, k)), from M of all (k-1)-faces (., C(n, k - 1))."""
    first = pyramids.starts[:-1]
    size = np.diff(pyramids.starts)
    if k == pyramids.v.shape[1]:
        only = np.zeros(len(pyramids.entry), int)
        return np.add.reduceat(np.abs(_component(pyramids, only, M, k)), first)[:, None] / k
    chosen, whole, lead = _directions(pyramids, M, k)
    length = np.abs(_component(pyramids, np.repeat(lead, size), M, k))
    # the direction of a term is that of F but for rounding, which matters more the shorter it is
    longest = _largest(length, first, size)
    short = np.flatnonzero(SHORT * length[chosen] < length[longest])
    whole[:, short] = _whole(pyramids, longest[short], M, k)
    along = np.abs(whole[lead, np.arange(len(size))])
    whole *= np.add.reduceat(length, first) / (k * np.where(along > 0, along, 1.0))
    return whole.T


def _directions(pyramids: Pyramids, M: np.ndarray, k: int):
    """A pyramid of each face (f,), its term (C(n, k), f), and a component (f,) that is large in the
    direction of the face: that of this term, unless the pyramid is flat.
    """
    first = pyramids.starts[:-1]
    chosen = _largest(pyramids.sides, first, np.diff(pyramids.starts))
    whole = _whole(pyramids, chosen, M, k)
    size = np.abs(whole)
    if (np.square(size.max(axis=0)) < FLAT**2 * pyramids.sides[chosen]).any():
        everything = np.abs(_whole(pyramids, np.arange(len(pyramids.v)), M, k))
        size = np.add.reduceat(everything, first, axis=1)
    return chosen, whole, size.argmax(axis=0)


def _largest(values: np.ndarray, first: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Where the largest of each row lies: (f,)."""
    largest = np.flatnonzero(values == np.repeat(np.maximum.reduceat(values, first), size))
    return largest[np.searchsorted(largest, first)]


def _whole(pyramids: Pyramids, some: np.ndarray, M: np.ndarray, k: int) -> np.ndarray:
    """v ^ M(G) of some pyramids (C(n, k), some); index sets in lexicographic order."""
    v = pyramids.v.take(some, axis=0).T.copy()
    M = M.take(pyramids.entry[some], axis=0).T.copy()
    out = np.zeros((len(_wedge_table(len(v), k)), len(some)))
    for component, terms in zip(out, _wedge_table(len(v), k), strict=True):
        for sign, axis, rest in terms:
            component += v[axis] * M[rest] if sign > 0 else -v[axis] * M[rest]
    return out


def _component(pyramids: Pyramids, lead: np.ndarray, M: np.ndarray, k: int) -> np.ndarray:
    """Component number lead (m,) of v ^ M(G), of every pyramid: (m,)."""
    v = pyramids.v
    first_v = np.arange(0, v.size, v.shape[1])
    first_M = pyramids.entry * np.int64(M.shape[1])
    out = np.zeros(len(lead))
    for p in range(k):
        sign, axis, rest = np.array([terms[p] for terms in _wedge_table(v.shape[1], k)], int).T
        term = v.take(first_v + axis.take(lead))
        term *= M.take(first_M + rest.take(lead))
        if sign[0] > 0:
            out += term
        else:
            out -= term
    return out


@lru_cache
def _wedge_table(n: int, k: int):
    """Per k-subset of axes: (sign, axis, number of the remaining (k-1)-subset)."""
    number = {subset: i for i, subset in enumerate(combinations(range(n), k - 1))}
    return [
        [((-1.0) ** p, subset[p], number[subset[:p] + subset[p + 1 :]]) for p in range(k)]
        for subset in combinations(range(n), k)
    ]


def build_table(
    net: ReLUNetwork,
    domain: Box,
    lattice: Complex,
    oracle: SignOracle,
    scale: Float[np.ndarray, " n"],
    domain_volume: float,
) -> RegionTable:
    """The proved table of a finished subdivision. Raises SoundnessError when the proof fails.

    scale (n,): unit coordinates to the caller's. domain_volume: in unit coordinates.
    """
    n = lattice.n
    n_rows = len(oracle.exact.rows)
    boundaries = tuple(lattice.all_rows(drop=True))
    volumes = cell_volumes(lattice.x.view, boundaries)
    column = lattice.label.view[min(n - 1, 1) :]
    facet_label = np.where(column < n_rows, -1 - column, column - n_rows)
    facet_regions, facet_count = _sides(*boundaries[-1], len(column))

    points = lattice.x.view * scale
    point_error = lattice.rho.view[:, None] * scale
    plus = lattice.bits.plus.view
    minus = lattice.bits.minus.view
    recheck_signs(net, points, point_error, plus, minus, n_rows)
    words = plus.shape[1]
    both = or_over_cells(np.concatenate([plus, minus], axis=1), boundaries)
    plus = both[:, :words]
    minus = both[:, words:]
    faces = [lattice.count(k) - (k > 0) for k in range(n + 1)]
    effort = (oracle.n_signs, oracle.n_exact, oracle.n_repaired)
    proof = prove_complete(
        volumes, domain_volume, faces, plus, minus, facet_label, facet_count, effort
    )
    unit = float(np.prod(scale))
    return RegionTable(
        net=net,
        domain=domain,
        patterns=unpack(plus, n_rows + sum(net.hidden))[:, n_rows:],
        volumes=volumes * unit,
        points=points,
        point_error=point_error,
        boundaries=boundaries,
        facet_label=facet_label,
        facet_regions=facet_regions,
        proof=proof.replace(volume=proof.volume * unit, domain_volume=proof.domain_volume * unit),
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
