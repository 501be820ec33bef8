"""Shapes of the arguments of most kernels, in the axis letters of docs/notation.md: n_c = n_points
n_p columns. A size has one value in a call, `_` any.
"""

import jax
import numpy as np
from jaxtyping import ArrayLike, Float, Int

Scalar = Float[ArrayLike, ""]
Key = jax.Array | np.ndarray  # of `jax.random`, of either kind; as words also on the host
Index = Int[ArrayLike, ""]  # the number of an obstacle, a pair, a bin, an interval
Indices = Int[ArrayLike, "..."]
Vector = Float[ArrayLike, " n_p"]  # a point or a direction
Vectors = Float[ArrayLike, "_ n_p"]
Directions = Float[ArrayLike, "d n_p"]
Supports = Float[ArrayLike, " d"]  # along directions
Params = Float[ArrayLike, " n_k"]
State = Float[ArrayLike, " n_q"]
Knot = Float[ArrayLike, " n_c"]  # all points at one time
Path = Float[ArrayLike, "knots n_c"]
# of a batch, side by side
Positions = Float[ArrayLike, "b n_p"]
ManyParams = Float[ArrayLike, "b n_k"]
States = Float[ArrayLike, "b n_q"]
Paths = Float[ArrayLike, "b knots n_c"]
Numbers = Int[ArrayLike, " b"]
Items = Int[ArrayLike, " items"]  # numbers of what is looked at together, such as pairs
