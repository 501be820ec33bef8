"""Support of the errors of a tube along fixed directions, for boxes and fitted faces. [T14, T26]

For boxes it takes a few products, computed where needed; between faces it takes many, so it is
tabulated once per tube and set of directions.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int
from numpy.typing import DTypeLike

from parc_jax.common import struct
from parc_jax.common.arrays import once, x64
from parc_jax.common.shapes import Index, Indices, Vector
from parc_jax.learning.bound.error_set import ErrorSet
from parc_jax.learning.bound.tube import Tube

ROOM = 128  # bins


@struct.dataclass
class Reach:
    """Error support against u directions, in all bins; `of` selects bins.

    half: (n_bins, n_points, n_p, T) [m] half widths of boxes; None between faces. lost: (u, n_bins,
        n_points, T) support against each direction; None for boxes. bin: (...) selected bins, in
        place of the first axis of `half`.
    """

    half: jax.Array | None
    lost: jax.Array | None
    bin: jax.Array | None = None

    def of(self, bin: Indices) -> "Reach":
        """Restriction to bins (...). Kernel."""
        half = None if self.half is None else jnp.asarray(self.half)[bin]
        return self.replace(half=half, bin=bin)

    def along(self, number: Index, w: Vector, point: Index | slice = slice(None)):
        """(..., n_points, T) against the direction w of this number, in the selected bins; of one
        point (..., T). Kernel.
        """
        if self.lost is not None:
            return self.lost[number, self.bin, point]
        return sum(jnp.abs(w[axis]) * self.half[..., point, axis, :] for axis in range(len(w)))

    def during(self, intervals: Int[ArrayLike, " s"], kernel: bool = False) -> "Reach":
        """Restriction to intervals, on the host; on the device in a kernel."""
        both, xp = (self.half, self.lost), jnp if kernel else np
        half, lost = (None if x is None else xp.asarray(x)[..., intervals] for x in both)
        return self.replace(half=half, lost=lost)


def reach(
    tube: Tube, w: np.ndarray, size: int | None = None, dtype: DTypeLike = np.float64
) -> Reach:
    """Support against directions w (u, n_p), padded with zeros to `size`; cached on the device."""
    if tube.templates is None:
        return once(tube, _half, np.dtype(dtype))
    w = np.ascontiguousarray(w, np.float64)
    return once(tube, _lost, w.tobytes(), len(w) if size is None else size, np.dtype(dtype))


def numbered(w: np.ndarray, room: int) -> tuple[np.ndarray, np.ndarray]:
    """Distinct directions (u, n_p) in w (o, d, n_p), index of each (room, d), zero in padding."""
    unique, which = np.unique(w.reshape(-1, w.shape[-1]), axis=0, return_inverse=True)
    number = np.zeros((room, w.shape[1]), int)
    number[: len(w)] = which.reshape(w.shape[:2])
    return unique, number


def in_room(tube: Tube) -> ErrorSet:
    """The errors with room for more bins, each the last one again: models of few bins and of one
    share compiled programs. Not between faces, where a bin takes much more.
    """
    more = 0 if tube.templates is not None else max(0, ROOM - tube.n_bins)
    return jax.tree.map(
        lambda x: np.pad(x, ((0, more), *[(0, 0)] * (x.ndim - 1)), mode="edge"), tube.errors
    )


def placed_errors(tube: Tube, dtype: np.dtype) -> ErrorSet:
    """The errors in another precision, on the device."""
    with x64():
        return jax.device_put(jax.tree.map(dtype.type, in_room(tube)))


def _half(tube: Tube, dtype: np.dtype) -> Reach:
    half = np.ascontiguousarray(np.moveaxis(in_room(tube).half, 1, -1), dtype)
    with x64():
        return Reach(jax.device_put(half), None)


def _lost(tube: Tube, directions: bytes, size: int, dtype: np.dtype) -> Reach:
    w = np.frombuffer(directions).reshape(-1, tube.n_p)
    padded = np.pad(w, ((0, size - len(w)), (0, 0))).astype(dtype)
    with x64():
        return Reach(None, _along(once(tube, placed_errors, dtype), padded, np.int32(len(w))))


@jax.jit
def _along(errors: ErrorSet, w: Float[ArrayLike, "u n_p"], n: Index):
    """(u, n_bins, n_points, T) of the first n of w; errors (n_bins, T, n_points)."""
    w = jnp.asarray(w)
    n_bins, n_steps, n_points = errors.half.shape[:3]

    def of_one(u: Index, lost: jax.Array):
        return lost.at[u].set(errors.support(-w[u]).swapaxes(1, 2))

    return jax.lax.fori_loop(0, n, of_one, jnp.zeros((len(w), n_bins, n_points, n_steps), w.dtype))
