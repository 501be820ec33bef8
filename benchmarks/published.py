"""The published method on one scene: its cells, their reach and avoid sets, and which (p0, k)
those let through.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.neuralparc.brs import reach_sets
from benchmarks.neuralparc.by_support import UNIT, Shadows, in_x64, outside, shadows
from benchmarks.neuralparc.cells import Cell, cells_outward, stacks
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.scene import PaperScene, paper_scene
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.proof.regions import RegionTable

BLOCK = 32  # points of one cell tested together
ROWS = 64  # blocks per compiled call


def clear_of_reach(sh: Shadows, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Which Lambda_P miss a box of starts, lo and hi (r, 2), altogether: (r, T, o). The pruning of
    empty avoid sets.
    """
    slack = sh.slack + 8 * UNIT * np.maximum(np.abs(lo), np.abs(hi)).sum(axis=1)
    supports = (sh.edge, sh.edge_support, sh.facet_support, sh.facet)
    margin = in_x64(_box_margins, lo, hi, *supports)
    return margin > slack[:, None, None]


def _box_margin(lo, hi, edge, edge_support, facet_support, facet):
    """One cell, the least margin over a box along one direction: (T, o)."""

    def lowest(w):
        x = jnp.minimum(w[..., 0] * lo[0], w[..., 0] * hi[0])
        y = jnp.minimum(w[..., 1] * lo[1], w[..., 1] * hi[1])
        return x + y

    beyond_edge = lowest(edge)[:, None] - edge_support
    beyond_facet = lowest(facet)[None] - facet_support
    return jnp.maximum(beyond_edge.max(axis=2), beyond_facet.max(axis=2))


_box_margins = jax.jit(jax.vmap(_box_margin, in_axes=(0, 0, 0, 0, 0, None)))


class Partition:
    """All cells (regions cut by the bins of the tube) of one model. The obstacles do not matter
    here.
    """

    def __init__(self, model: TrajectoryModel, table: RegionTable):
        self.model, self.table = model, table
        self.regions: list[list[Cell]] = list(cells_outward(table, model.tube, model.domain.center))
        self.cells = [cell for region in self.regions for cell in region]
        self.number = {(int(p.region), int(p.bin)): i for i, p in enumerate(self.cells)}

    def cell_of(self, k: np.ndarray, bins: np.ndarray) -> np.ndarray:
        """(b,) cell number of each k (b, n_k) with its bin (b,); -1 where there is none."""
        pairs = zip(self.table.locate(k).tolist(), bins.tolist(), strict=True)
        return np.array([self.number.get(pair, -1) for pair in pairs], int)


class AllSets(NamedTuple):
    """Of r cells.

    status: (r,) of Omega. live: numbers of those with an inner point.
    avoid: (live numbers, their avoid sets, which of them miss Omega (., T, o)), stack by stack.
    """

    status: np.ndarray
    live: np.ndarray
    avoid: list[tuple[np.ndarray, Shadows, np.ndarray]]


def all_sets(cells: list[Cell], scene: PaperScene) -> AllSets:
    """Reach sets of all cells, and avoid sets of those that reach the goal, without host LPs."""
    n_p = scene.n_p
    status = np.zeros(len(cells), int)
    lo = np.zeros((len(cells), n_p))
    hi = np.zeros((len(cells), n_p))
    for index, stacked in stacks(cells):
        reach = reach_sets(stacked, scene.goals, scene.goal_box, scene.start, n_p)
        status[index] = reach.status[: len(index)]
        lo[index] = reach.lo[: len(index), :n_p]
        hi[index] = reach.hi[: len(index), :n_p]
    live = np.flatnonzero(status == int(LPStatus.FEASIBLE))

    def avoid_sets(part):
        index, stacked = part
        numbers, polygons = live[index], shadows(stacked, scene.grown)
        padded = np.resize(numbers, len(stacked.bin))
        padded[len(numbers) :] = numbers[-1]
        return numbers, polygons, clear_of_reach(polygons, lo[padded], hi[padded])[: len(numbers)]

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        avoid = list(pool.map(avoid_sets, stacks([cells[i] for i in live])))
    return AllSets(status, live, avoid)


def kept(
    parts: Partition, problem: Problem, p0: np.ndarray, k: np.ndarray, bins: np.ndarray
) -> np.ndarray:
    """(b,) bool: p0 (b, 2) lies outside every avoid set of the cell that holds k (b, n_k), so the
    method keeps it.
    """
    scene = paper_scene(problem, parts.model.tube)
    cell, out = parts.cell_of(k, bins), np.zeros(len(k), bool)
    used = np.unique(cell[cell >= 0])
    for index, stacked in stacks([parts.cells[i] for i in used]) if len(used) else ():
        polygons = shadows(stacked, scene.grown)
        blocks = [
            (row, part)
            for row, number in enumerate(used[index])
            for at in [np.flatnonzero(cell == number)]
            for part in np.split(at, range(BLOCK, len(at), BLOCK))
        ]
        for first in range(0, len(blocks), ROWS):
            chunk = blocks[first : first + ROWS]
            chunk += [chunk[-1]] * (ROWS - len(chunk))
            points = np.array([np.resize(at, BLOCK) for _, at in chunk])
            clear = outside(rows_of(polygons, [row for row, _ in chunk]), p0[points])
            out[points] = (clear | ~scene.grown.active.T).all(axis=(2, 3))
    return out


def rows_of(polygons: Shadows, rows) -> Shadows:
    """Avoid sets of some of the stacked cells, repeated as asked."""
    rows = np.asarray(rows)
    return polygons.replace(
        edge=polygons.edge[rows],
        edge_support=polygons.edge_support[rows],
        facet_support=polygons.facet_support[rows],
        slack=polygons.slack[rows],
    )
