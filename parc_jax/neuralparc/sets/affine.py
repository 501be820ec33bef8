"""Affine maps of sets, and the operations that only move rows: image, preimage, projection,
product, intersection, convex hull.

Maps are plain arrays, x -> C x + d with C (m, n), d (m,). Exact up to the rounding of the products
C and d enter.

Affine images of polytopes: the sets that stay exact under projection, hull and sum.
"""

import numpy as np
from jaxtyping import Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import row_bounds
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


Set = Box | HPolytope | AHPolytope


def image(s: Set, C: Float[np.ndarray, "m n"], d: Float[np.ndarray, " m"]) -> AHPolytope:
    """{C x + d : x in s}. C: (m, n), d: (m,). [NP, Sec. II-A]"""
    s = as_ah(s)
    return s.replace(G=C @ s.G, c=C @ s.c + d)


def preimage(
    target: HPolytope, C: Float[np.ndarray, "... m n"], d: Float[np.ndarray, "... m"]
) -> HPolytope:
    """{x : C x + d in target}, for one map or for many along leading axes. Pure kernel. [NP, Sec.
    II-A]

    target: h rows in R^m. C: (..., m, n), d: (..., m). Returns h rows in R^n per map, not rescaled;
    a row may vanish.
    """
    return HPolytope(target.A @ C, target.b - d @ target.A.T)


def projection(s: Set, axes) -> AHPolytope:
    """Shadow of s on the given coordinates. axes: (m,) indices. Exact."""
    s = as_ah(s)
    axes = np.asarray(axes, dtype=int)
    if axes.size and not (0 <= axes.min() and axes.max() < s.n):
        raise InputError(f"projection: expected axes between 0 and {s.n - 1}; got {axes.tolist()}.")
    return s.replace(G=s.G[axes], c=s.c[axes])


def product(s: Set, t: Set) -> Set:
    """{(x, y) : x in s, y in t}. Two boxes give a box, two H-polytopes an H-polytope, else an
    AH-polytope.
    """
    if isinstance(s, Box) and isinstance(t, Box):
        return Box(np.r_[s.lo, t.lo], np.r_[s.hi, t.hi])
    if isinstance(s, HPolytope) and isinstance(t, HPolytope):
        return HPolytope(_diagonal(s.A, t.A), np.r_[s.b, t.b])
    s = as_ah(s)
    t = as_ah(t)
    return AHPolytope(
        G=_diagonal(s.G, t.G),
        c=np.r_[s.c, t.c],
        A=_diagonal(s.A, t.A),
        b=np.r_[s.b, t.b],
        lo=np.r_[s.lo, t.lo],
        hi=np.r_[s.hi, t.hi],
    )


def intersection(s: Set, t: Set) -> Set:
    """Points in both. Two H-polytopes give an H-polytope; else the two base points are tied by
    equality rows.
    """
    if s.n != t.n:
        raise InputError(f"intersection: expected two sets of one dimension; got {s.n} and {t.n}.")
    if isinstance(s, HPolytope) and isinstance(t, HPolytope):
        return HPolytope(np.concatenate([s.A, t.A]), np.r_[s.b, t.b])
    s = as_ah(s)
    t = as_ah(t)
    same = np.concatenate([s.G, -t.G], axis=1)
    offset = t.c - s.c
    both = product(s, t)
    return both.replace(
        G=np.pad(s.G, ((0, 0), (0, t.m))),
        c=s.c,
        A=np.concatenate([both.A, same, -same]),
        b=np.concatenate([both.b, offset, -offset]),
    )


def convex_hull(s: Set, t: Set) -> AHPolytope:
    """conv(s u t) for two sets, exact for non-empty bounded ones. [Sadraddini and Tedrake 2019; NP
    Sec. II-A]

    Base variables (xi, eta, a): x = G_s xi + G_t eta + a c_s + (1 - a) c_t with A_s xi <= a b_s,
    A_t eta <= (1 - a) b_t, 0 <= a <= 1: xi and eta are base points scaled by the shares a and 1 -
    a. If one of the sets is empty and its rows bound every direction, the hull is the other one.
    For unbounded sets the result may be larger than the hull, never smaller.
    """
    s = as_ah(s)
    t = as_ah(t)
    if s.n != t.n:
        raise InputError(f"convex_hull: expected two sets of one dimension; got {s.n} and {t.n}.")
    m = s.m + t.m
    A = np.concatenate(
        [
            np.concatenate([s.A, np.zeros((len(s.b), t.m)), -s.b[:, None]], axis=1),
            np.concatenate([np.zeros((len(t.b), s.m)), t.A, t.b[:, None]], axis=1),
            np.concatenate([np.zeros((2, m)), np.array([[1.0], [-1.0]])], axis=1),
        ]
    )
    b = np.concatenate([np.zeros(len(s.b)), t.b, [1.0, 0.0]])
    G = np.concatenate([s.G, t.G, (s.c - t.c)[:, None]], axis=1)
    # A share between 0 and 1 of a base point lies between the base point's bounds and zero.
    lo = np.r_[np.minimum(s.lo, 0), np.minimum(t.lo, 0), 0.0]
    hi = np.r_[np.maximum(s.hi, 0), np.maximum(t.hi, 0), 1.0]
    return AHPolytope(G, t.c, A, b, lo, hi)


def _diagonal(
    a: Float[np.ndarray, "i j"], b: Float[np.ndarray, "k l"]
) -> Float[np.ndarray, "i+k j+l"]:
    return np.block(
        [[a, np.zeros((a.shape[0], b.shape[1]))], [np.zeros((b.shape[0], a.shape[1])), b]]
    )
