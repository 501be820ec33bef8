"""The one inequality that separates: w . p^ > h_O(w) + h_B(-w) + h_E(-w). [T14, T19]

Every test in floats ends here: the projections of points on a direction, and whether they exceed
the *threshold*, the right side with the rounding tolerance. Callers add a loop, over pairs,
directions, plans or intervals, in the order in which their arrays stay in cache. Exact numbers have
the checker, a robot's computer has its header.
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
    """w . p by axes that broadcast: `common.arrays.dot` without a stride. Kernel, NumPy or JAX."""
    return reduce(add, (w[axis] * p[axis] for axis in range(len(w))))


def excess(heights: Sequence[Array], threshold: ArrayLike) -> Array:
    """[m * |w|] signed gap: by how much the least of the projections of points, at both knots of an
    interval, exceeds a threshold; a part of it that several points share may be subtracted later.
    Kernel, NumPy or JAX.
    """
    traced = any(isinstance(x, jax.Array) for x in heights)
    return reduce(jnp.minimum if traced else np.minimum, heights) - threshold


def separates(heights: Sequence[Array], threshold: ArrayLike):
    """Is the signed gap positive? Never of NaN; without the difference. Kernel, NumPy or JAX."""
    return reduce(and_, (x > threshold for x in heights))


def at_both_knots(heights: Array, axis: int = 0) -> tuple[Array, Array]:
    """Projections at T + 1 knots as those at the beginning and at the end of every interval."""
    before = [slice(None)] * heights.ndim
    after = list(before)
    before[axis], after[axis] = slice(None, -1), slice(1, None)
    return heights[tuple(before)], heights[tuple(after)]
