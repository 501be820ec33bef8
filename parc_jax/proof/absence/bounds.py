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
    """Lines over the inputs x of one hidden layer (n,) that enclose its outputs:
    below x <= max(x, 0) <= above x + height.
    """

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


def least_of_rows(
    layers: Layers,
    lines: Sequence[Lines],
    rows: Float[ArrayLike, "r n"],
    constant: Float[ArrayLike, " r"],
    lo: Params,
    hi: Params,
):
    """Lower bounds (r,) of rows of the outputs of the last of the lines, plus a constant, for k in
    the box lo, hi. layers: before each of the lines.
    """
    for (W, b), line in zip(layers[::-1], lines[::-1], strict=True):
        up = jnp.maximum(rows, 0)
        down = jnp.minimum(rows, 0)
        constant = constant + product(down, line.height)
        rows = up * line.below[None] + down * line.above[None]
        constant = constant + product(rows, b)
        rows = product(rows, W)
    return constant + jnp.minimum(rows * lo[None], rows * hi[None]).sum(axis=1)


def ranges_of_rows(
    layers: Layers,
    rows: Float[ArrayLike, "r n"],
    constant: Float[ArrayLike, " r"],
    lo: Params,
    hi: Params,
):
    """Least and most (r,) of rows of the outputs of the last hidden layer, plus a constant, for k
    in the box lo, hi. Kernel.
    """
    lines: list[Lines] = []
    for depth, (W, b) in enumerate(layers):
        lines.append(lines_between(*_both(layers[:depth], lines, W, b, lo, hi)))
    return _both(layers, lines, rows, constant, lo, hi)


def _both(
    layers: Layers,
    lines: Sequence[Lines],
    rows: Float[ArrayLike, "r n"],
    constant: Float[ArrayLike, " r"],
    lo: Params,
    hi: Params,
):
    least = least_of_rows(layers, lines, rows, constant, lo, hi)
    return least, -least_of_rows(layers, lines, -rows, -constant, lo, hi)
