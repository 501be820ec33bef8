"""One cell (region and bin) as an affine model: its rows and its offsets. Kernels."""

import jax
import jax.numpy as jnp
from flax import struct

from parc_jax.certify.evaluate import HIGHEST


@struct.dataclass
class CellMap:
    """The network on one activation pattern.

    region_A (h, n_k), region_b (h,): rows of the region. C (T + 1, n_p, n_k), d (T + 1, n_p): offsets, zero at the
    start. q_C (n_q, n_k), q_d (n_q,): further goal states.
    """

    region_A: jax.Array
    region_b: jax.Array
    C: jax.Array
    d: jax.Array
    q_C: jax.Array
    q_d: jax.Array


def cell_map(net, pattern, n_steps: int, n_p: int) -> CellMap:
    """Affine map and region rows of an activation pattern (n_hidden,)."""
    C, d = jnp.eye(net.n_in, dtype=float), jnp.zeros(net.n_in)
    rows, bounds, at = [jnp.zeros((0, net.n_in))], [jnp.zeros(0)], 0
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        C, d = jnp.matmul(W, C, precision=HIGHEST), jnp.matmul(W, d, precision=HIGHEST) + b
        on = pattern[at : at + len(b)]
        at += len(b)
        sign = jnp.where(on, -1.0, 1.0)
        rows.append(sign[:, None] * C)
        bounds.append(-sign * d)
        C, d = jnp.where(on[:, None], C, 0.0), jnp.where(on, d, 0.0)
    C = jnp.matmul(net.weights[-1], C, precision=HIGHEST)
    d = jnp.matmul(net.weights[-1], d, precision=HIGHEST) + net.biases[-1]
    split = n_steps * n_p
    knots_C = jnp.concatenate([jnp.zeros((1, n_p, net.n_in)), C[:split].reshape(n_steps, n_p, -1)])
    knots_d = jnp.concatenate([jnp.zeros((1, n_p)), d[:split].reshape(n_steps, n_p)])
    return CellMap(jnp.concatenate(rows), jnp.concatenate(bounds), knots_C, knots_d, C[split:], d[split:])


def anchored_rows(scene, cell: CellMap, final, bin_lo, bin_hi):
    """Rows A (h, n_p + n_k), b (h,) of the cell's goal-reaching set: bin, region, shrunken goal, start set."""
    n_p, n_k = cell.C.shape[1:]
    eye, none = jnp.eye(n_k, dtype=float), jnp.zeros((n_k, n_p))
    goal_p, goal_q = scene.goal_A[:, :n_p], scene.goal_A[:, n_p:]
    goal_k = jnp.matmul(goal_p, cell.C[-1], precision=HIGHEST) + jnp.matmul(goal_q, cell.q_C, precision=HIGHEST)
    at_zero = jnp.matmul(goal_p, cell.d[-1], precision=HIGHEST) + jnp.matmul(goal_q, cell.q_d, precision=HIGHEST)
    goal_b = scene.goal_b - jnp.matmul(jnp.abs(scene.goal_A), final, precision=HIGHEST) - at_zero
    A = [
        jnp.concatenate([none, eye], axis=1),
        jnp.concatenate([none, -eye], axis=1),
        jnp.concatenate([jnp.zeros((len(cell.region_b), n_p)), cell.region_A], axis=1),
        jnp.concatenate([goal_p, goal_k], axis=1),
        jnp.concatenate([scene.start_A, jnp.zeros((len(scene.start_b), n_k))], axis=1),
    ]
    b = jnp.concatenate([jnp.asarray(bin_hi), -jnp.asarray(bin_lo), cell.region_b, goal_b, scene.start_b])
    return jnp.concatenate(A), b
