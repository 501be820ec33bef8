"""The one inequality that separates: w . p^ > h_O(w) + h_B(-w) + h_E(-w). [T14, T19]

All that is asked in floats ends here: how high points are along a direction, and whether that
exceeds its *threshold*, the right side with the slack. What callers add is a loop, over pairs,
directions, plans or intervals, in the order in which their arrays stay in cache. Exact numbers have
the checker, a robot's own computer has its header.
"""

from collections.abc import Sequence
from functools import reduce
from operator import add, and_

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

Array = Float[ArrayLike, "..."]
Axes = Sequence[ArrayLike] | Array  # of vectors, axis by axis


def height(w: Axes, p: Axes) -> Array:
    """w . p, both told axis by axis, which broadcast: as `base.arrays.dot`, but read without a
    stride. Kernel, NumPy or JAX.
    """
    return reduce(add, (w[axis] * p[axis] for axis in range(len(w))))


def excess(heights: Sequence[Array], threshold: ArrayLike) -> Array:
    """[m * |w|] by how much the least of the heights of points, those at both knots of an interval,
    exceeds a threshold; what several points share of it may be taken off later. Kernel, NumPy or
    JAX.
    """
    traced = any(isinstance(x, jax.Array) for x in heights)
    return reduce(jnp.minimum if traced else np.minimum, heights) - threshold


def separates(heights: Sequence[Array], threshold: ArrayLike):
    """Is that positive? bool, never of NaN; told without the difference. Kernel, NumPy or JAX."""
    return reduce(and_, (x > threshold for x in heights))


def at_both_knots(heights: Array, axis: int = 0) -> tuple[Array, Array]:
    """Of heights at T + 1 knots those at the beginning and at the end of every interval."""
    before = [slice(None)] * heights.ndim
    after = list(before)
    before[axis], after[axis] = slice(None, -1), slice(1, None)
    return heights[tuple(before)], heights[tuple(after)]
