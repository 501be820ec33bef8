"""What the errors of a tube take along directions: the only place where it is tabulated. [T14, T26]

Errors in boxes tell it in a few products, wherever it is asked; between fitted faces it takes many,
so it is worked out once per tube and set of directions, and looked up.
"""

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.base.arrays import once, x64
from parc_jax.claim.error_set import ErrorSet
from parc_jax.claim.tube import Tube


def reach(tube: Tube, w: np.ndarray, size: int | None = None, dtype=np.float64) -> jax.Array | None:
    """(size, n_bins, n_points, T) how far the errors of each bin, point and interval reach against
    directions w (u, n_p); zero beyond those, where a size asks for more. None for boxes.
    """
    if tube.templates is None:
        return None
    w = np.ascontiguousarray(w, np.float64)
    return once(tube, _reach, w.tobytes(), len(w) if size is None else size, np.dtype(dtype))


def errors_of(tube: Tube, dtype) -> ErrorSet:
    """The errors in another precision, where kernels find them; moved there once."""
    return once(tube, _errors, np.dtype(dtype))


def _errors(tube: Tube, dtype) -> ErrorSet:
    with x64():
        return jax.device_put(jax.tree.map(dtype.type, tube.errors))


def _reach(tube: Tube, directions: bytes, size: int, dtype) -> jax.Array:
    w = np.frombuffer(directions).reshape(-1, tube.n_p)
    padded = np.pad(w, ((0, size - len(w)), (0, 0))).astype(dtype)
    with x64():
        return _along(errors_of(tube, dtype), padded, np.int32(len(w)))


@jax.jit
def _along(errors, w, n):
    """Of the first n of w (u, n_p); errors (n_bins, T, n_points)."""
    w = jnp.asarray(w)
    n_bins, n_steps, n_points = errors.half.shape[:3]

    def of_one(u, lost):
        return lost.at[u].set(errors.support(-w[u]).swapaxes(1, 2))

    return jax.lax.fori_loop(0, n, of_one, jnp.zeros((len(w), n_bins, n_points, n_steps), w.dtype))
