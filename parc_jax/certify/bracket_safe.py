"""Boxes over (z, k) in which every plan is safe: one separating direction per obstacle and run of intervals. [T14]"""

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import x64
from parc_jax.avoid.directions import Multiplier
from parc_jax.certify.bracket_look import Boxes, offsets_from_end
from parc_jax.certify.bracket_tree import Node
from parc_jax.certify.evaluate import HIGHEST
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel
from parc_jax.tolerances import TOLERANCES

VERTICES = 64  # of one box per compiled call; a box with more is looked at in parts


class SafeTable:
    """Tries the scene's table of directions on boxes."""

    def __init__(self, model: TrajectoryModel, scene: Scene):
        self.model, self.scene = model, scene

    def separation(self, node: Node, boxes: Boxes, i: int, k: np.ndarray) -> list | None:
        """The certificate's `sep` for box i with cell vertices k (v, n_k), or None where a direction is missing."""
        n_p = self.model.n_p
        table, active = self.scene.directions, np.asarray(self.scene.obstacles.active)
        least = np.inf
        for first in range(0, len(k), VERTICES):
            part = k[np.minimum(np.arange(first, first + VERTICES), len(k) - 1)]
            with x64():
                least = np.minimum(least, np.asarray(_least_jit(self.model.net, boxes.least[i], table.w, part)))
        low, high = table.w * node.lo[:n_p], table.w * node.hi[:n_p]
        along = least + np.minimum(low, high).sum(axis=2)[:, :, None]  # (o, d, T + 1)
        size = np.abs(table.w)
        need = table.reach[:, :, None] + np.einsum("odj,tj->odt", size, boxes.most[i])
        need = need + (TOLERANCES.leaf_margin + self.scene.slack) * size.sum(axis=2)[:, :, None]
        holds = np.minimum(along[:, :, :-1], along[:, :, 1:]) > need
        out = []
        for o, spelled in enumerate(table.multipliers):
            runs = _runs(holds[o], np.flatnonzero(active[o]))
            if runs is None:
                return None
            out.append([[stop, _spell(spelled[d])] for stop, d in runs])
        return out


def _least(net, like, w, k):
    """Least w . (p_s - z) over vertices k (v, n_k), for directions w (o, d, 2) and all knots: (o, d, T + 1)."""
    back, _ = jax.vmap(lambda x: offsets_from_end(net, *like.shape, x))(k)
    return jnp.einsum("odj,vsj->odsv", w, back, precision=HIGHEST).min(axis=3)


_least_jit = jax.jit(_least)


def _runs(holds: np.ndarray, steps: np.ndarray) -> list[tuple[int, int]] | None:
    """Fewest runs (stop, direction) over the given intervals; holds (d, T). None where no direction holds."""
    runs, t, end = [], int(steps[0]), int(steps[-1]) + 1
    while t < end:
        fails = ~holds[:, t:end]
        length = np.where(fails.any(axis=1), fails.argmax(axis=1), end - t)
        best = int(np.argmax(length))
        if length[best] == 0:
            return None
        t += int(length[best])
        runs.append((t, best))
    return runs


def _spell(m: Multiplier) -> list:
    return [[row, str(value)] for row, value in zip(m.rows, m.values, strict=True)]
