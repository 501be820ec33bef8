"""Boxes over (z, k) in which every plan is safe: one separating direction per obstacle and run of
intervals. [T14, T30]
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int

from parc_jax.common.arrays import HIGHEST, slices, x64
from parc_jax.common.shapes import ManyParams
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.network.predict import Layout, by_point
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.absence.bin_errors import BinErrors
from parc_jax.proof.absence.bounds import offsets_from_end
from parc_jax.proof.absence.tree import Node
from parc_jax.proof.certificate.write import runs_along, separation_part
from parc_jax.safe_set.verdict.scene import Scene

VERTICES = 64  # of one box per compiled call; a box with more is examined in parts


class SafeBoxes:
    """Tries the scene's table of directions on boxes."""

    def __init__(self, scene: Scene, errors: BinErrors):
        self.model = scene.model
        self.scene = scene
        self.errors = errors

    def compile(self, k: np.ndarray) -> None:
        """Compile for scenes of this size; k (v, n_k): any."""
        self._least_along(k)

    def separation(self, node: Node, bins: np.ndarray, k: np.ndarray) -> list | None:
        """The certificate's `sep` for a box that overlaps these bins, with cell vertices k (v,
        n_k), or None where a direction is missing.
        """
        n_p = self.model.n_p
        table = self.scene.directions
        points = self.scene.obstacles.points
        along_z = np.minimum(table.w * node.lo[:n_p], table.w * node.hi[:n_p]).sum(axis=2)
        heights = self._least_along(k) + along_z[:, :, None, None]  # (o, d, T + 1, i)
        lost = self.errors.lost(bins, table.w, points)
        margin = TOLERANCES.leaf_margin + self.scene.slack
        out = []
        for o in range(len(table.multipliers)):
            runs = runs_along(self.scene, o, heights[o], lost[o], margin)
            if runs is None:
                return None
            out.append(runs)
        return separation_part(out, self.scene.problem)

    def _least_along(self, k: np.ndarray) -> np.ndarray:
        """Least w . (p_s - z) over all k (v, n_k), of directions w of the table and the points of
        their parts: (o, d, T + 1, i).
        """
        least = np.inf
        for rows in slices(len(k), VERTICES):
            # short parts are filled up with the last vertex
            part = k[np.minimum(np.arange(rows.start, rows.start + VERTICES), len(k) - 1)]
            with x64():
                found = _least_jit(
                    self.model.net,
                    self.model.layout,
                    self.scene.directions.w,
                    self.scene.obstacles.points,
                    part,
                )
            least = np.minimum(least, np.asarray(found))
        return least


def _least(
    net: ReLUNetwork,
    layout: Layout,
    w: Float[ArrayLike, "o d n_p"],
    points: Int[ArrayLike, "o i"],
    k: ManyParams,
):
    """(o, d, T + 1, i) least w . (p_s - z) over vertices k, for directions w, points, all knots."""
    back, _ = jax.vmap(lambda x: offsets_from_end(net, layout, x))(k)
    places = by_point(back, layout.n_points)[:, :, points]
    return jnp.einsum("odj,vsoij->odsiv", w, places, precision=HIGHEST).min(axis=4)


_least_jit = jax.jit(_least, static_argnames="layout")
