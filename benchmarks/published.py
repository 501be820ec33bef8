"""The published method on one scene: its pieces, their reach and avoid sets, and which (p0, k) those let through."""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from parc_jax.avoid.paper_scene import PaperScene, paper_scene
from parc_jax.avoid.shadow import Shadows, clear_of_reach, outside, shadows
from parc_jax.lp.status import LPStatus
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid
from parc_jax.pwa import RegionTable
from parc_jax.reach.brs import reach_sets
from parc_jax.reach.pieces import Piece, pieces_outward, stacks

BLOCK = 32  # points of one piece tested together
ROWS = 64  # blocks per compiled call


class Partition:
    """All pieces (regions cut by the bins of the tube) of one model. The obstacles do not matter here."""

    def __init__(self, model: TrajectoryModel, table: RegionTable):
        self.model, self.table = model, table
        self.regions: list[list[Piece]] = list(pieces_outward(table, model.tube, model.domain.center))
        self.pieces = [piece for region in self.regions for piece in region]
        self.number = {(int(p.region), int(p.bin)): i for i, p in enumerate(self.pieces)}

    def piece_of(self, k: np.ndarray, bins: np.ndarray) -> np.ndarray:
        """(b,) piece number of each k (b, n_k) with its bin (b,); -1 where there is none."""
        pairs = zip(self.table.locate(k).tolist(), bins.tolist(), strict=True)
        return np.array([self.number.get(pair, -1) for pair in pairs], int)


class AllSets(NamedTuple):
    """Of r pieces. status: (r,) of Omega. live: numbers of those with an inner point. avoid: (live numbers, their
    avoid sets, which of them miss Omega (., T, o)), stack by stack."""

    status: np.ndarray
    live: np.ndarray
    avoid: list[tuple[np.ndarray, Shadows, np.ndarray]]


def all_sets(pieces: list[Piece], scene: PaperScene) -> AllSets:
    """Reach sets of all pieces, and avoid sets of those that reach the goal, without host LPs."""
    n, n_p = len(pieces), scene.n_p
    status, lo, hi = np.zeros(n, int), np.zeros((n, n_p)), np.zeros((n, n_p))
    for index, stacked in stacks(pieces):
        reach, m = reach_sets(stacked, scene.goals, scene.goal_box, scene.start, n_p), len(index)
        status[index], lo[index], hi[index] = reach.status[:m], reach.lo[:m, :n_p], reach.hi[:m, :n_p]
    live = np.flatnonzero(status == int(LPStatus.FEASIBLE))

    def avoid_sets(part):
        index, stacked = part
        numbers, polygons = live[index], shadows(stacked, scene.grown)
        padded = np.resize(numbers, len(stacked.bin))
        padded[len(numbers) :] = numbers[-1]
        return numbers, polygons, clear_of_reach(polygons, lo[padded], hi[padded])[: len(numbers)]

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        avoid = list(pool.map(avoid_sets, stacks([pieces[i] for i in live])))
    return AllSets(status, live, avoid)


def kept(parts: Partition, problem: ReachAvoid, p0: np.ndarray, k: np.ndarray, bins: np.ndarray) -> np.ndarray:
    """(b,) bool: p0 (b, 2) lies outside every avoid set of the piece that holds k (b, n_k), so the method keeps it."""
    scene = paper_scene(problem, parts.model.tube)
    piece, out = parts.piece_of(k, bins), np.zeros(len(k), bool)
    used = np.unique(piece[piece >= 0])
    for index, stacked in stacks([parts.pieces[i] for i in used]) if len(used) else ():
        polygons = shadows(stacked, scene.grown)
        blocks = [
            (row, part)
            for row, number in enumerate(used[index])
            for at in [np.flatnonzero(piece == number)]
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
    """Avoid sets of some of the stacked pieces, repeated as asked."""
    rows = np.asarray(rows)
    return polygons.replace(
        edge=polygons.edge[rows],
        edge_reach=polygons.edge_reach[rows],
        facet_reach=polygons.facet_reach[rows],
        slack=polygons.slack[rows],
    )
