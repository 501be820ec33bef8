"""The complex of the domain itself, a box."""

from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError, check_kind
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.complex import Complex, Level, Sign, SignBits

MAX_DIMENSION = 6
# float products and volumes stay finite below
LARGEST_SCALE = 1e40
LARGEST_WEIGHT = 1e100


class UnitProblem(NamedTuple):
    """Network and domain in unit coordinates y = x / scale, a power of two per axis: no rounding.

    A, b: rows of the domain, between lo and hi.
    weights, biases: of the hidden layers.
    """

    scale: np.ndarray
    A: np.ndarray
    b: np.ndarray
    lo: np.ndarray
    hi: np.ndarray
    weights: list[np.ndarray]
    biases: list[np.ndarray]


def unit_problem(net: ReLUNetwork, domain: Box) -> UnitProblem:
    """Rescale the axes so that errors mean the same along each. Raises InputError."""
    check_kind("domain", domain, Box)
    if domain.n != net.n_in:
        raise InputError(f"domain: expected {net.n_in} dimensions, as the network; got {domain.n}.")
    if not (domain.lo < domain.hi).all():
        raise InputError(f"domain: expected a box with interior; got {domain.lo} to {domain.hi}.")
    rows = from_box(domain)
    scale = np.ldexp(1.0, np.frexp(np.maximum(np.abs(domain.lo), np.abs(domain.hi)))[1])
    if not ((scale >= 1 / LARGEST_SCALE) & (scale <= LARGEST_SCALE)).all():
        raise InputError(
            f"domain: expected sizes between {1 / LARGEST_SCALE:g} and {LARGEST_SCALE:g}; got "
            f"{scale}."
        )
    hidden = len(net.weights) - 1
    weights = [W * scale if i == 0 else W for i, W in enumerate(net.weights[:hidden])]
    biases = list(net.biases[:hidden])
    largest = max((np.abs(part).max(initial=0.0) for part in (*weights, *biases)), default=0.0)
    if largest > LARGEST_WEIGHT:
        raise InputError(
            f"network: expected weights up to {LARGEST_WEIGHT:g}; got {largest:g}. Rescale neurons."
        )
    return UnitProblem(
        scale=scale,
        A=rows.A * scale,
        b=rows.b,
        lo=domain.lo / scale,
        hi=domain.hi / scale,
        weights=weights,
        biases=biases,
    )


def box_complex(lo: np.ndarray, hi: np.ndarray, n_columns: int) -> Complex:
    """The box's faces. Columns 0..2n-1 are its rows (x <= hi, then -x <= -lo); n_columns in all."""
    n = len(lo)
    corner, subs, sizes, firsts, label = _box_faces(n)
    bits = SignBits(n_columns, len(corner))
    for axis in range(n):
        bits.mark(axis, np.where(corner[:, axis], Sign.ZERO, Sign.MINUS))
        bits.mark(n + axis, np.where(corner[:, axis], Sign.MINUS, Sign.ZERO))
    levels = {k: Level(subs[k] + 1, sizes[k], firsts[k]) for k in range(2, n + 1)}
    ends = subs[1].reshape(-1, 2)
    return Complex(np.where(corner, hi, lo), bits, ends[:, 0], ends[:, 1], levels, label)


@lru_cache
def _box_faces(n: int):
    """Corners (2^n, n) bool; faces of a box by dimension: boundaries, sizes, corner, labels."""
    # per axis a face lies at 0 (low), 1 (high) or is 2 (free); its dimension is the number of 2s
    faces = {k: [f for f in product((0, 1, 2), repeat=n) if f.count(2) == k] for k in range(n + 1)}
    number = {face: i for same in faces.values() for i, face in enumerate(same)}
    subs, sizes, firsts = {}, {}, {}
    for k in range(1, n + 1):
        # the facets of a face: a free axis becomes low or high
        free = [(face, axis) for face in faces[k] for axis, at in enumerate(face) if at == 2]
        below = [(*face[:axis], at, *face[axis + 1 :]) for face, axis in free for at in (0, 1)]
        subs[k] = np.array([number[sub] for sub in below])
        sizes[k] = np.full(len(faces[k]), 2 * k)
        lowest = [tuple(0 if at == 2 else at for at in face) for face in faces[k]]
        firsts[k] = np.array([number[corner] for corner in lowest])
    walls = [next((axis, at) for axis, at in enumerate(face) if at != 2) for face in faces[n - 1]]
    label = np.array([axis if at == 1 else n + axis for axis, at in walls])
    return np.array(faces[0], dtype=bool), subs, sizes, firsts, label
