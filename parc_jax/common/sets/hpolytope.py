"""Polytopes in half-space form."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError, naming
from parc_jax.common.sets.box import Box, box


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


def owned(s: Any, name: str) -> HPolytope:
    """A set as given, validated, in arrays that nobody else can change. Raises InputError."""
    if not isinstance(s, Box | HPolytope):
        raise InputError(f"{name}: expected a Box or an HPolytope; got {type(s).__name__}.")
    with naming(name):
        return from_box(box(s.lo, s.hi)) if isinstance(s, Box) else hpolytope(s.A, s.b)


def coupled(A: np.ndarray, axes: int | Sequence[int]) -> tuple[list[int], list[int]]:
    """The coordinates that rows A (h, n) tie to some axes, directly or through others, and those
    rows.
    """
    used, columns = A != 0, np.isin(np.arange(A.shape[1]), axes)
    for _ in range(A.shape[1]):  # until none is new
        rows = used[:, columns].any(axis=1)
        columns |= used[rows].any(axis=0)
    return np.flatnonzero(columns).tolist(), np.flatnonzero(rows).tolist()


def from_box(b: Box) -> HPolytope:
    """The box as 2n rows: x <= hi first, then -x <= -lo."""
    eye = np.eye(b.n)
    return hpolytope(np.concatenate([eye, -eye]), np.concatenate([b.hi, -b.lo]))
