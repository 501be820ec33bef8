"""A safe polytope: a corridor cut to one cell (region and bin), where the network is an affine map.
Everything else follows from pattern, bin, directions and one inner point. [T29]
"""

from collections.abc import Iterable
from functools import cached_property
from typing import NamedTuple

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
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.sampling import Points, cell_of, groups
from parc_jax.safe_set.verdict.scene import Scene, SceneArrays


class SafePolytope:
    """The polytope of all (p0, k) of one activation pattern and one bin that satisfy a corridor.

    p0 (n_p,), k (n_k,): a point strictly inside. pattern (n_hidden,) bool. w (o, T, n_p),
    threshold (o, T, i): the inequalities w . p^ > threshold, for each point of each obstacle at
    both ends of every interval; rounding tolerance included.
    """

    def __init__(
        self,
        scene: Scene,
        p0: np.ndarray,
        k: np.ndarray,
        pattern: np.ndarray,
        bin: int,
        corridor: Corridor,
    ):
        self.p0 = p0
        self.k = k
        self.pattern = pattern
        self.bin = int(bin)
        self.corridor = corridor
        self.w = corridor.w
        self.threshold = corridor.threshold(scene.model.tube.during(self.bin))
        self.scene = scene

    @property
    def cell(self) -> bytes:
        """Name of its region and bin, as of `Points.cell`."""
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


class _Try(NamedTuple):
    """A corridor tried in a cell. index: points of the cell. plans: those that may be inside."""

    index: np.ndarray
    corridor: int
    plans: np.ndarray


def cut_around(
    scene: Scene, corridors: Corridors, counts: np.ndarray, points: Points
) -> list[SafePolytope]:
    """Polytopes around the plans that satisfy a corridor: in each cell as few as hold them all, by
    greedy set cover.

    counts: (c,) plans in each corridor, by which ties are broken: the most popular is taken.
    """
    maybe = corridors.coarse(points.path, points.bin)
    popular = counts / (1 + counts.sum())  # below 1, so it decides among equals only
    left = np.ones(len(points.k), bool)
    cuts = []
    cells = [index for _, index in groups(points.cell)]
    while tries := _most(cells, maybe, left, popular):
        for one, plans in zip(tries, _confirmed(corridors, points, tries, maybe), strict=True):
            if left[plans].any():
                left[plans] = False
                cuts.append(_cut(scene, corridors.all[one.corridor], points.at(plans)))
        cells = [one.index for one in tries]
    return cuts


def _most(
    cells: Iterable[np.ndarray], maybe: np.ndarray, left: np.ndarray, popular: np.ndarray
) -> list[_Try]:
    """In each cell the corridor that may hold most of the plans left, if any."""
    tries = []
    for index in cells:
        gain = maybe[index[left[index]]].sum(axis=0) + popular
        best = int(np.argmax(gain)) if len(gain) else 0
        if len(gain) and gain[best] >= 1:
            tries.append(_Try(index, best, index[maybe[index, best]]))
    return tries


def _confirmed(
    corridors: Corridors, points: Points, tries: list[_Try], maybe: np.ndarray
) -> list[np.ndarray]:
    """Of each try the plans that satisfy its corridor; the others are struck from `maybe`."""
    sizes = [len(one.plans) for one in tries]
    plan = np.concatenate([one.plans for one in tries])
    corridor = np.repeat([one.corridor for one in tries], sizes)
    inside = corridors.kept_pairs(points.path, points.bin, plan, corridor)
    maybe[plan[~inside], corridor[~inside]] = False
    parts = np.split(inside, np.cumsum(sizes)[:-1])
    return [one.plans[part] for one, part in zip(tries, parts, strict=True)]


def _cut(scene: Scene, corridor: Corridor, inside: Points) -> SafePolytope:
    """The polytope around plans inside of it; as it is convex, their mean is inside too."""
    p0, k = inside.p0.mean(axis=0), inside.k.mean(axis=0)
    return SafePolytope(scene, p0, k, inside.pattern[0], inside.bin[0], corridor)


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
