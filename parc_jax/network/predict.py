"""What the network says of an input: one kernel for JAX, one function for NumPy, for everybody."""

import jax
import jax.numpy as jnp
import numpy as np

HIGHEST = jax.lax.Precision.HIGHEST  # accelerators round inputs of products to fewer bits otherwise


def forward(weights, biases, x) -> tuple[jax.Array, jax.Array]:
    """Outputs (n_out,) and activation pattern (n_hidden,) bool of one input x (n_in,). Kernel."""
    active = [jnp.zeros(0, bool)]
    for W, b in zip(weights[:-1], biases[:-1], strict=True):
        z = jnp.matmul(W, x, precision=HIGHEST) + b
        active.append(z > 0)
        x = jnp.maximum(z, 0)
    return jnp.matmul(weights[-1], x, precision=HIGHEST) + biases[-1], jnp.concatenate(active)


def predict(net, n_steps: int, n_p: int, k) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Offsets (T + 1, n_p) from p0, further states (n_q,), activation pattern (n_hidden,) of one k
    (n_k,). Kernel; vmap for batches.
    """
    y, active = forward(net.weights, net.biases, k)
    knots = y[: n_steps * n_p].reshape(n_steps, n_p)
    offsets = jnp.concatenate([jnp.zeros((1, n_p), knots.dtype), knots])
    return offsets, y[n_steps * n_p :], active


def features(weights, biases, x: np.ndarray) -> np.ndarray:
    """Values (n, width) after the given hidden layers at inputs x (n, n_in), on the host."""
    for W, b in zip(weights, biases, strict=True):
        x = np.maximum(x @ W.T + b, 0.0)
    return x


def outputs(net, k: np.ndarray, rows: slice = slice(None)) -> np.ndarray:
    """Network outputs (n, n_out) at k (n, n_k), on the host in float64. rows: outputs wanted."""
    h = features(net.weights[:-1], net.biases[:-1], k)
    return h @ net.weights[-1][rows].T + net.biases[-1][rows]


def trajectories(net, n_steps: int, n_p: int, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (n, T + 1, n_p) from p0 and further states (n, n_q) at k (n, n_k), on the host."""
    y = outputs(net, k)
    knots = y[:, : n_steps * n_p].reshape(len(k), n_steps, n_p)
    offsets = np.concatenate([np.zeros((len(k), 1, n_p)), knots], axis=1)
    return offsets, y[:, n_steps * n_p :]
