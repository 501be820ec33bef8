"""The pointwise test: is (p0, k) safe for every trajectory inside the tube? No region, no LP. [T11, T14]

Safe needs three positive proofs: goal margin, start margin, and a separating direction for every obstacle and interval,
each clearing the float slack. A comparison with NaN is False, so nothing undefined is ever safe.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import on_all_cores, x64
from parc_jax.avoid.segment import separations
from parc_jax.certify.scene import Scene
from parc_jax.error.tube import Tube
from parc_jax.model import TrajectoryModel
from parc_jax.network.relu import ReLUNetwork

CHUNK = 512  # points per compiled verdict: intermediates stay in cache, two calls run on two cores
CHUNK_ANCHOR = 2048  # points per compiled look at the goal alone, which is cheap
HIGHEST = jax.lax.Precision.HIGHEST


class Evaluation(NamedTuple):
    """Verdicts on a batch of points; leading axis b.

    path (b, T + 1, n_p), q (b, n_q): prediction. pattern (b, n_hidden) bool.
    bin (b,): bin of k, -1 on a shared boundary.
    goal, start, clearance (b,): margins [row units, row units, m], slack already subtracted.
    """

    path: np.ndarray
    q: np.ndarray
    pattern: np.ndarray
    bin: np.ndarray
    goal: np.ndarray
    start: np.ndarray
    clearance: np.ndarray

    @property
    def reaches(self) -> np.ndarray:
        """(b,) the goal is reached from an allowed start, whatever happens on the way."""
        return (self.goal >= 0) & (self.start >= 0) & (self.bin >= 0)

    @property
    def safe(self) -> np.ndarray:
        """(b,) proved in float64: reaches the goal and touches nothing."""
        return self.reaches & (self.clearance > 0)


def predict(net, n_steps: int, n_p: int, k):
    """Offsets (T + 1, n_p) from p0, further states (n_q,), activation pattern (n_hidden,) of one k (n_k,)."""
    active = []
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        z = jnp.matmul(W, k, precision=HIGHEST) + b
        active.append(z > 0)
        k = jnp.maximum(z, 0)
    y = jnp.matmul(net.weights[-1], k, precision=HIGHEST) + net.biases[-1]
    knots = y[: n_steps * n_p].reshape(n_steps, n_p)
    offsets = jnp.concatenate([jnp.zeros((1, n_p), knots.dtype), knots])
    return offsets, y[n_steps * n_p :], jnp.concatenate(active) if active else jnp.zeros(0, bool)


def bin_of(tube, k):
    """Bin of one k; -1 outside K or on a boundary between bins, where two tubes would have to hold."""
    number, known = jnp.asarray(0), jnp.asarray(True)
    for axis, edge in enumerate(tube.edges):
        edge = jnp.asarray(edge)
        cell = jnp.clip(jnp.searchsorted(edge, k[axis], side="right") - 1, 0, len(edge) - 2)
        on_inner_edge = (k[axis] == edge[1:-1]).any()
        known &= (k[axis] >= edge[0]) & (k[axis] <= edge[-1]) & ~on_inner_edge
        number = number * (len(edge) - 1) + cell
    return jnp.where(known, number, -1)


def row_margin(A, b, x, slack):
    """Smallest of b - A x over the rows, less the slack of each."""
    values = jnp.matmul(A, x, precision=HIGHEST)
    return jnp.min(b - values - slack * jnp.abs(A).sum(axis=1))


class Prediction(NamedTuple):
    """What the network says of one point, and whether it ends in the goal. Fields as in Evaluation."""

    path: jax.Array
    q: jax.Array
    pattern: jax.Array
    bin: jax.Array
    goal: jax.Array
    start: jax.Array

    @property
    def reaches(self):
        """The goal is reached from an allowed start, whatever happens on the way."""
        return (self.goal >= 0) & (self.start >= 0) & (self.bin >= 0)


def prediction(net: ReLUNetwork, tube: Tube, scene: Scene, p0, k) -> Prediction:
    """Path, pattern, bin, goal and start margins of one point p0 (n_p,), k (n_k,). Kernel."""
    offsets, q, pattern = predict(net, *tube.interval.shape[1:], k)
    path = p0[None] + offsets
    return Prediction(path, q, pattern, *arrival(tube, scene, p0, path[-1], q, k))


def arrival(tube: Tube, scene: Scene, p0, end, q, k):
    """Bin of k, goal margin and start margin of a plan from p0 (n_p,) to the predicted end (n_p,), q (n_q,). Kernel."""
    number = jnp.where(((k >= scene.k_lo) & (k <= scene.k_hi)).all(), bin_of(tube, k), -1)
    lost = jnp.matmul(jnp.abs(scene.goal_A), jnp.asarray(tube.final)[number], precision=HIGHEST)
    goal = row_margin(scene.goal_A, scene.goal_b - lost, jnp.concatenate([end, q]), scene.slack)
    return number, goal, row_margin(scene.start_A, scene.start_b, p0, scene.slack)


def verdict(net: ReLUNetwork, tube: Tube, scene: Scene, p0, k) -> Evaluation:
    """Everything about one point p0 (n_p,), k (n_k,). Kernel; vmap for batches."""
    seen = prediction(net, tube, scene, p0, k)
    return Evaluation(*seen, clearance(scene, seen.path, jnp.asarray(tube.interval)[seen.bin]))


def clearance(scene: Scene, path, error):
    """Smallest gap [m] of a path (T + 1, 2) with interval errors (T, 2) from all active obstacles, less the slack."""
    grown = scene.obstacles

    def one_obstacle(corner, sign, active):
        corners = corner[None] + sign[None] * error[:, None]
        gap, w = separations(path[:-1], path[1:], corners, grown.radius)
        return jnp.where(active, gap - scene.slack * jnp.abs(w).sum(axis=1), jnp.inf).min()

    return jax.vmap(one_obstacle)(grown.corner, grown.sign, grown.active).min()


def anchored(net: ReLUNetwork, tube: Tube, scene: Scene, z, k) -> tuple[jax.Array, jax.Array]:
    """Start p0 (n_p,) whose predicted end is z (n_p,), and whether it reaches the goal. Keeps volumes. [T15]"""
    offsets, _, _ = predict(net, *tube.interval.shape[1:], k)
    p0 = z - offsets[-1]
    return p0, prediction(net, tube, scene, p0, k).reaches


_verdicts = jax.jit(jax.vmap(verdict, in_axes=(None, None, None, 0, 0)))
_anchored = jax.jit(jax.vmap(anchored, in_axes=(None, None, None, 0, 0)))


def evaluate(model: TrajectoryModel, scene: Scene, p0, k) -> Evaluation:
    """Verdicts on p0 (b, n_p), k (b, n_k), as NumPy arrays."""
    return in_chunks(CHUNK, lambda p, x: _verdicts(model.net, model.tube, scene.arrays, p, x), p0, k)


def paths_of(model: TrajectoryModel, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Predicted paths (b, T + 1, n_p) of p0 (b, n_p), k (b, n_k), on the host: a hint for certificates, no verdict."""
    x = k
    for W, b in zip(model.net.weights[:-1], model.net.biases[:-1], strict=True):
        x = np.maximum(x @ W.T + b, 0.0)
    n_steps, n_p = model.tube.interval.shape[1:]
    offsets = (x @ model.net.weights[-1].T + model.net.biases[-1])[:, : n_steps * n_p].reshape(-1, n_steps, n_p)
    return p0[:, None] + np.pad(offsets, ((0, 0), (1, 0), (0, 0)))


def anchor(model: TrajectoryModel, scene: Scene, z, k) -> tuple[np.ndarray, np.ndarray]:
    """Starts (b, n_p) whose predicted ends are z (b, n_p), and which of them reach the goal (b,). No obstacle test."""
    return in_chunks(CHUNK_ANCHOR, lambda p, x: _anchored(model.net, model.tube, scene.arrays, p, x), z, k)


def in_chunks(size: int, call, *batch):
    """Run a compiled call over fixed-size chunks on all cores; the last chunk is padded with its own last row."""
    n = len(batch[0])
    rows = np.minimum(np.arange(-(-max(n, 1) // size) * size), max(n - 1, 0)).reshape(-1, size)
    if n == 0:
        batch = [np.zeros((1, np.shape(x)[1])) for x in batch]

    def one(index):
        with x64():
            return jax.device_get(call(*(np.asarray(x)[index] for x in batch)))

    return jax.tree.map(lambda *xs: np.concatenate(xs)[:n], *on_all_cores(one, rows))
