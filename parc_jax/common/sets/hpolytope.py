"""Polytopes in half-space form."""

import numpy as np
from jaxtyping import Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64, frozen
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box


@struct.dataclass
class HPolytope:
    """The set {x : A x <= b}. Build with `hpolytope`, which validates.

    A: (h, n) outward normals as given: nothing is rescaled. b: (h,) offsets.
    """

    A: Float[np.ndarray, "... h n"]
    b: Float[np.ndarray, "... h"]

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return self.A.shape[-1]

    def contains(self, x):
        """x (..., n) -> bool (...): closed membership in floats, no tolerance."""
        return (x @ self.A.T <= self.b).all(axis=-1)


def hpolytope(A, b) -> HPolytope:
    """Validated polytope from A (h, n), b (h,). Zero rows are refused. Raises InputError."""
    A = as_float64("polytope A", A, (None, None))
    b = as_float64("polytope b", b, (A.shape[0],))
    zero = ~A.any(axis=1)
    if zero.any():
        raise InputError(
            f"hpolytope: expected a nonzero normal in every row; row {int(np.argmax(zero))} is "
            "zero. Remove it."
        )
    return HPolytope(A, b)


def owned(p: HPolytope) -> HPolytope:
    """The same, in arrays that nobody else can change."""

    def own(x):
        if isinstance(x, np.ndarray) and x.base is None and not x.flags.writeable:
            return x
        return frozen(x)

    return HPolytope(own(p.A), own(p.b))


def from_box(b: Box) -> HPolytope:
    """The box as 2n rows: x <= hi first, then -x <= -lo."""
    eye = np.eye(b.n)
    return hpolytope(np.concatenate([eye, -eye]), np.concatenate([b.hi, -b.lo]))
