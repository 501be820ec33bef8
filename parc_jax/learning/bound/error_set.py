"""The errors that one bin of a tube allows at one point during one interval: how far along a
direction they reach. [T14, T26]

A box has half widths along the axes. A template has pairs of parallel faces, |u_j . e - c_j| <= s_j
for a few directions u_j. By duality its support is the least of mu . c + |mu| . s over all mu with
sum mu_j u_j = w that use no more than n of the directions, a *basis*; any one of them is a bound.
"""

from collections.abc import Sequence
from itertools import combinations

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt
from jaxtyping import ArrayLike, Float

from parc_jax.common import struct
from parc_jax.common.errors import InputError

NO_CLAIM = 1e100  # [m, .] wider than any world, and its square is still finite
# [volume spanned by unit directions] A basis that spans less is left out: its multipliers would be
# large, and with them what rounding adds.
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
        """`support` of many directions, told axis by axis: a tuple of n arrays, which broadcast
        against the leading axes. A loop over them reads no array with a stride.
        """
        along = [_product(abs(x), self.half[..., i]) for i, x in enumerate(w)]
        return sum(along[1:], along[0])

    def vertex(self, w: Float[ArrayLike, "*b n"]):
        """(..., n) an error that is farthest along w; without claim the centre."""
        half, w = _same_rank(_finite(self.half), w)
        return _namespace(half, w).where(w >= 0, half, -half)


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
        """`support` of many directions, told axis by axis, as of a box."""
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
        raise InputError(
            f"template: expected at least as many directions as dimensions, {n}; got {n_rows}."
        )
    lead = np.broadcast_shapes(directions.shape[:-2], np.shape(centre)[:-1], np.shape(half)[:-1])
    rows = directions[..., bases, :]
    lengths = np.linalg.norm(rows, axis=-1).prod(axis=-1)
    spans = np.abs(np.linalg.det(rows)) > FLAT * lengths
    rows = np.where(spans[..., None, None], rows, np.eye(n))
    dual = np.swapaxes(np.linalg.inv(rows), -1, -2)
    centre = np.where(spans[..., None], np.asarray(centre, np.float64)[..., bases], 0.0)
    half = np.where(spans[..., None], np.asarray(half, np.float64)[..., bases], np.inf)
    shape = (*lead, *bases.shape)
    return ErrorTemplate(
        np.broadcast_to(dual, (*shape, n)),
        np.broadcast_to(centre, shape),
        np.broadcast_to(half, shape),
    )


def _by_basis(dual: Array, centre: Array, half: Array, w: Array):
    """Multipliers (..., B, n) and the support (..., B) that each basis gives."""
    mu = _total(dual * w)
    return mu, _total(mu * centre + _product(abs(mu), half))


def _product(size: Array, half: Array):
    """size * half, where nothing of an infinite width is nothing."""
    xp = _namespace(size, half)
    return size * xp.where((size == 0) & xp.isinf(half), 0, half)


def _finite(half: Array):
    """half, but nothing where it is infinite."""
    xp = _namespace(half)
    return xp.where(xp.isfinite(half), half, 0)


def _total(x: Array):
    """Sum over the last axis, written out: it never becomes a product of reduced precision."""
    return sum((x[..., i] for i in range(1, x.shape[-1])), x[..., 0])


def _same_rank(*arrays):
    most = max(x.ndim for x in arrays)
    return [_raised(x, most) for x in arrays]


def _raised(x: Array, ndim: int):
    """x with axes of length one in front, ndim in all."""
    return x.reshape((1,) * (ndim - x.ndim) + x.shape)


def _namespace(*arrays):
    return jnp if any(isinstance(x, jax.Array) for x in arrays) else np
