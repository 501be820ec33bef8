"""The complex of the domain itself: a box, or any polytope with interior, cut out of a box around it."""

from functools import lru_cache
from itertools import product

import numpy as np

from parc_jax.errors import InputError
from parc_jax.pwa.complex import Complex, Level, SignBits
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope, from_box

MAX_DIMENSION = 6


def domain_rows(domain: Box | HPolytope) -> tuple[Box, HPolytope]:
    """A box around the domain, and the domain as rows (for a box: the box and its own 2n rows). Raises InputError."""
    if isinstance(domain, Box):
        if not (domain.lo < domain.hi).all():
            raise InputError(f"domain: expected a box with interior; got lo = {domain.lo}, hi = {domain.hi}.")
        return domain, from_box(domain)
    if not isinstance(domain, HPolytope):
        raise InputError(f"domain: expected a Box or an HPolytope; got {type(domain).__name__}.")
    return _box_around(domain), domain


def _box_around(P: HPolytope) -> Box:
    """A box that contains the polytope with room to spare (from LPs; the subdivision checks it exactly)."""
    from scipy.optimize import linprog

    lo, hi = np.empty(P.n), np.empty(P.n)
    for axis, sign in product(range(P.n), (1, -1)):
        result = linprog(sign * np.eye(P.n)[axis], A_ub=P.A, b_ub=P.b, bounds=(None, None), method="highs")
        if result.status != 0:
            why = {2: "it is empty", 3: "it is unbounded"}.get(result.status, result.message)
            raise InputError(f"domain: expected a bounded polytope with interior; {why}. Add rows, or use a Box.")
        (lo if sign > 0 else hi)[axis] = sign * result.fun
    room = 0.25 * (hi - lo) + 1e-3 * np.maximum(np.abs(lo), np.abs(hi)) + 2.0**-40
    return Box(lo - room, hi + room)


def box_complex(lo: np.ndarray, hi: np.ndarray, n_columns: int) -> Complex:
    """The faces of the box. Columns 0..2n-1 are its rows (x <= hi, then -x <= -lo); n_columns in all."""
    n = len(lo)
    corner, subs, sizes, firsts, label = _box_faces(n)
    bits = SignBits(n_columns, len(corner))
    for axis in range(n):
        bits.mark(axis, np.where(corner[:, axis], 0, 2).astype(np.uint8))
        bits.mark(n + axis, np.where(corner[:, axis], 2, 0).astype(np.uint8))
    levels = {k: Level(subs[k] + 1, sizes[k], firsts[k]) for k in range(2, n + 1)}
    ends = subs[1].reshape(-1, 2)
    return Complex(np.where(corner, hi, lo), bits, ends[:, 0], ends[:, 1], levels, label)


@lru_cache
def _box_faces(n: int):
    """Corners (2^n, n) bool, and per dimension the faces of the unit box: boundaries, sizes, a corner, facet labels."""
    # a face is a word over 0 (low), 1 (high), 2 (free); its dimension is the number of 2s
    faces = {k: [w for w in product((0, 1, 2), repeat=n) if w.count(2) == k] for k in range(n + 1)}
    number = {w: i for words in faces.values() for i, w in enumerate(words)}
    subs, sizes, firsts = {}, {}, {}
    for k in range(1, n + 1):
        rows = [[number[w[:i] + (v,) + w[i + 1 :]] for i in range(n) if w[i] == 2 for v in (0, 1)] for w in faces[k]]
        subs[k], sizes[k] = np.concatenate(rows), np.full(len(rows), 2 * k)
        firsts[k] = np.array([number[tuple(0 if v == 2 else v for v in w)] for w in faces[k]])
    walls = [next((i, v) for i, v in enumerate(w) if v != 2) for w in faces[n - 1]]
    label = np.array([axis if v == 1 else n + axis for axis, v in walls])
    return np.array(faces[0], dtype=bool), subs, sizes, firsts, label
