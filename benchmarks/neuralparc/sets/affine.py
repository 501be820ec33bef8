"""Affine images of polytopes, which stay exact under image, projection, intersection, convex hull
and sum: closed forms, up to the rounding of their products. And LPs with a witness: is there a
point in a set, is a point in it?
"""

import numpy as np
from jaxtyping import Float

from benchmarks.neuralparc.lp_program import LPResult, LPStatus
from benchmarks.neuralparc.lp_solve import feasible
from parc_jax.common import struct
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import row_bounds
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope, from_box


@struct.dataclass
class AHPolytope:
    """The set {x = G xi + c : A xi <= b}, made by `as_ah` and the operations. [NP, Sec. II-A]

    G: (n, m), c: (n,) the map. A: (h, m), b: (h,) rows of the base.
    lo, hi: (m,) proved bounds of every xi of the base, infinite without one. They change nothing
        about the set and make proofs of emptiness cheap [T12b].
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


def as_ah(s: Box | HPolytope | AHPolytope) -> AHPolytope:
    """The same set as an AH-polytope: the map is the identity."""
    if isinstance(s, AHPolytope):
        return s
    if isinstance(s, Box):
        s = from_box(s)
    return AHPolytope(np.eye(s.n), np.zeros(s.n), s.A, s.b, *row_bounds(s.A, s.b))


Set = Box | HPolytope | AHPolytope


def image(s: Set, C: Float[np.ndarray, "m n"], d: Float[np.ndarray, " m"]) -> AHPolytope:
    """{C x + d : x in s}. C: (m, n), d: (m,). [NP, Sec. II-A]"""
    s = as_ah(s)
    return s.replace(G=C @ s.G, c=C @ s.c + d)


def projection(s: Set, axes) -> AHPolytope:
    """Shadow of s on the given coordinates. axes: (m,) indices. Exact."""
    s = as_ah(s)
    axes = np.asarray(axes, dtype=int)
    if axes.size and not (0 <= axes.min() and axes.max() < s.n):
        raise InputError(f"projection: expected axes between 0 and {s.n - 1}; got {axes.tolist()}.")
    return s.replace(G=s.G[axes], c=s.c[axes])


def intersection(s: Set, t: Set) -> AHPolytope:
    """Points in both: equality rows tie the two base points."""
    s, t, both = stacked(s, t)
    same, offset = np.concatenate([s.G, -t.G], axis=1), t.c - s.c
    return both.replace(
        G=np.pad(s.G, ((0, 0), (0, t.m))),
        c=s.c,
        A=np.concatenate([both.A, same, -same]),
        b=np.concatenate([both.b, offset, -offset]),
    )


def stacked(s: Set, t: Set) -> tuple[AHPolytope, AHPolytope, AHPolytope]:
    """Two sets of one dimension, and {(x, y) : x in s, y in t}. Raises InputError."""
    if s.n != t.n:
        raise InputError(f"sets: expected two of one dimension; got {s.n} and {t.n}.")
    s, t = as_ah(s), as_ah(t)
    vectors = {name: np.r_[getattr(s, name), getattr(t, name)] for name in ("c", "b", "lo", "hi")}
    return s, t, AHPolytope(G=_diagonal(s.G, t.G), A=_diagonal(s.A, t.A), **vectors)


def convex_hull(s: Set, t: Set) -> AHPolytope:
    """conv(s u t) for two sets, exact for non-empty bounded ones. [Sadraddini and Tedrake 2019; NP
    Sec. II-A]

    Base variables (xi, eta, a): x = G_s xi + G_t eta + a c_s + (1 - a) c_t with A_s xi <= a b_s,
    A_t eta <= (1 - a) b_t, 0 <= a <= 1: xi and eta are base points scaled by the shares a and 1 -
    a. If one of the sets is empty and its rows bound every direction, the hull is the other one.
    For unbounded sets the result may be larger than the hull, never smaller.
    """
    s, t, both = stacked(s, t)
    share = np.r_[-s.b, t.b, 1.0, -1.0][:, None]
    A = np.concatenate([np.pad(both.A, ((0, 2), (0, 0))), share], axis=1)
    b = np.r_[np.zeros(len(s.b)), t.b, 1.0, 0.0]
    G = np.concatenate([s.G, t.G, (s.c - t.c)[:, None]], axis=1)
    # A share between 0 and 1 of a base point lies between the base point's bounds and zero.
    lo, hi = np.r_[np.minimum(both.lo, 0), 0.0], np.r_[np.maximum(both.hi, 0), 1.0]
    return AHPolytope(G, t.c, A, b, lo, hi)


def _diagonal(
    a: Float[np.ndarray, "i j"], b: Float[np.ndarray, "k l"]
) -> Float[np.ndarray, "i+k j+l"]:
    return np.block(
        [[a, np.zeros((a.shape[0], b.shape[1]))], [np.zeros((b.shape[0], a.shape[1])), b]]
    )


def find_point(s: Set) -> LPResult:
    """A point of the set (FEASIBLE; `x` is the base point xi), a proof that there is none
    (INFEASIBLE), or UNKNOWN.
    """
    s = as_ah(s)
    return feasible(s.A, s.b, lo=s.lo, hi=s.hi)


def membership(s: Set, x: Float[np.ndarray, " n"]) -> LPResult:
    """Is x (n,) in s? FEASIBLE with a base point xi (to lp_feasible), INFEASIBLE with a proof, or
    UNKNOWN. (For H-polytopes: `HPolytope.contains`.)
    """
    s = as_ah(s)
    return feasible(s.A, s.b, s.G, x - s.c, s.lo, s.hi)


def is_proved_outside(s: Set, x: Float[np.ndarray, " n"]) -> bool:
    """True only with a checked dual witness. False means inside or unknown."""
    return membership(s, x).status is LPStatus.INFEASIBLE
