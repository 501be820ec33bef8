"""Affine maps of sets, and the operations that only move rows: image, preimage, projection, product, intersection.

Maps are plain arrays, x -> C x + d with C (m, n), d (m,). Exact up to the rounding of the products C and d enter.
"""

import numpy as np
from jaxtyping import Float

from parc_jax.errors import InputError
from parc_jax.sets.ahpolytope import AHPolytope, as_ah
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope

Set = Box | HPolytope | AHPolytope


def image(s: Set, C: Float[np.ndarray, "m n"], d: Float[np.ndarray, " m"]) -> AHPolytope:
    """{C x + d : x in s}. C: (m, n), d: (m,). [NP Sec. II-A]"""
    s = as_ah(s)
    return s.replace(G=C @ s.G, c=C @ s.c + d)


def preimage(target: HPolytope, C: Float[np.ndarray, "... m n"], d: Float[np.ndarray, "... m"]) -> HPolytope:
    """{x : C x + d in target}, for one map or for many along leading axes. Pure kernel. [NP Sec. II-A]

    target: h rows in R^m. C: (..., m, n), d: (..., m). Returns h rows in R^n per map, not rescaled; a row may vanish.
    """
    return HPolytope(target.A @ C, target.b - d @ target.A.T)


def preimage_ah(target: AHPolytope, C: Float[np.ndarray, "m n"], d: Float[np.ndarray, " m"]) -> AHPolytope:
    """{x : C x + d in target}, with the base point of the target as an extra variable."""
    n = C.shape[1]
    same = np.concatenate([C, -target.G], axis=1)  # C x + d = G xi + c
    A = np.concatenate([np.pad(target.A, ((0, 0), (n, 0))), same, -same])
    b = np.concatenate([target.b, target.c - d, d - target.c])
    unknown = np.full(n, np.inf)
    lo, hi = np.r_[-unknown, target.lo], np.r_[unknown, target.hi]
    return AHPolytope(np.eye(n, n + target.m), np.zeros(n), A, b, lo, hi)


def projection(s: Set, axes) -> AHPolytope:
    """Shadow of s on the given coordinates. axes: (m,) indices. Exact."""
    s, axes = as_ah(s), np.asarray(axes, dtype=int)
    if axes.size and not (0 <= axes.min() and axes.max() < s.n):
        raise InputError(f"projection: expected axes between 0 and {s.n - 1}; got {axes.tolist()}.")
    return s.replace(G=s.G[axes], c=s.c[axes])


def product(s: Set, t: Set) -> Set:
    """{(x, y) : x in s, y in t}. Two boxes give a box, two H-polytopes an H-polytope, else an AH-polytope."""
    if isinstance(s, Box) and isinstance(t, Box):
        return Box(np.r_[s.lo, t.lo], np.r_[s.hi, t.hi])
    if isinstance(s, HPolytope) and isinstance(t, HPolytope):
        return HPolytope(_diagonal(s.A, t.A), np.r_[s.b, t.b])
    s, t = as_ah(s), as_ah(t)
    G, A = _diagonal(s.G, t.G), _diagonal(s.A, t.A)
    return AHPolytope(G, np.r_[s.c, t.c], A, np.r_[s.b, t.b], np.r_[s.lo, t.lo], np.r_[s.hi, t.hi])


def intersection(s: Set, t: Set) -> Set:
    """Points in both. Two H-polytopes give an H-polytope; else the two base points are tied by equality rows."""
    if s.n != t.n:
        raise InputError(f"intersection: expected two sets of one dimension; got {s.n} and {t.n}.")
    if isinstance(s, HPolytope) and isinstance(t, HPolytope):
        return HPolytope(np.concatenate([s.A, t.A]), np.r_[s.b, t.b])
    s, t = as_ah(s), as_ah(t)
    same, offset = np.concatenate([s.G, -t.G], axis=1), t.c - s.c
    both = product(s, t)
    return both.replace(
        G=np.pad(s.G, ((0, 0), (0, t.m))),
        c=s.c,
        A=np.concatenate([both.A, same, -same]),
        b=np.concatenate([both.b, offset, -offset]),
    )


def _diagonal(a: Float[np.ndarray, "i j"], b: Float[np.ndarray, "k l"]) -> Float[np.ndarray, "i+k j+l"]:
    return np.block([[a, np.zeros((a.shape[0], b.shape[1]))], [np.zeros((b.shape[0], a.shape[1])), b]])
