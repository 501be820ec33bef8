"""The pointwise test: is (p0, k) safe for every trajectory in the tube? No region or LP. [T11, T14]

Safe needs three positive proofs: goal margin, start margin, and a separating direction for every
obstacle and interval, each clearing the rounding tolerance. A comparison with NaN is False, and
`least` turns NaN into -inf before any minimum, so nothing undefined is ever safe.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common.arrays import least, map_rows, once, product, x64
from parc_jax.common.backend import compiled
from parc_jax.common.shapes import (
    Index,
    Knot,
    ManyParams,
    Numbers,
    Params,
    Path,
    Positions,
    Scalar,
    Vector,
)
from parc_jax.learning.bound.bins import each_bin, open_bin_of
from parc_jax.learning.bound.error_set import ErrorSet
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import moved_to, predict, trajectories
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.separation.pairs import Obstacles, Pair
from parc_jax.safe_set.verdict.scene import Scene, SceneArrays

CHUNK = 512  # points per compiled verdict: intermediates stay in cache, two calls run on two cores
CHUNK_ANCHOR = 2048  # points per compiled look at the goal alone, which is cheap
AT_ONCE = 8  # obstacles that a first look asks how far they are away

Bin = Index | None  # that holds k; None = the only one, and k is on no border


class Verdicts(NamedTuple):
    """Verdicts on a batch of points; leading axis b.

    path (b, T + 1, n_c), q (b, n_q): prediction. pattern (b, n_hidden) bool.
    bin (b,): bin of k, the first of several; -1 outside K, and for draws on a shared boundary.
    goal, start, clearance (b,): margins [row units, row units, m], slack already subtracted. Of a
        prediction, which tests no obstacle, clearance is None, and `safe` an error.
    """

    path: np.ndarray
    q: np.ndarray
    pattern: np.ndarray
    bin: np.ndarray
    goal: np.ndarray
    start: np.ndarray
    clearance: np.ndarray | None = None

    @property
    def reaches(self) -> np.ndarray | jax.Array:
        """(b,) the goal is reached from an allowed start; obstacles do not count."""
        return (self.goal >= 0) & (self.start >= 0) & (self.bin >= 0)

    @property
    def safe(self) -> np.ndarray | jax.Array:
        """(b,) proved in float64: reaches the goal and touches nothing."""
        return self.reaches & (self.clearance > 0)

    @property
    def room(self) -> np.ndarray:
        """(b,) least margin, > 0 only for safe plans; -inf where one is undefined. On the host."""
        least = np.minimum(np.minimum(self.goal, self.start), self.clearance)
        return np.where((self.bin >= 0) & ~np.isnan(least), least, -np.inf)


def row_margin(
    A: Float[ArrayLike, "h n"], b: Float[ArrayLike, " h"], x: Float[ArrayLike, " n"], slack: Scalar
):
    """Smallest of b - A x over the rows, less the slack of each."""
    return least(b - product(A, x) - slack * jnp.abs(A).sum(axis=1))


def prediction(
    net: ReLUNetwork, tube: Tube, scene: SceneArrays, p0: Vector, k: Params, bin: Bin = None
) -> Verdicts:
    """Path, pattern, bin, goal and start margins of one plan. bin: as of `arrival`. Kernel."""
    offsets, q, pattern = predict(net, tube.layout, k)
    path = moved_to(p0, offsets)
    return Verdicts(path, q, pattern, *arrival(tube, scene, p0, path[-1], q, k, bin))


def arrival(
    tube: Tube,
    scene: SceneArrays,
    p0: Vector,
    end: Knot,
    q: Float[ArrayLike, " n_q"],
    k: Params,
    bin: Bin = None,
    lost: Float[ArrayLike, "n_bins g"] | None = None,
):
    """Bin of k, goal margin and start margin of a plan from p0 to the predicted end, q. bin: one
    that contains k; None = the only one, and none on a border. lost: as of `anchored`. Kernel.
    """
    bin = open_bin_of(tube.edges, k) if bin is None else bin
    lo, at, hi = map(ordered, (scene.k_lo, k, scene.k_hi))
    bin = jnp.where(((lo <= at) & (at <= hi)).all(), bin, -1)
    lost = tube.support_at_end(scene.goal_A, bin) if lost is None else lost[bin]
    goal = row_margin(scene.goal_A, scene.goal_b - lost, jnp.concatenate([end, q]), scene.slack)
    first = end[: p0.shape[0]]
    inside = least(jnp.minimum(first - scene.z_lo, scene.z_hi - first))
    goal = jnp.where(inside < 0, jnp.minimum(goal, inside), goal)  # rows may overflow far out [T11]
    return bin, goal, row_margin(scene.start_A, scene.start_b, p0, scene.slack)


def ordered(x: Float[ArrayLike, " n"]) -> jax.Array:
    """Whole numbers in the order of x, from its bits: numbers so small that a processor may take
    them for zero lie on their own side of it. Kernel.
    """
    bits = jax.lax.bitcast_convert_type(jnp.asarray(x, float), jnp.result_type(int))
    return jnp.where(bits < 0, jnp.iinfo(bits.dtype).min - bits, bits)  # of -0 as of 0


def verdict(
    net: ReLUNetwork, tube: Tube, scene: SceneArrays, p0: Vector, k: Params, bin: Bin = None
) -> Verdicts:
    """Everything about one plan. bin: as of `arrival`. Kernel; vmap for batches."""
    seen = prediction(net, tube, scene, p0, k, bin)
    return seen._replace(clearance=clearance(scene, seen.path, tube.during(seen.bin)))


def verdict_in_turn(
    net: ReLUNetwork,
    tube: Tube,
    scene: SceneArrays,
    p0: Vector,
    k: Params,
    bins: Numbers,
    n_bins: Index | int,
    first: Index,
) -> tuple[Verdicts, jax.Array, jax.Array]:
    """The same, pair by pair, the nearest bounding boxes first: until all others are farther than
    the least gap so far, or one is touched. The clearance of a safe plan is that of all pairs.
    Kernel, not for vmap.

    bins: the first n_bins contain k, whose errors together one direction has to allow for, as a
    proof has it [T28]. first: the pair tested first, negative for the nearest box.
    Returns also the pair that the plan touches, which a plan beside it may touch as well, and the
    number of pairs tested, which is nearly all of the work.
    """
    seen = prediction(net, tube, scene, p0, k, bins[0])

    def with_bin(c: Index, known: tuple):
        errors, goal = known
        _, own, _ = arrival(tube, scene, p0, seen.path[-1], seen.q, k, bins[c])
        return errors.wider(tube.during(bins[c])), jnp.minimum(goal, own)

    known = tube.during(seen.bin), seen.goal
    errors, goal = jax.lax.fori_loop(1, n_bins, with_bin, known)
    seen = seen._replace(goal=goal)
    rounding = 2 * scene.slack * p0.shape[0]

    def look(state: tuple):
        away, nearest, o, looks = state
        away = away.at[o].set(jnp.inf)
        nearest = _nearer(scene, o, seen.path, errors, nearest)
        return away, nearest, jnp.where(nearest > 0, _first_of(away), o), looks + 1

    def open_still(state: tuple):
        away, nearest, _, _ = state
        return seen.reaches & (least(away) < nearest) & (nearest > 0)

    # mostly the given pair is touched, and how far all others are away is not asked
    far, given = _far(scene, seen.path), (first >= 0) & seen.reaches
    near = jax.lax.cond(given, lambda: _nearer(scene, first, seen.path, errors, far), lambda: far)
    none = jnp.full(len(scene.obstacles.active), jnp.inf, far.dtype)
    away = jax.lax.cond(near > 0, lambda: _away(scene, seen.path, errors) - rounding, lambda: none)
    away = jnp.where(given, away.at[first].set(jnp.inf), away)
    begin = away, near, jnp.where(near > 0, _first_of(away), first), given.astype(jnp.int32)
    _, nearest, touched, looks = jax.lax.while_loop(open_still, look, begin)
    return seen._replace(clearance=nearest), touched, looks


def _away(scene: SceneArrays, path: Path, errors: ErrorSet):
    """`Obstacles.away`, a few at a time, of those that are there: room for more costs nothing."""
    n = len(scene.obstacles.active)
    few = min(n, AT_ONCE)

    def look(i: jax.Array, away: jax.Array) -> jax.Array:
        some = jax.tree.map(
            lambda x: jax.lax.dynamic_slice_in_dim(jnp.asarray(x), i * few, few), scene.obstacles
        )
        # both begin earlier where no whole step is left
        return jax.lax.dynamic_update_slice_in_dim(away, some.away(path, errors), i * few, 0)

    return jax.lax.fori_loop(0, -(-scene.count // few), look, jnp.full(n, jnp.inf, path.dtype))


def clearance(scene: SceneArrays, path: Path, errors: ErrorSet):
    """Least gap [m] of a plan that reaches the goal from all active obstacles, less the slack."""
    if scene.count is None:  # of a batch, where all are looked at side by side
        return jnp.minimum(_nearest(scene, scene.obstacles, path, errors), _far(scene, path))

    def look(o: Index, nearest: Scalar):
        return jnp.minimum(nearest, _nearest(scene, scene.obstacles.only(o), path, errors))

    return jax.lax.fori_loop(0, scene.count, look, _far(scene, path))


def _first_of(away: jax.Array) -> jax.Array:
    return jnp.argmin(away).astype(jnp.int32)


def _nearer(scene: SceneArrays, o: Index, path: Path, errors: ErrorSet, nearest: Scalar):
    pair, until = scene.obstacles.only(o), nearest + 2 * scene.slack  # what is farther is no nearer
    return jnp.minimum(nearest, _least(scene, pair, *pair.gaps(path, errors, until)))


def _nearest(scene: SceneArrays, obstacles: Obstacles | Pair, path: Path, errors: ErrorSet):
    """The smallest gap from one or all of a scene's obstacles."""
    return _least(scene, obstacles, *obstacles.gaps(path, errors))


def _least(scene: SceneArrays, obstacles: Obstacles | Pair, gap: jax.Array, w: jax.Array):
    gap = gap - scene.slack * jnp.abs(w).sum(axis=-1)
    return least(jnp.where(obstacles.active, gap, jnp.inf))


def _far(scene: SceneArrays, path: Path):
    """How far all else is away; -inf for a path that is not finite."""
    return jnp.where(jnp.isfinite(path).all(), jnp.asarray(scene.beyond, path.dtype), -jnp.inf)


def end_network(model: TrajectoryModel) -> ReLUNetwork:
    """The network with the outputs of the first knot, the last one and q alone."""
    net, n = model.net, model.layout.n_offsets
    first = model.n_c - model.n_p  # at the start the first point has no output
    rows = np.r_[:first, n - model.n_c : len(net.biases[-1])]
    short = [(*part[:-1], part[-1][rows]) for part in (net.weights, net.biases)]
    return net.replace(weights=short[0], biases=short[1])


def anchored(
    end: ReLUNetwork,
    tube: Tube,
    scene: SceneArrays,
    z: Vector | None,
    k: Params,
    at: Vector | None = None,
    lost: Float[ArrayLike, "n_bins g"] | None = None,
) -> tuple[jax.Array, jax.Array]:
    """The start (n_p,) from which the first point is predicted to end at z (n_p,), and whether
    that plan reaches the goal. Preserves volumes. Kernel. [T15]

    end: as of `end_network`. at: (n_p,) [m] a start, z is not read then. lost: of all bins' errors.
    """
    offsets, q, _ = predict(end, tube.layout._replace(n_steps=1), k)
    p0 = z - offsets[-1, : len(z)] if at is None else at
    bin, goal, start = arrival(tube, scene, p0, moved_to(p0, offsets)[-1], q, k, lost=lost)
    return p0, (goal >= 0) & (start >= 0) & (bin >= 0)


_verdicts = compiled(jax.vmap(verdict, in_axes=(None, None, None, 0, 0, 0)))
_predictions = jax.jit(jax.vmap(prediction, in_axes=(None, None, None, 0, 0)))


@compiled
def _anchored(end: ReLUNetwork, tube: Tube, scene: SceneArrays, z: Positions, k: ManyParams):
    lost = jax.vmap(partial(tube.support_at_end, scene.goal_A))(jnp.arange(tube.n_bins))
    return jax.vmap(lambda z, k: anchored(end, tube, scene, z, k, lost=lost))(z, k)


def verdicts(scene: Scene, p0: Positions, k: ManyParams) -> Verdicts:
    """Verdicts on plans, in NumPy; on an edge between bins the least of each margin. [T28]"""
    model = scene.model
    rows, bins = each_bin(model.tube.edges, k)
    one = partial(_verdicts, model.net, model.tube, scene.arrays)
    seen = map_rows(CHUNK, one, np.asarray(p0)[rows], np.asarray(k)[rows], bins)
    if len(rows) == len(k):
        return seen
    first = np.flatnonzero(np.diff(rows, prepend=-1))
    least = {
        name: np.minimum.reduceat(getattr(seen, name), first) for name in ("goal", "clearance")
    }
    return Verdicts(*(x[first] for x in seen))._replace(**least)


def predictions(scene: Scene, p0: Positions, k: ManyParams) -> Verdicts:
    """Predictions of plans, in NumPy, without the test of obstacles, which is most of a verdict."""
    one = partial(_predictions, scene.model.net, scene.model.tube, scene.arrays)
    return map_rows(CHUNK_ANCHOR, one, p0, k)


def paths_of(model: TrajectoryModel, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Predicted paths (b, T + 1, n_c) on the host: a hint for certificates, no verdict."""
    return moved_to(p0, trajectories(model.net, model.layout, k)[0])


def anchor(scene: Scene, z: Positions, k: ManyParams) -> tuple[np.ndarray, np.ndarray]:
    """Starts (b, n_p) with predicted ends z, and which reach the goal (b,). No obstacle test."""
    end, tube = once(scene.model, end_network), on_device(scene.model.tube)
    return map_rows(CHUNK_ANCHOR, partial(_anchored, end, tube, scene.arrays), z, k)


def on_device(tube: Tube) -> Tube:
    """The tube where kernels find it; fitted errors are large, and moved there once."""
    return tube if tube.templates is None else once(tube, _moved)


def _moved(tube: Tube) -> Tube:
    with x64():
        return jax.device_put(tube)
