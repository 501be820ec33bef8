"""What is in the way of plans: how much room each obstacle, and each side of the goal and of the
start set, leaves a plan. [T14]

The inequality is that of the verdicts, for each side alone. It explains, and decides nothing:
where body and obstacle overlap, the depth is that along the best direction that was tried.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import least, map_rows, product
from parc_jax.common.shapes import Index, ManyParams, Params, Positions, Scalar, Vector
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.bound.tube import Tube, zero_tube
from parc_jax.learning.network.predict import by_point
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.separation.inequality import at_both_knots, excess, height
from parc_jax.safe_set.verdict.pointwise import paths_of, prediction
from parc_jax.safe_set.verdict.scene import ROOM, Scene, SceneArrays, padded

CHUNK = 64  # plans per compiled call


class Rooms(NamedTuple):
    """What each side leaves of each plan (b,), negative by how much it is in the way.

    goal (b, g), start (b, s): [row units over the row's length] infinite for rows that pad. gap
    (b, o) [m]: of every pair of an obstacle and a part, at least as much where it is positive,
    infinite where it only pads; when (b, o): the interval of a gap that is not. known (b,): the
    errors of k are claimed.
    """

    goal: np.ndarray
    start: np.ndarray
    gap: np.ndarray
    when: np.ndarray
    known: np.ndarray

    @property
    def least(self) -> np.ndarray:
        """(b,) the least of all, -inf where nothing is known of the errors."""
        all_ = np.concatenate([self.goal, self.start, self.gap], axis=1)
        return np.where(self.known, least(all_, axis=1), -np.inf)


def _rooms(net: ReLUNetwork, tube: Tube, scene: SceneArrays, p0: Vector, k: Params) -> Rooms:
    seen = prediction(net, tube, scene, p0, k)
    bin = jnp.maximum(seen.bin, 0)
    lost = tube.support_at_end(scene.goal_A, bin)
    end = jnp.concatenate([seen.path[-1], seen.q])
    goal = _of_rows(scene.goal_A, scene.goal_b - lost, end, scene.slack)
    start = _of_rows(scene.start_A, scene.start_b, p0, scene.slack)
    errors = tube.during(bin)

    # what boxes leave is a lower bound, and enough where it is positive: a search costs much
    active, radius = jnp.asarray(scene.obstacles.active), jnp.asarray(scene.obstacles.radius)
    boxes = scene.obstacles.box_gaps(seen.path, errors).max(axis=0) - radius[:, None] - scene.slack
    boxes = jnp.where(active, jnp.where(boxes == boxes, boxes, -jnp.inf), jnp.inf)
    near = jnp.argsort(boxes.min(axis=1))

    def unknown(state: tuple):
        gaps, known = state
        t = jnp.argmin(gaps)
        return ~known[t] & (gaps[t] <= 0)

    def look(i: Index, state: tuple):
        o = near[i]

        def search(state: tuple):
            gaps, known = state
            t = jnp.argmin(gaps)
            gap, w = scene.obstacles.gap(o, seen.path[t], seen.path[t + 1], tube.during(bin, t))
            gap = jnp.maximum(gap - scene.slack * jnp.abs(w).sum(), gaps[t])
            return gaps.at[t].set(gap), known.at[t].set(True)

        gaps, _ = jax.lax.while_loop(unknown, search, (boxes[o], jnp.zeros_like(active[o])))
        t = jnp.argmin(gaps).astype(jnp.int32)
        return state[0].at[o].set(gaps[t]), state[1].at[o].set(t)

    far = boxes.min(axis=1), jnp.zeros(len(near), jnp.int32)
    gap, when = jax.lax.fori_loop(0, (far[0] <= 0).sum(), look, far)
    return Rooms(goal, start, gap, when, (seen.bin >= 0) & jnp.isfinite(lost).all())


def _of_rows(A: Float[jax.Array, "h n"], b: Float[jax.Array, " h"], x: Vector, slack: Scalar):
    """(h,) b - A x less the slack of each row, over its length; infinite for 0 x <= b."""
    A = jnp.asarray(A)
    size = jnp.sqrt((A * A).sum(axis=1))
    left = b - product(A, x) - slack * jnp.abs(A).sum(axis=1)
    return jnp.where(size > 0, left / jnp.where(size > 0, size, 1), jnp.inf)


_many = jax.jit(jax.vmap(_rooms, in_axes=(None, None, None, 0, 0)))


def rooms(scene: Scene, p0: Positions, k: ManyParams, tube: Tube | None = None) -> Rooms:
    """Of plans p0 (b, n_p), k (b, n_k), on the host. tube: in place of the model's."""
    model = scene.model
    tube = model.tube if tube is None else tube
    arrays = padded(scene, ROOM, 2**model.n_p).arrays
    return map_rows(CHUNK, lambda p0, k: _many(model.net, tube, arrays, p0, k), p0, k)


def without_errors(tube: Tube) -> Tube:
    """The tube of the same bins that allows no error."""
    return zero_tube(tube.edges, tube.n_steps, tube.n_c, tube.final.shape[1], tube.n_points)


def deepest(scene: Scene, plan: np.ndarray, o: int, tube: Tube) -> tuple[float, int, np.ndarray]:
    """What pair o leaves of one plan (n_p + n_k,): gap [m], interval, unit direction (n_p,). Along
    all directions of the scene's table, of which a depth needs more than a verdict does.
    """
    n_p, table = scene.model.n_p, scene.directions
    path = paths_of(scene.model, plan[None, :n_p], plan[None, n_p:])[0]
    points = scene.obstacles.points[o]
    own = at(tube.during(tube.bin_of(plan[n_p:])), np.s_[:, points])
    size = np.linalg.norm(table.w[o], axis=1)
    w = table.w[o][size > 0] / size[size > 0, None]
    support = table.support[o][size > 0] / size[size > 0]
    places = np.moveaxis(by_point(path, tube.n_points)[:, points], 2, 0)
    heights = height(w.T[..., None, None], places[:, None])
    lost = np.stack([own.support(-v) for v in w])
    gaps = (excess(at_both_knots(heights, 1), support[:, None, None]) - lost).min(axis=2)
    gaps = np.where(scene.obstacles.active[o], gaps, np.inf)
    t = int(gaps.max(axis=0).argmin())
    d = int(gaps[:, t].argmax())
    return float(gaps[d, t]), t, w[d]
