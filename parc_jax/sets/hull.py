"""Convex hull of two AH-polytopes, without vertices."""

import numpy as np

from parc_jax.errors import InputError
from parc_jax.sets.affine import Set
from parc_jax.sets.ahpolytope import AHPolytope, as_ah


def convex_hull(s: Set, t: Set) -> AHPolytope:
    """conv(s u t) for two sets, exact for non-empty bounded ones. [Sadraddini and Tedrake 2019; NP Sec. II-A]

    Base variables (xi, eta, a): x = G_s xi + G_t eta + a c_s + (1 - a) c_t with A_s xi <= a b_s,
    A_t eta <= (1 - a) b_t, 0 <= a <= 1: xi and eta are base points scaled by the shares a and 1 - a. If one of the sets
    is empty and its rows bound every direction, the hull is the other one. For unbounded sets the result may be larger
    than the hull, never smaller.
    """
    s, t = as_ah(s), as_ah(t)
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
