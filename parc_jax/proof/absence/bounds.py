"""Between which affine functions of k a network's outputs lie, over a box of k: bounds in place of
its cells, where those are too many. [T36]

From the first layer to the last, a neuron lies in a range; where that holds zero, its
output x -> max(x, 0) lies between a line through the origin and the chord. Rows of the next layer
are followed back through these lines to k, whose box is then known. Everything is float64 and only
steers the search: the checker follows the rows back again, in exact arithmetic.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Float

from parc_jax.common.arrays import product
from parc_jax.common.shapes import Params

Layers = Sequence[tuple[jax.Array, jax.Array]]  # W, b before each hidden layer


class Lines(NamedTuple):
    """Lines over inputs x (n,) of a hidden layer: below x <= max(x, 0) <= above x + height."""

    below: jax.Array
    above: jax.Array
    height: jax.Array


def lines_between(lo: Float[ArrayLike, " n"], hi: Float[ArrayLike, " n"]) -> Lines:
    """Of neurons whose inputs lie in [lo, hi]."""
    passes = lo >= 0
    blocks = hi <= 0
    chord = hi / jnp.where(passes | blocks, 1.0, hi - lo)
    above = jnp.where(passes, 1.0, jnp.where(blocks, 0.0, chord))
    height = jnp.where(passes | blocks, 0.0, -chord * lo)
    # of the lines through the origin the one with the smaller triangle
    below = jnp.where(passes, 1.0, jnp.where(blocks | (hi <= -lo), 0.0, 1.0))
    return Lines(below, above, height)


class OverBox(NamedTuple):
    """The first hidden layers of a network for k in the box lo, hi. layers: W, b before each."""

    lo: Params
    hi: Params
    layers: Layers = ()
    lines: tuple[Lines, ...] = ()

    def least(self, rows: Float[ArrayLike, "r n"], constant: Float[ArrayLike, " r"]):
        """Lower bounds (r,) of rows of the outputs of the last of the layers, plus a constant."""
        for (W, b), line in zip(self.layers[::-1], self.lines[::-1], strict=True):
            up = jnp.maximum(rows, 0)
            down = jnp.minimum(rows, 0)
            constant = constant + product(down, line.height)
            rows = up * line.below[None] + down * line.above[None]
            constant = constant + product(rows, b)
            rows = product(rows, W)
        return constant + jnp.minimum(rows * self.lo[None], rows * self.hi[None]).sum(axis=1)

    def range(self, rows: Float[ArrayLike, "r n"], constant: Float[ArrayLike, " r"]):
        """Least and most (r,) of them."""
        return self.least(rows, constant), -self.least(-rows, -constant)


def ranges_of_rows(
    layers: Layers,
    rows: Float[ArrayLike, "r n"],
    constant: Float[ArrayLike, " r"],
    lo: Params,
    hi: Params,
):
    """Least and most (r,) of rows of the last hidden outputs + constant, k in [lo, hi]. Kernel."""
    known = OverBox(lo, hi)
    for W, b in layers:
        lines = (*known.lines, lines_between(*known.range(W, b)))
        known = OverBox(lo, hi, (*known.layers, (W, b)), lines)
    return known.range(rows, constant)
