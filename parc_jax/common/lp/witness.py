"""Witnesses: the few inequalities of every LP verdict, in float64 with rounding accounted for.

A solver's output is a hint. A point is checked against the rows; multipliers are turned into a
bound that is valid whatever they are (Neumaier and Shcherbina's self-correcting bound, [T12]):
there is no equality to miss. All functions take leading batch axes.
"""

import numpy as np

_UNIT = 2.0**-53
_TINY = np.finfo(np.float64).tiny


def gamma(n: int) -> float:
    """Relative error bound of a float64 sum of n products in any order, itself rounded up."""
    return 1.01 * n * _UNIT / (1 - n * _UNIT)


def violation(x, A, b, lo=None, hi=None):
    """Most by which x (..., n) misses A x <= b or a bound [row units]: (...), NaN for a NaN x."""
    with np.errstate(invalid="ignore", over="ignore"):
        worst = (np.einsum("...hn,...n->...h", A, x) - b).max(axis=-1, initial=0.0)
        if lo is not None:
            worst = np.maximum(worst, (lo - x).max(axis=-1, initial=0.0))
        if hi is not None:
            worst = np.maximum(worst, (x - hi).max(axis=-1, initial=0.0))
    return np.where(np.isfinite(x).all(axis=-1), worst, np.nan)


def dual_bound(c, A, b, multipliers, lo, hi):
    """Proved lower bound of min c.x over {A x <= b, lo <= x <= hi}. [T12b]

    c: (..., n). A: (..., h, n). b, multipliers: (..., h); negative and NaN multipliers count as
        zero.
    lo, hi: (..., n), infinite where unknown. Returns (...), rounded down; -inf where the
        multipliers prove nothing.

    For any mu >= 0 and rho = c + A'mu:  c.x = rho.x - mu.A x >= sum_j min(rho_j lo_j, rho_j hi_j) -
    mu.b.
    """
    mu = np.where(multipliers > 0, multipliers, 0.0)
    h, n = A.shape[-2:]
    with np.errstate(invalid="ignore", over="ignore"):
        rho = c + np.einsum("...hn,...h->...n", A, mu)
        slack = gamma(h + 2) * (np.abs(c) + np.einsum("...hn,...h->...n", np.abs(A), mu))
        # products that underflow; an unused coordinate is free
        slack = slack + h * _TINY * (A != 0).any(axis=-2)
        below = rho - slack
        above = rho + slack
        least = np.minimum(
            np.minimum(_times(below, lo), _times(below, hi)),
            np.minimum(_times(above, lo), _times(above, hi)),
        )
        offset = np.einsum("...h,...h->...", mu, b)
        size = np.einsum("...h,...h->...", mu, np.abs(b)) + np.abs(least).sum(axis=-1)
        bound = least.sum(axis=-1) - offset - gamma(h + n + 4) * size - (h + n) * _TINY
    return np.where(np.isfinite(bound), bound, -np.inf)


def proves_empty(A, b, multipliers, lo, hi, margin: float):
    """Where multipliers prove {A x <= b, lo <= x <= hi} empty. [T12b], with c = 0: Farkas' witness.

    multipliers: (..., h), scaled so that the largest is one. margin: [row units] by which the proof
        must clear zero.
    """
    scale = np.max(
        np.where(np.isfinite(multipliers), multipliers, 0.0), axis=-1, keepdims=True, initial=0.0
    )
    y = multipliers / np.where(scale > 0, scale, 1.0)
    return dual_bound(np.zeros(A.shape[-1]), A, b, y, lo, hi) > margin


def row_bounds(A, b, lo=None, hi=None):
    """Bounds (lo, hi), each (..., n), that rows with a single nonzero entry imply, rounded outward;
    infinite where none do. Bounds passed in are intersected with them.
    """
    single = (A != 0).sum(axis=-1, keepdims=True) == 1
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        limit = b[..., None] / A
        up = np.nextafter(limit, np.inf)
        down = np.nextafter(limit, -np.inf)
    above = np.where(single & (A > 0), up, np.inf).min(axis=-2, initial=np.inf)
    below = np.where(single & (A < 0), down, -np.inf).max(axis=-2, initial=-np.inf)
    below = below if lo is None else np.maximum(below, lo)
    above = above if hi is None else np.minimum(above, hi)
    return below, above


def _times(a, b):
    """Product in which 0 * inf is 0: a zero coefficient pays nothing for an unknown bound."""
    return np.where(a == 0, 0.0, a * b)
