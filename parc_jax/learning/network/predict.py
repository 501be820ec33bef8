"""Predictions of the network: one kernel for JAX, one function for NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Shaped

from parc_jax.learning.network.relu import ReLUNetwork, forward, outputs
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.system import BlackBoxSystem, Layout, points_of


def layout_of(source: BlackBoxSystem | RolloutBatch) -> Layout:
    """Layout for a black box, or a batch of its runs."""
    return Layout(source.time.n_steps, source.n_p, len(points_of(source)))


def predict(
    net: ReLUNetwork, layout: Layout, k: Float[ArrayLike, " n_k"]
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Kernel: offsets (T + 1, n_c) from p0, states (n_q,), activation pattern (n_hidden,) at k."""
    y, active = forward(net, k)
    knots = jnp.concatenate([jnp.zeros(layout.n_p, y.dtype), y[: layout.n_offsets]])
    return knots.reshape(-1, layout.n_c), y[layout.n_offsets :], active


def trajectories(net: ReLUNetwork, layout: Layout, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (n, T + 1, n_c) from p0 and further states (n, n_q) at k (n, n_k), on the host."""
    y = outputs(net, k)
    knots = np.concatenate([np.zeros((len(k), layout.n_p)), y[:, : layout.n_offsets]], axis=1)
    return knots.reshape(len(k), -1, layout.n_c), y[:, layout.n_offsets :]


def layer_from_the_end(net: ReLUNetwork, layout: Layout):
    """Rows (r, n) and constants (r,) of the last layer for all places, knot by knot, less the end
    of the first point, and for q. NumPy or JAX.
    """
    W, b, n_p = net.weights[-1], net.biases[-1], layout.n_p
    xp = jnp if isinstance(W, jax.Array) else np
    W, b = xp.concatenate([xp.zeros((n_p, W.shape[1])), W]), xp.concatenate([xp.zeros(n_p), b])
    n = layout.n_offsets + n_p
    end = n - layout.n_c + xp.arange(n) % n_p
    return tuple(xp.concatenate([x[:n] - x[end], x[n:]]) for x in (W, b))


def by_point(columns: Shaped[ArrayLike, "*b n_c"], n_points: int):
    """Coordinates (..., n_points, n_p) of each point, from columns (..., n_c)."""
    return columns.reshape(*columns.shape[:-1], n_points, columns.shape[-1] // n_points)


def moved_to(p0: Float[ArrayLike, "*b n_p"], offsets: Float[ArrayLike, "*b knots n_c"]):
    """Places (..., T + 1, n_c) of all points, from offsets (..., T + 1, n_c) and the place p0 (...,
    n_p) of the first one at the start. NumPy or JAX.
    """
    xp = jnp if isinstance(offsets, jax.Array) else np
    n_points = offsets.shape[-1] // p0.shape[-1]
    return xp.concatenate([p0] * n_points, axis=-1)[..., None, :] + offsets
