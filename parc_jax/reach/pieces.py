"""Regions of the model as the published method visits them: outward from a seed, each cut by the bins of the tube."""

from collections import deque
from collections.abc import Iterator

import numpy as np
from flax import struct

from parc_jax.error.tube import Tube
from parc_jax.errors import InputError
from parc_jax.pwa.table import RegionTable
from parc_jax.sets.box import Box
from parc_jax.sets.clip import clip_to_box
from parc_jax.sets.hpolytope import HPolytope, from_box
from parc_jax.sets.volume import volume
from parc_jax.tolerances import TOLERANCES

_SLIVER = 1e-9  # [share of the region's volume] smaller pieces are left out: they get no samples, nothing is claimed
_TOGETHER = 128  # most pieces of a stack


@struct.dataclass
class Piece:
    """One region cut by one bin, with the model's affine map on it: net(k) = C k + d. Or many, see `stack`.

    A: (h, n_k), b: (h,) rows; vertices: (v, n_k). C: (n_out, n_k), d: (n_out,), outputs time-major (t, p), then q.
    lo, hi: (n_k,) a box known to contain the piece (the bin). slip: (n_k,) how far it may reach beyond the hull of its
    vertices, which are floats. region, bin: () numbers.
    """

    A: np.ndarray
    b: np.ndarray
    vertices: np.ndarray
    C: np.ndarray
    d: np.ndarray
    lo: np.ndarray
    hi: np.ndarray
    slip: np.ndarray
    region: np.ndarray
    bin: np.ndarray

    @property
    def reach(self) -> np.ndarray:
        """Largest |k| per axis: (n_k,)."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))

    def knot(self, s: int, n_p: int) -> tuple[np.ndarray, np.ndarray]:
        """C_s (n_p, n_k), d_s (n_p,) of the offset at knot s; zero at s = 0, where the path starts."""
        if s == 0:
            return np.zeros((n_p, self.C.shape[1])), np.zeros(n_p)
        rows = slice((s - 1) * n_p, s * n_p)
        return self.C[rows], self.d[rows]

    def final(self, n_goal: int) -> tuple[np.ndarray, np.ndarray]:
        """C_f (n_p + n_q, n_k), d_f (n_p + n_q,) of the final state: the last outputs."""
        return self.C[..., -n_goal:, :], self.d[..., -n_goal:]


def stacks(pieces: list[Piece]) -> Iterator[tuple[np.ndarray, Piece]]:
    """Pieces of similar size stacked together: (their indices, stack), filled up by repeating the last piece.

    Padding is cheap, compiling is not: vertices are padded to 4, 6, 8, 12, 16, 24, ..., stacks to 8, 16 or multiples
    of 32. Large ones are cut evenly, so that they stay in cache and cores can share them.
    """
    bucket = np.array([_width(len(p.vertices)) for p in pieces], dtype=int)
    for size in np.unique(bucket):
        index = np.flatnonzero(bucket == size)
        parts = np.array_split(index, -(-len(index) // _TOGETHER))
        most = len(parts[0])
        length = max(8, min(-(-most // 32) * 32, 1 << (most - 1).bit_length()))
        for part in parts:
            yield part, stack([pieces[i] for i in np.pad(part, (0, length - len(part)), mode="edge")])


def stack(pieces: list[Piece]) -> Piece:
    """r pieces with a leading axis on every field: rows padded by 0 k <= 1, vertices by repeating the last.

    Rows are padded to a multiple of 8, vertices to a power of two or to three quarters of one.
    """
    height = -(-max(len(p.b) for p in pieces) // 8) * 8
    width = _width(max(len(p.vertices) for p in pieces))
    n_k = pieces[0].A.shape[1]
    A, b = np.zeros((len(pieces), height, n_k)), np.ones((len(pieces), height))
    points = np.empty((len(pieces), width, n_k))
    for i, p in enumerate(pieces):
        A[i, : len(p.b)], b[i, : len(p.b)] = p.A, p.b
        points[i, : len(p.vertices)], points[i, len(p.vertices) :] = p.vertices, p.vertices[-1]
    shared = (np.array([getattr(p, name) for p in pieces]) for name in ("C", "d", "lo", "hi", "slip", "region", "bin"))
    return Piece(A, b, points, *shared)


def _width(vertices: int) -> int:
    """Padded number of vertices: 4, 6, 8, 12, 16, 24, ..."""
    power = max(4, 1 << (vertices - 1).bit_length())
    return 3 * power // 4 if 4 < power and vertices <= 3 * power // 4 else power


def cut_by_bins(region: HPolytope, corners: np.ndarray, slip, C, d, tube: Tube, number: int = 0) -> list[Piece]:
    """The pieces of one region, one per bin that it meets with interior. [NP Sec. IV-B]

    region: h rows over k. corners: (v, n_k) its vertices, each within slip (n_k,) of the exact one. C, d: its map.
    With one bin only, a region keeps its rows.
    """
    slip = slip + TOLERANCES.vertex_relative * np.abs(corners).max(axis=0)
    lo, hi, whole = corners.min(axis=0), corners.max(axis=0), volume(corners)
    spans = []
    for axis, edges in enumerate(tube.edges):
        spans.append([i for i in range(len(edges) - 1) if edges[i] < hi[axis] and edges[i + 1] > lo[axis]])
    counts = [len(edges) - 1 for edges in tube.edges]
    pieces = []
    for index in np.array(np.meshgrid(*spans, indexing="ij")).reshape(len(spans), -1).T:
        bin_number = int(np.ravel_multi_index(tuple(index), counts))
        bin_lo, bin_hi = tube.bin_box(bin_number)
        part, points = region, corners
        if tube.n_bins > 1:
            walls = from_box(Box(bin_lo, bin_hi))
            part = HPolytope(np.concatenate([region.A, walls.A]), np.r_[region.b, walls.b])
        if not ((lo >= bin_lo).all() and (hi <= bin_hi).all()):
            # Wider by the slip: a point of the exact region in the bin is then within the slip of this hull.
            points = clip_to_box(corners, bin_lo - slip, bin_hi + slip)
            if volume(points) <= _SLIVER * whole:
                continue
        numbers = np.int64(number), np.int64(bin_number)
        pieces.append(Piece(part.A, part.b, points, C, d, bin_lo, bin_hi, slip, *numbers))
    return pieces


def pieces_outward(table: RegionTable, tube: Tube, seed: np.ndarray) -> Iterator[list[Piece]]:
    """Pieces of every region of a table, region by region, breadth first from the one that contains k = seed (n_k,).

    Lazy: regions that are not asked for cost nothing. Raises InputError if the seed is outside the domain.
    """
    start = int(table.locate(np.asarray(seed, dtype=np.float64)))
    if start < 0:
        raise InputError(f"seed: expected parameters inside the domain; got {np.asarray(seed)}.")
    for region in breadth_first(table.neighbours, table.facet_offsets, start):
        yield pieces_of(table, tube, region)


def pieces_of(table: RegionTable, tube: Tube, region: int) -> list[Piece]:
    """The pieces of region number `region` of a table."""
    C, d = table.maps(slice(region, region + 1))
    slip = table.point_error.max(axis=0)
    return cut_by_bins(table.region(region), table.region_vertices(region), slip, C[0], d[0], tube, region)


def breadth_first(neighbours: np.ndarray, offsets: np.ndarray, start: int) -> Iterator[int]:
    """Items of a graph outward from `start`. Neighbours of i: neighbours[offsets[i]:offsets[i + 1]], -1 for none."""
    waiting, seen = deque([start]), {start}
    while waiting:
        item = waiting.popleft()
        yield item
        for other in neighbours[offsets[item] : offsets[item + 1]].tolist():
            if other >= 0 and other not in seen:
                seen.add(other)
                waiting.append(other)
