"""Error sets: a box along the axes, or pairs of parallel faces; their support. [T26]"""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt
from jaxtyping import ArrayLike, Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError

NO_CLAIM = 1e100  # [m, .] wider than any world, and its square is still finite
# [volume spanned by unit directions] A basis that spans less is left out: its multipliers would be
# large, and with them the rounding errors.
FLAT = 0.05
EQUAL = 64  # [units in the last place] supports that agree so far are of one face
Array = Float[ArrayLike, "..."]
At = ArrayLike | slice | None  # along one axis


@struct.dataclass
class ErrorBox:
    """|e_a| <= half_a, (..., n) >= 0, infinite without claim; leading axes broadcast with w's."""

    half: np.ndarray

    def support(self, w: Float[ArrayLike, "*b n"]):
        """(...) largest w . e. Infinite without claim, but for w = 0."""
        half, w = _same_rank(self.half, w)
        return _total(_product(abs(w), half))

    def support_by_axis(self, w: Sequence[ArrayLike]):
        """`support` of many directions: a tuple of n arrays that broadcast with leading axes."""
        # axis by axis no array is read with a stride
        along = [_product(abs(x), self.half[..., i]) for i, x in enumerate(w)]
        return sum(along[1:], along[0])

    def vertex(self, w: Float[ArrayLike, "*b n"]):
        """(..., n) an error that is farthest along w; without claim the centre."""
        half, w = _same_rank(_finite(self.half), w)
        return _namespace(half, w).where(w >= 0, half, -half)

    def wider(self, other: "ErrorBox") -> "ErrorBox":
        """One that holds both."""
        return ErrorBox(_namespace(self.half, other.half).maximum(self.half, other.half))


@struct.dataclass
class ErrorTemplate:
    """Errors between pairs of parallel faces, by basis. Build with `template`. Kernels; the leading
    axes broadcast against those of w.

    dual (..., B, n, n): mu = dual w gives sum mu_j u_j = w over the n directions of a basis.
    centre, half (..., B, n): of those directions; a basis that is left out is infinitely wide.
    """

    dual: np.ndarray
    centre: np.ndarray
    half: np.ndarray

    def support(self, w: Float[ArrayLike, "*b n"]):
        """(...) largest w . e. Infinite without claim, but for w = 0."""
        dual, centre, half, w = self._same_rank(w)
        return _by_basis(dual, centre, half, w)[1].min(axis=-1)

    @property
    def largest(self):
        """(...) bound on the sum of the terms of `support`, of any basis, per unit of |w|_1."""
        size = abs(self.dual).max(axis=-1)
        return _total(_product(size, abs(self.centre) + _finite(self.half))).max(axis=-1)

    def support_by_axis(self, w: Sequence[ArrayLike]):
        """`support` of many directions, axis by axis, as of a box."""
        n_bases, n = self.half.shape[-2:]
        supports = []
        for basis in range(n_bases):
            along = []
            for row in range(n):
                mu = sum(self.dual[..., basis, row, i] * x for i, x in enumerate(w))
                far = _product(abs(mu), self.half[..., basis, row])
                along.append(mu * self.centre[..., basis, row] + far)
            supports.append(sum(along[1:], along[0]))
        least = supports[0]
        for support in supports[1:]:
            least = _namespace(least).minimum(least, support)
        return least

    def vertex(self, w: Float[ArrayLike, "*b n"]):
        """(..., n) an error that is farthest along w, not zero: a corner of the set, up to
        rounding; without claim the centre.
        """
        dual, centre, half, w = self._same_rank(w)
        xp = _namespace(dual, w)
        mu, support = _by_basis(dual, centre, half, w)
        near = EQUAL * xp.finfo(mu.dtype).eps
        decided = abs(mu) > near * abs(mu).max(axis=-1, keepdims=True)
        size = _total(abs(mu * centre) + _product(abs(mu), half))
        tied = support <= (support + near * size).min(axis=-1, keepdims=True)
        # where w leaves an edge or a face to choose from, it is turned a little
        aside = xp.cos(xp.arange(w.shape[-1], dtype=mu.dtype))
        turned = _total(dual * _raised(aside, dual.ndim))
        half = _finite(half)
        faces = centre + xp.where(xp.where(decided, mu, turned) >= 0, half, -half)
        chosen = xp.where(tied, _total(turned * faces), xp.inf).argmin(axis=-1)
        corners = _total(xp.swapaxes(dual, -1, -2) * faces[..., None, :])
        return xp.take_along_axis(corners, chosen[..., None, None], axis=-2)[..., 0, :]

    def wider(self, other: "ErrorTemplate") -> "ErrorTemplate":
        """One that holds both: between the farthest faces, of bases that both have, as the axes."""
        xp = _namespace(self.half, other.half)
        same = (self.dual == other.dual).all(axis=(-2, -1))[..., None]
        known = same & xp.isfinite(self.half) & xp.isfinite(other.half)
        ours, theirs = _finite(self.half), _finite(other.half)
        lo = xp.minimum(self.centre - ours, other.centre - theirs)
        hi = xp.maximum(self.centre + ours, other.centre + theirs)
        half = (hi - lo) / 2 + (_UP - 1) * (abs(lo) + abs(hi))
        centre = xp.where(known, (lo + hi) / 2, 0.0)
        return ErrorTemplate(self.dual, centre, xp.where(known, half, xp.inf))

    def _same_rank(self, w: Float[ArrayLike, "*b n"]):
        """dual, centre, half and w (..., 1, 1, n) for operations between them."""
        dual, w = _same_rank(self.dual, w[..., None, None, :])
        centre, half = (_raised(x, dual.ndim - 1) for x in (self.centre, self.half))
        return dual, centre, half, w


ErrorSet = ErrorBox | ErrorTemplate


def at(errors: ErrorSet, index: At | tuple[At, ...]) -> ErrorSet:
    """Some of many sets, by an index of their leading axes."""
    # arrays on the host cannot be indexed by what a kernel computes
    traced = any(isinstance(i, jax.Array) for i in jax.tree.leaves(index))
    return jax.tree.map(lambda x: (jnp.asarray(x) if traced else x)[index], errors)


def template(
    directions: npt.ArrayLike, centre: npt.ArrayLike, half: npt.ArrayLike, frames: bool = False
) -> ErrorTemplate:
    """Errors with |u_j . e - centre_j| <= half_j; directions (..., R, n), centre, half (..., R).

    All bases of n among the R directions; nearly dependent ones are left out. frames: instead, n
    directions after another are a basis, and there are no others; the support is a bound then, and
    a vertex may lie outside. Raises InputError.
    """
    directions = np.asarray(directions, np.float64)
    n_rows, n = directions.shape[-2:]
    every = np.arange(n_rows - n_rows % n).reshape(-1, n)
    bases = every if frames else np.array(list(combinations(range(n_rows), n)), int).reshape(-1, n)
    if not len(bases):
        raise InputError(f"template: expected at least {n} directions; got {n_rows}.")
    lead = np.broadcast_shapes(directions.shape[:-2], np.shape(centre)[:-1], np.shape(half)[:-1])
    rows = directions[..., bases, :]
    lengths = np.linalg.norm(rows, axis=-1).prod(axis=-1)
    spans = np.abs(np.linalg.det(rows)) > FLAT * lengths
    rows = np.where(spans[..., None, None], rows, np.eye(n))
    dual = np.swapaxes(np.linalg.inv(rows), -1, -2)
    centre = np.where(spans[..., None], np.asarray(centre, np.float64)[..., bases], 0.0)
    half = np.where(spans[..., None], np.asarray(half, np.float64)[..., bases], np.inf)
    shape = (*lead, *bases.shape)
    centre, half = (np.broadcast_to(x, shape) for x in (centre, half))
    return ErrorTemplate(np.broadcast_to(dual, (*shape, n)), centre, half)


def _by_basis(dual: Array, centre: Array, half: Array, w: Array):
    """Multipliers (..., B, n) and the support (..., B) that each basis gives."""
    mu = _total(dual * w)
    return mu, _total(mu * centre + _product(abs(mu), half))


def _product(size: Array, half: Array):
    """size * half, where zero times an infinite width is zero."""
    xp = _namespace(size, half)
    return size * xp.where((size == 0) & xp.isinf(half), 0, half)


def _finite(half: Array):
    """half, but zero where it is infinite."""
    xp = _namespace(half)
    return xp.where(xp.isfinite(half), half, 0)


def _total(x: Array):
    """Sum over the last axis, written out so that it is no product of reduced precision."""
    return sum((x[..., i] for i in range(1, x.shape[-1])), x[..., 0])


def _same_rank(*arrays):
    most = max(x.ndim for x in arrays)
    return [_raised(x, most) for x in arrays]


def _raised(x: Array, ndim: int):
    """x with axes of length one in front, ndim in all."""
    return x.reshape((1,) * (ndim - x.ndim) + x.shape)


def _namespace(*arrays):
    return jnp if any(isinstance(x, jax.Array) for x in arrays) else np


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
    errors:     the same set for kernels; its leading axes are (...).
    frames:     consecutive n directions are the only bases, for n with too many combinations.
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
        """(...) bool: whether zero error is in the set."""
        return (self.half >= np.abs(self.centre)).all(axis=-1)

    @property
    def inner_box(self) -> np.ndarray:
        """(..., n) finite half widths about zero of a box inside, in the proportions of the box
        around the set, rounded down; zero where zero error is outside.
        """
        finite = np.minimum(self.half, NO_CLAIM)
        n = self.directions.shape[-1]
        around = np.abs(self.centre[..., :n]) + finite[..., :n]
        across = (np.abs(self.directions) * around[..., None, :]).sum(axis=-1)
        left = np.maximum(finite - np.abs(self.centre), 0)
        share = np.divide(left, across, out=np.ones_like(left), where=across > 0).min(axis=-1)
        return share[..., None] * around / _UP**4

    def half_around(self, size: npt.ArrayLike) -> np.ndarray:
        """(..., R) largest |u_j . e| over all |e| <= size (..., n), rounded up."""
        n = self.directions.shape[-1]
        size = np.broadcast_to(size, (*self.directions.shape[:-2], n))
        across = (np.abs(self.directions[..., n:, :]) * size[..., None, :]).sum(axis=-1) * _UP
        return np.concatenate([size, across], axis=-1)

    def with_half(self, half: np.ndarray) -> "Faces":
        """Half widths rounded up, so that they add to the centre exactly. Raises InputError."""
        whole = np.ceil(np.ldexp(half, HALF_BITS))
        return faces(self.directions, self.centre, np.ldexp(whole, -HALF_BITS), self.frames)

    def times(self, factor: float) -> "Faces":
        """The set, with zero, times a factor; rounded outward, nested as their factors are."""
        low = np.floor(np.ldexp(factor * np.minimum(self.centre - self.half, 0.0), CENTRE_BITS))
        high = np.ceil(np.ldexp(factor * np.maximum(self.centre + self.half, 0.0), CENTRE_BITS))
        both = np.add(low, high, out=np.zeros(low.shape), where=np.isfinite(self.half))
        middle, half = (np.ldexp(x, -CENTRE_BITS - 1) for x in (both, high - low))
        return faces(self.directions, middle, half, self.frames)

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
        """All arrays by name, for `templates_of`."""
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
    return Faces(directions, centre, half, template(directions, centre, half, frames), frames)


def short(values: np.ndarray, bits: int) -> np.ndarray:
    """The values rounded to multiples of 2^-bits, without negative zeros."""
    # a fraction has no negative zero: a file would lose it, and with it the hash of the tube
    return np.round(np.ldexp(values, bits)) * 2.0**-bits + 0.0
