"""Axis-aligned boxes."""

import numpy as np
from jaxtyping import Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import exact


@struct.dataclass
class Box:
    """The set {x : lo <= x <= hi}; lo, hi: (n,) float64. Build with `box`, which validates."""

    lo: Float[np.ndarray, "... n"]
    hi: Float[np.ndarray, "... n"]

    @property
    def n(self) -> int:
        """Dimension."""
        return self.lo.shape[-1]

    @property
    def center(self) -> np.ndarray:
        """Centre (n,)."""
        return 0.5 * (self.lo + self.hi)

    @property
    def radius(self) -> np.ndarray:
        """Half widths (n,)."""
        return 0.5 * (self.hi - self.lo)

    @property
    def volume(self):
        """Product of the widths."""
        return (self.hi - self.lo).prod(axis=-1)

    @property
    def text(self) -> str:
        """In exact numbers: "[0, 1] x [-2, 2.5]"."""
        return " x ".join(
            f"[{exact(a)}, {exact(b)}]" for a, b in zip(self.lo, self.hi, strict=True)
        )

    def contains(self, x):
        """x (..., n) -> bool (...): closed membership, no tolerance."""
        return ((x >= self.lo) & (x <= self.hi)).all(axis=-1)


def box(lo, hi) -> Box:
    """Validated box: finite, lo <= hi in every axis. Raises InputError."""
    lo = as_float64("box lower corner", lo, (None,))
    hi = as_float64("box upper corner", hi, lo.shape)
    if not (lo <= hi).all():
        axis = int(np.argmax(lo > hi))
        raise InputError(
            f"box: expected lo <= hi in every axis; axis {axis} has lo = {lo[axis]:g} > hi = "
            f"{hi[axis]:g}. Swap the two corners?"
        )
    return Box(lo, hi)
