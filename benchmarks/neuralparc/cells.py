"""Regions of the model as the published method visits them: outward from a seed, each cut by the
bins of the tube.
"""

from collections import deque
from collections.abc import Iterator
from itertools import product

import jax
import numpy as np

from benchmarks.neuralparc.sets.operations import clip_to_box
from benchmarks.neuralparc.sets.sampling import volume
from parc_jax.common import struct
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope, from_box
from parc_jax.learning.bound.tube import Tube
from parc_jax.proof.regions.table import RegionTable

# [share of the region's volume] smaller cells are left out: no samples from them, no claim
_SLIVER = 1e-9
# [1] bound on the relative rounding of a float polytope vertex; obstacles grow by it
VERTEX_RELATIVE = 1e-12
_TOGETHER = 128  # most cells of a stack


@struct.dataclass
class Cell:
    """One region cut by one bin, with the model's affine map on it: net(k) = C k + d. Or many, see
    `stack`.

    A: (h, n_k), b: (h,) rows; vertices: (v, n_k).
    C: (n_out, n_k), d: (n_out,), outputs time-major (t, p), then q.
    lo, hi: (n_k,) a box that contains the cell (the bin).
    slip: (n_k,) how far it may reach beyond the hull of its vertices, which are floats.
    region, bin: () numbers.
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
    def largest_k(self) -> np.ndarray:
        """Largest |k| per axis: (n_k,)."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))

    def knot(self, s: int, n_p: int) -> tuple[np.ndarray, np.ndarray]:
        """C_s (n_p, n_k), d_s (n_p,) of the offset at knot s; zero at s = 0, where the path
        starts.
        """
        if s == 0:
            return np.zeros((n_p, self.C.shape[1])), np.zeros(n_p)
        rows = slice((s - 1) * n_p, s * n_p)
        return self.C[rows], self.d[rows]

    def final(self, n_goal: int) -> tuple[np.ndarray, np.ndarray]:
        """C_f (n_p + n_q, n_k), d_f (n_p + n_q,) of the final state: the last outputs."""
        return self.C[..., -n_goal:, :], self.d[..., -n_goal:]


def stacks(cells: list[Cell]) -> Iterator[tuple[np.ndarray, Cell]]:
    """Cells of similar size stacked together: (their indices, stack), filled up by repeating the
    last cell.

    Padding is cheap, compiling is not: vertices are padded to 4, 6, 8, 12, 16, 24, ..., stacks to
    8, 16 or multiples of 32. Large ones are cut evenly, so that they stay in cache and cores can
    share them.
    """
    width = np.array([_padded_width(len(cell.vertices)) for cell in cells], dtype=int)
    for size in np.unique(width):
        index = np.flatnonzero(width == size)
        parts = np.array_split(index, -(-len(index) // _TOGETHER))
        length = _padded_length(len(parts[0]))
        for part in parts:
            filled = np.pad(part, (0, length - len(part)), mode="edge")
            yield part, stack([cells[i] for i in filled])


def stack(cells: list[Cell]) -> Cell:
    """r cells with a leading axis on every field: rows padded by 0 k <= 1, vertices by repeating
    the last.

    Rows are padded to a multiple of 8, vertices to a power of two or to three quarters of one.
    """
    height = -(-max(len(cell.b) for cell in cells) // 8) * 8
    width = _padded_width(max(len(cell.vertices) for cell in cells))

    def padded(rows: np.ndarray, n: int, **how) -> np.ndarray:
        return np.pad(rows, ((0, n - len(rows)), *[(0, 0)] * (rows.ndim - 1)), **how)

    filled = [
        cell.replace(
            A=padded(cell.A, height),
            b=padded(cell.b, height, constant_values=1.0),
            vertices=padded(cell.vertices, width, mode="edge"),
        )
        for cell in cells
    ]
    return jax.tree.map(lambda *parts: np.array(parts), *filled)


def _padded_length(cells: int) -> int:
    """Padded number of cells of a stack: 8, 16, 32, 64, 96, ..."""
    return max(8, min(-(-cells // 32) * 32, 1 << (cells - 1).bit_length()))


def _padded_width(vertices: int) -> int:
    """Padded number of vertices: 4, 6, 8, 12, 16, 24, ..."""
    power = max(4, 1 << (vertices - 1).bit_length())
    three_quarters = 3 * power // 4
    return three_quarters if power > 4 and vertices <= three_quarters else power


def cut_by_bins(
    region: HPolytope, corners: np.ndarray, slip, C, d, tube: Tube, number: int = 0
) -> list[Cell]:
    """The cells of one region, one per bin that it meets with interior. [NP, Sec. IV-B]

    region: h rows over k. corners: (v, n_k) its vertices, each within slip (n_k,) of the exact one.
    C, d: its map. With one bin only, a region keeps its rows.
    """
    slip = slip + VERTEX_RELATIVE * np.abs(corners).max(axis=0)
    smallest = _SLIVER * volume(corners)
    cells = []
    for bin_number in _bins_met(tube, corners):
        lo, hi = tube.bin_box(bin_number)
        rows = region
        if tube.n_bins > 1:
            walls = from_box(Box(lo, hi))
            rows = HPolytope(np.concatenate([region.A, walls.A]), np.r_[region.b, walls.b])
        vertices = corners
        if not ((corners >= lo).all() and (corners <= hi).all()):
            # Wider by the slip: a point of the exact region in the bin is then within the slip of
            # this hull.
            vertices = clip_to_box(corners, lo - slip, hi + slip)
            if volume(vertices) <= smallest:
                continue
        numbers = np.int64(number), np.int64(bin_number)
        cells.append(Cell(rows.A, rows.b, vertices, C, d, lo, hi, slip, *numbers))
    return cells


def _bins_met(tube: Tube, corners: np.ndarray) -> list[int]:
    """Numbers of the bins that overlap the box around corners (v, n_k)."""
    box = zip(tube.edges, corners.min(axis=0), corners.max(axis=0), strict=True)
    met = [np.flatnonzero((edges[:-1] < hi) & (edges[1:] > lo)).tolist() for edges, lo, hi in box]
    counts = [len(edges) - 1 for edges in tube.edges]
    return [int(np.ravel_multi_index(index, counts)) for index in product(*met)]


def neighbours(table: RegionTable) -> np.ndarray:
    """Region across each facet, flat with `facet_offsets`; -1 on the domain's boundary."""
    sides = table.facet_regions[table.facet_index]
    mine = np.repeat(np.arange(table.count), np.diff(table.facet_offsets))
    return np.where(sides[:, 0] == mine, sides[:, 1], sides[:, 0])


def cells_outward(table: RegionTable, tube: Tube, seed: np.ndarray) -> Iterator[list[Cell]]:
    """Cells of every region of a table, region by region, breadth first from the one that contains
    k = seed (n_k,).

    Lazy: each region is cut when it is taken. Raises InputError if the seed is outside the
    domain.
    """
    start = int(table.locate(np.asarray(seed, dtype=np.float64)))
    if start < 0:
        raise InputError(f"seed: expected parameters inside the domain; got {np.asarray(seed)}.")
    for region in breadth_first(neighbours(table), table.facet_offsets, start):
        yield cells_of(table, tube, region)


def cells_of(table: RegionTable, tube: Tube, region: int) -> list[Cell]:
    """The cells of region number `region` of a table."""
    C, d = table.maps(slice(region, region + 1))
    rows, corners = table.region(region), table.region_vertices(region)
    slip = table.point_error.max(axis=0)
    return cut_by_bins(rows, corners, slip, C[0], d[0], tube, region)


def breadth_first(neighbours: np.ndarray, offsets: np.ndarray, start: int) -> Iterator[int]:
    """Items of a graph outward from `start`. Neighbours of i: neighbours[offsets[i]:offsets[i +
    1]], -1 for none.
    """
    waiting, met = deque([start]), {start}
    while waiting:
        item = waiting.popleft()
        yield item
        for other in neighbours[offsets[item] : offsets[item + 1]].tolist():
            if other >= 0 and other not in met:
                met.add(other)
                waiting.append(other)
