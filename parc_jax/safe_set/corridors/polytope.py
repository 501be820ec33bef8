"""A safe polytope: a corridor cut to one cell (region and bin), where the network is an affine map.
Everything else follows from pattern, bin, directions and one inner point. [T29]
"""

from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Bool, Float

from parc_jax.common import struct
from parc_jax.common.arrays import product, x64
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.shapes import Index, Params
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.maps import pattern_map
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.sampling import cell_of
from parc_jax.safe_set.verdict.scene import Scene, SceneArrays


class SafePolytope:
    """The polytope of all (p0, k) with this pattern, in this bin, that keep to the corridor.

    p0 (n_p,), k (n_k,): a point strictly inside. pattern (n_hidden,) bool. born: [s] after the
    query began. w (o, T, n_p), threshold (o, T, i): every inequality w . p^ > threshold, for each
    point of each obstacle at both ends of every interval; float slack included.
    """

    def __init__(
        self,
        scene: Scene,
        p0: np.ndarray,
        k: np.ndarray,
        pattern: np.ndarray,
        bin: int,
        corridor: Corridor,
        born: float,
    ):
        self.p0 = p0
        self.k = k
        self.pattern = pattern
        self.bin = int(bin)
        self.corridor = corridor
        self.born = born
        self.w = corridor.w
        self.threshold = corridor.threshold(scene.model.tube.during(self.bin))
        self.scene = scene

    @property
    def cell(self) -> bytes:
        """Name of its region and bin, as points have it."""
        return cell_of(self.pattern[None], np.array([self.bin]))[0].tobytes()

    @cached_property
    def halfspaces(self) -> HPolytope:
        """The polytope as float64 rows over (p0, k); every row is pulled in by the float slack."""
        model, scene = self.scene.model, self.scene
        lo, hi = model.tube.bin_box(self.bin)
        with x64():
            parts = _cell_rows(model.net, model.tube, scene.arrays, self.pattern, self.bin, lo, hi)
        A, b, C, d = (np.asarray(x) for x in parts)
        rows, bounds = [A], [b]
        active = np.asarray(scene.obstacles.active)[: len(self.w)]
        points = self.corridor.points
        C = C.reshape(len(C), model.n_points, model.n_p, -1)[:, points]
        d = d.reshape(len(d), model.n_points, model.n_p)[:, points]
        w = np.broadcast_to(self.w[:, :, None], (*self.threshold.shape, model.n_p))
        for shift in (0, 1):
            knots = slice(shift, shift + model.time.n_steps)
            along = np.einsum("otip,toipk->otik", w, C[knots])
            offset = np.einsum("otip,toip->oti", w, d[knots])
            both = np.concatenate([w, along], axis=3)[active]
            rows.append(-both.reshape(-1, both.shape[-1]))
            bounds.append((offset - self.threshold)[active].ravel())
        A, b = np.concatenate(rows), np.concatenate(bounds)
        size = np.abs(A).sum(axis=1)
        real = size > 0
        return HPolytope(A[real], b[real] - float(scene.slack) * size[real])


@struct.dataclass
class CellMap:
    """The network on one activation pattern.

    region_A (h, n_k), region_b (h,): rows of the region. C (T + 1, n_c, n_k), d (T + 1, n_c):
    offsets, zero at the start of the first point. q_C (n_q, n_k), q_d (n_q,): further goal states.
    """

    region_A: jax.Array
    region_b: jax.Array
    C: jax.Array
    d: jax.Array
    q_C: jax.Array
    q_d: jax.Array


def cell_map(net: ReLUNetwork, pattern: Bool[ArrayLike, " n_hidden"], layout: Layout) -> CellMap:
    """Affine map and region rows of an activation pattern."""
    with jax.default_matmul_precision("highest"):
        region_A, region_b, C, d = pattern_map(net.weights, net.biases, pattern, jnp)
    split = layout.n_offsets
    knots_C = jnp.concatenate([jnp.zeros((layout.n_p, net.n_in)), C[:split]])
    knots_d = jnp.concatenate([jnp.zeros(layout.n_p), d[:split]])
    return CellMap(
        region_A,
        region_b,
        knots_C.reshape(-1, layout.n_c, net.n_in),
        knots_d.reshape(-1, layout.n_c),
        C[split:],
        d[split:],
    )


def anchored_rows(
    scene: SceneArrays, cell: CellMap, lost: Float[ArrayLike, " g"], bin_lo: Params, bin_hi: Params
):
    """Rows A (h, n_p + n_k), b (h,) of the cell's goal-reaching set: bin, region, shrunken goal,
    start set. lost: what the rows of the goal lose to the errors at the end.
    """
    n_p = scene.start_A.shape[1]
    n_c, n_k = cell.C.shape[1:]
    eye = jnp.eye(n_k, dtype=float)
    none = jnp.zeros((n_k, n_p))
    goal_c, goal_q = scene.goal_A[:, :n_c], scene.goal_A[:, n_c:]
    goal_p = goal_c.reshape(len(goal_c), -1, n_p).sum(axis=1)  # every point moves with p0
    goal_k = product(goal_c, cell.C[-1]) + product(goal_q, cell.q_C)
    at_zero = product(goal_c, cell.d[-1]) + product(goal_q, cell.q_d)
    goal_b = scene.goal_b - lost - at_zero
    A = [
        jnp.concatenate([none, eye], axis=1),
        jnp.concatenate([none, -eye], axis=1),
        jnp.concatenate([jnp.zeros((len(cell.region_b), n_p)), cell.region_A], axis=1),
        jnp.concatenate([goal_p, goal_k], axis=1),
        jnp.concatenate([scene.start_A, jnp.zeros((len(scene.start_b), n_k))], axis=1),
    ]
    b = jnp.concatenate(
        [jnp.asarray(bin_hi), -jnp.asarray(bin_lo), cell.region_b, goal_b, scene.start_b]
    )
    return jnp.concatenate(A), b


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
    cell = cell_map(net, pattern, tube.layout)
    lost = tube.support_at_end(jnp.asarray(scene.goal_A), bin)
    return *anchored_rows(scene, cell, lost, lo, hi), cell.C, cell.d
