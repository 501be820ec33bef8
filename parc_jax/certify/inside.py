"""Which points are inside which pieces: one compiled test over (point, piece) pairs of equal cells."""

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import x64
from parc_jax.avoid.segment import dot2

CHUNK = 1024  # pairs per compiled call


def inside(path, w, need):
    """path (T + 1, 2), w (o, T, 2), need (o, T) -> bool: w . p > need at both ends of every interval. Kernel."""
    start, end = dot2(w, path[None, :-1]), dot2(w, path[None, 1:])
    return (jnp.minimum(start, end) > need).all()


_inside_pairs = jax.jit(
    lambda path, w, need, at, of: jax.vmap(inside)(path[at], w[of], need[of])
)  # gathers on the device


def inside_pairs(path, w, need, at, of) -> np.ndarray:
    """Pairs: point at[i] of path (b, T + 1, 2) in piece of[i] of w (n, o, T, 2), need (n, o, T) -> bool (pairs,)."""
    out = np.zeros(len(at), bool)
    for first in range(0, len(at), CHUNK):
        rows = slice(first, first + CHUNK)
        points, which = np.unique(at[rows], return_inverse=True)
        pieces, whose = np.unique(of[rows], return_inverse=True)
        with x64():
            got = _inside_pairs(
                _pad(path[points]), _pad(w[pieces]), _pad(need[pieces], np.inf), _pad(which), _pad(whose)
            )
        out[rows] = np.asarray(got)[: len(which)]
    return out


def _pad(x: np.ndarray, fill=0) -> np.ndarray:
    """Fill up to CHUNK rows: one compiled shape."""
    return np.concatenate([x, np.full((CHUNK - len(x), *x.shape[1:]), fill, x.dtype)]) if len(x) < CHUNK else x
