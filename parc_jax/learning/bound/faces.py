"""Pairs of parallel faces around errors, which fit where a box along the axes does not. [T26]

A robot that is early or late errs along its slanted path. A box along x and y pays for that on both
axes; a pair of faces along the path and one across it do not. Errors are not centred about zero
either, so every pair of faces has a centre, and is scaled about it.
"""

from collections.abc import Mapping
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.error_set import NO_CLAIM, ErrorTemplate, template

# short binary fractions, so that exact arithmetic on certificates stays cheap
DIRECTION_BITS = 10
CENTRE_BITS = 20
HALF_BITS = 40
_FIELDS = ("directions", "centre", "half")
_UP = 1 + 2.0**-48  # a sum of a few products, rounded, upward


@struct.dataclass
class Faces:
    """Errors e with |u_j . e - c_j| <= s_j for R directions u_j. `faces` builds and validates it.

    directions: (..., R, n)   the first n are the axes, so there is a box around every such set.
    centre:     (..., R)      middle between the two faces.
    half:       (..., R) >= 0 half their distance, times |u_j|; infinite without claim.
    errors:     the same set as kernels ask for it; its leading axes are (...).
    frames:     the directions are taken n by n, each n of them a basis, and no others are combined:
                for n so large that there are too many.
    """

    directions: np.ndarray
    centre: np.ndarray
    half: np.ndarray
    errors: ErrorTemplate
    frames: bool = struct.field(pytree_node=False, default=False)

    @property
    def box(self) -> np.ndarray:
        """(..., n) half widths about zero that hold all of it, rounded up."""
        n = self.directions.shape[-1]
        centre, half = np.abs(self.centre[..., :n]), self.half[..., :n]
        return np.where(centre == 0, half, np.nextafter(centre + half, np.inf))

    @property
    def allow_none(self) -> np.ndarray:
        """(...) bool: whether no error at all is one of them; a set about a far centre has none."""
        return (self.half >= np.abs(self.centre)).all(axis=-1)

    @property
    def inner_box(self) -> np.ndarray:
        """(..., n) finite half widths about zero of a box inside, in the proportions of the one
        around it, rounded down; nothing where zero is outside.
        """
        finite = np.minimum(self.half, NO_CLAIM)
        n = self.directions.shape[-1]
        around = np.abs(self.centre[..., :n]) + finite[..., :n]
        across = (np.abs(self.directions) * around[..., None, :]).sum(axis=-1)
        left = np.maximum(finite - np.abs(self.centre), 0)
        share = np.divide(left, across, out=np.ones_like(left), where=across > 0).min(axis=-1)
        return share[..., None] * around / _UP**4

    def half_extent(self, index: tuple[int, ...] | int, axis: int) -> float:
        """Half of how far one set goes along an axis: of all faces together, by linear programs;
        infinite without claim. A support in frames only bounds it from above.
        """
        from scipy.optimize import linprog  # heavy to load, and seldom needed

        u, c, s = self.directions[index], self.centre[index], self.half[index]
        if not np.isfinite(s).all():
            return np.inf
        A, b = np.concatenate([u, -u]), np.concatenate([s + c, s - c])
        unit = np.eye(u.shape[1])[axis]
        ends = [linprog(sign * unit, A_ub=A, b_ub=b, bounds=(None, None)) for sign in (1, -1)]
        return 0.0 if any(end.status for end in ends) else -(ends[0].fun + ends[1].fun) / 2

    def half_around(self, size: npt.ArrayLike) -> np.ndarray:
        """(..., R) largest |u_j . e| over all |e| <= size (..., n), rounded up."""
        n = self.directions.shape[-1]
        size = np.broadcast_to(size, (*self.directions.shape[:-2], n))
        across = (np.abs(self.directions[..., n:, :]) * size[..., None, :]).sum(axis=-1) * _UP
        return np.concatenate([size, across], axis=-1)

    def with_half(self, half: np.ndarray) -> "Faces":
        """The same faces at another distance from their middle, rounded up to a short fraction, so
        that centre and half add up without rounding. Raises InputError.
        """
        whole = np.ceil(np.ldexp(half, HALF_BITS))
        return faces(self.directions, self.centre, np.ldexp(whole, -HALF_BITS), self.frames)

    def rows(self, index: tuple[int, ...] | int) -> list[tuple[list[Fraction], Fraction]]:
        """Exact rows (a, b) with a . e <= b of one set, both faces of every pair in turn."""
        out = []
        parts = (self.directions[index], self.centre[index], self.half[index])
        for u, c, s in zip(*parts, strict=True):
            a, middle, half = [Fraction(x) for x in u], Fraction(c), Fraction(s)
            out += [(a, half + middle), ([-x for x in a], half - middle)]
        return out


class Templates(NamedTuple):
    """Faces of a tube that fit the errors better than boxes do. [T26]

    interval: (n_bins, T, n_points) sets of n_p coordinates [m]. final: (n_bins,) sets of n_c + n_q
        coordinates [m, .], given in frames.
    """

    interval: Faces
    final: Faces

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """What they are made of, by name; `templates_of` reads it."""
        parts = self._asdict().items()
        return {f"{part}_{name}": getattr(of, name) for part, of in parts for name in _FIELDS}


def templates_of(arrays: Mapping[str, np.ndarray]) -> Templates:
    """The templates of these `arrays`. Raises InputError; KeyError when one is missing."""
    interval, final = (
        faces(**{name: arrays[f"{part}_{name}"] for name in _FIELDS}, frames=part == "final")
        for part in Templates._fields
    )
    return Templates(interval, final)


def faces(
    directions: npt.ArrayLike, centre: npt.ArrayLike, half: npt.ArrayLike, frames: bool = False
) -> Faces:
    """Validated faces, arguments as in `Faces`. Raises InputError."""
    directions = as_float64("faces directions", directions, np.shape(directions))
    centre = as_float64("faces centre", centre, np.shape(centre))
    half = np.array(half, np.float64)
    half.setflags(write=False)
    n_rows, n = directions.shape[-2:]
    if centre.shape != directions.shape[:-1] or half.shape != centre.shape:
        raise InputError(
            "faces: expected a centre and a half width for every direction "
            f"{directions.shape[:-1]}; got {centre.shape} and {half.shape}."
        )
    if not (half >= 0).all():
        raise InputError("faces: expected half widths >= 0; got a negative one or NaN.")
    if n_rows < n or not (directions[..., :n, :] == np.eye(n)).all():
        raise InputError(
            f"faces: expected the {n} axes as first directions, so that a box is around the set; "
            f"got {directions[(0,) * (directions.ndim - 2)][:n].tolist()}."
        )
    errors = template(directions, centre, half, frames)
    return Faces(directions, centre, half, errors, frames)


def short(values: np.ndarray, bits: int) -> np.ndarray:
    """The values rounded to multiples of 2^-bits; none is a negative zero, which a fraction cannot
    spell and so a file would lose, and with it the hash that binds a tube to its claim.
    """
    return np.round(np.ldexp(values, bits)) * 2.0**-bits + 0.0
