"""Affine images of polytopes: the sets that stay exact under projection, hull and sum."""

import numpy as np
from jaxtyping import Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.lp.witness import row_bounds
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope, from_box


@struct.dataclass
class AHPolytope:
    """The set {x = G xi + c : A xi <= b}. Build with `ahpolytope` or `as_ah`. [NP, Sec. II-A]

    G: (n, m) and c: (n,) of the map. A: (h, m) and b: (h,) of the base, rows kept as given.
    lo, hi: (m,) bounds that every xi of the base is known to satisfy, infinite where none is known.
    They change nothing about the set; they make proofs of emptiness cheap [T12b].
    """

    G: Float[np.ndarray, "... n m"]
    c: Float[np.ndarray, "... n"]
    A: Float[np.ndarray, "... h m"]
    b: Float[np.ndarray, "... h"]
    lo: Float[np.ndarray, "... m"]
    hi: Float[np.ndarray, "... m"]

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return self.G.shape[-2]

    @property
    def m(self) -> int:
        """Dimension of the base."""
        return self.G.shape[-1]

    @property
    def base(self) -> HPolytope:
        """The polytope of the xi."""
        return HPolytope(self.A, self.b)


def ahpolytope(G, c, A, b, lo=None, hi=None) -> AHPolytope:
    """Validated AH-polytope; A may have zero rows. Bounds are completed from single-entry rows.
    Raises InputError.
    """
    G = as_float64("AH-polytope G", G, (None, None))
    c = as_float64("AH-polytope c", c, (G.shape[0],))
    A = as_float64("AH-polytope A", A, (None, G.shape[1]))
    b = as_float64("AH-polytope b", b, (A.shape[0],))
    for name, bound in (("lo", lo), ("hi", hi)):
        if bound is not None and np.shape(bound) != (G.shape[1],):
            raise InputError(
                f"AH-polytope {name}: expected shape ({G.shape[1]},); got {np.shape(bound)}."
            )
    return AHPolytope(G, c, A, b, *row_bounds(A, b, lo, hi))


def as_ah(s: Box | HPolytope | AHPolytope) -> AHPolytope:
    """The same set as an AH-polytope: the map is the identity."""
    if isinstance(s, AHPolytope):
        return s
    if isinstance(s, Box):
        s = from_box(s)
    return AHPolytope(np.eye(s.n), np.zeros(s.n), s.A, s.b, *row_bounds(s.A, s.b))
