"""A corridor cut to a cell (region, bin), where the network is affine: rows of a polytope. [T29]"""

from dataclasses import dataclass
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Bool

from parc_jax.common.arrays import product, x64
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.shapes import Index, Params
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.maps import pattern_map
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.verdict.scene import Scene, SceneArrays


@dataclass(frozen=True, eq=False)
class SafePolytope:
    """The polytope of all (p0, k) of one activation pattern and one bin that satisfy a corridor.

    p0 (n_p,), k (n_k,): a point strictly inside. pattern (n_hidden,) bool.
    """

    scene: Scene
    p0: np.ndarray
    k: np.ndarray
    pattern: np.ndarray
    bin: int
    corridor: Corridor

    @property
    def cell(self) -> bytes:
        """Name of its region and bin, as of `cell_of`."""
        return cell_of(self.pattern[None], np.array([self.bin]))[0].tobytes()

    @cached_property
    def halfspaces(self) -> HPolytope:
        """The polytope as float64 rows over (p0, k), each pulled in by the rounding tolerance."""
        model, scene = self.scene.model, self.scene
        lo, hi = model.tube.bin_box(self.bin)
        with x64():
            parts = _cell_rows(model.net, model.tube, scene.arrays, self.pattern, self.bin, lo, hi)
        A, b, C, d = (np.asarray(x) for x in parts)
        rows, bounds = [A], [b]
        # the inequalities w . p^ > threshold (o, T, i), for each point of each obstacle at both
        # ends of every interval; rounding tolerance included
        w, points = self.corridor.w, self.corridor.points
        threshold = self.corridor.threshold(model.tube.during(self.bin))
        active = np.asarray(scene.obstacles.active)[: len(w)]
        C = C.reshape(len(C), model.n_points, model.n_p, -1)[:, points]
        d = d.reshape(len(d), model.n_points, model.n_p)[:, points]
        w = np.broadcast_to(w[:, :, None], (*threshold.shape, model.n_p))
        for shift in (0, 1):
            knots = slice(shift, shift + model.time.n_steps)
            along = np.einsum("otip,toipk->otik", w, C[knots])
            offset = np.einsum("otip,toip->oti", w, d[knots])
            both = np.concatenate([w, along], axis=3)[active]
            rows.append(-both.reshape(-1, both.shape[-1]))
            bounds.append((offset - threshold)[active].ravel())
        A, b = np.concatenate(rows), np.concatenate(bounds)
        size = np.abs(A).sum(axis=1)
        real = size > 0
        return HPolytope(A[real], b[real] - float(scene.slack) * size[real])


@jax.jit
def _cell_rows(
    net: ReLUNetwork,
    tube: Tube,
    scene: SceneArrays,
    pattern: Bool[ArrayLike, " n_hidden"],
    bin: Index,
    lo: Params,
    hi: Params,
):
    """Rows A (h, n_p + n_k), b (h,) of the goal-reaching set of a cell: its bin [lo, hi], region,
    shrunken goal and start set. Map of its places, C (T + 1, n_c, n_k), d (T + 1, n_c), relative to
    the start of the first point.
    """
    n_p, n_k, layout = scene.start_A.shape[1], net.n_in, tube.layout
    with jax.default_matmul_precision("highest"):
        region_A, region_b, C, d = pattern_map(net, pattern, jnp)
    q_C, q_d = C[layout.n_offsets :], d[layout.n_offsets :]
    C = jnp.concatenate([jnp.zeros((n_p, n_k)), C[: layout.n_offsets]])
    d = jnp.concatenate([jnp.zeros(n_p), d[: layout.n_offsets]])
    C, d = C.reshape(-1, layout.n_c, n_k), d.reshape(-1, layout.n_c)
    goal_c, goal_q = jnp.split(jnp.asarray(scene.goal_A), [layout.n_c], axis=1)
    goal_p = goal_c.reshape(len(goal_c), -1, n_p).sum(axis=1)  # every point moves with p0
    goal_k = product(goal_c, C[-1]) + product(goal_q, q_C)
    at_zero = product(goal_c, d[-1]) + product(goal_q, q_d)
    goal_b = scene.goal_b - tube.support_at_end(jnp.asarray(scene.goal_A), bin) - at_zero
    # normals over p0 and over k
    eye, none = jnp.eye(n_k, dtype=float), jnp.zeros
    of_p = [none((2 * n_k + len(region_b), n_p)), goal_p, scene.start_A]
    of_k = [eye, -eye, region_A, goal_k, none((len(scene.start_b), n_k))]
    A = jnp.concatenate([jnp.concatenate(of_p), jnp.concatenate(of_k)], axis=1)
    b = jnp.concatenate([jnp.asarray(hi), -jnp.asarray(lo), region_b, goal_b, scene.start_b])
    return A, b, C, d


def cell_of(pattern: np.ndarray, bins: np.ndarray) -> np.ndarray:
    """(b,) byte strings that are equal exactly when pattern (b, n_hidden) and bin (b,) are."""
    packed = np.packbits(pattern, axis=1)
    tail = np.ascontiguousarray(bins, dtype="<i4").view(np.uint8).reshape(len(packed), 4)
    name = np.ascontiguousarray(np.concatenate([packed, tail], axis=1))
    return name.view(f"V{name.shape[1]}")[:, 0]
