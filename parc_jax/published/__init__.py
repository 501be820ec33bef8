"""The published method (PARC, NeuralPARC), a guest room: the baseline of benchmarks, the method
`Published` of a query, and the sets and checked linear programs that both are written in:
docs/sets.md and docs/lp.md. Nothing of the engine comes in.
"""

from parc_jax.lp.solve import feasible, solve
from parc_jax.lp.status import LPStatus
from parc_jax.published.lp_batch import feasible_batch, solve_batch
from parc_jax.published.method import Published
from parc_jax.published.sets.affine import (
    convex_hull,
    image,
    intersection,
    preimage,
    product,
    projection,
)
from parc_jax.published.sets.ahpolytope import AHPolytope, ahpolytope, as_ah
from parc_jax.published.sets.hit_and_run import sample_polytopes
from parc_jax.published.sets.membership import (
    find_point,
    find_points,
    is_proved_empty,
    is_proved_outside,
    membership,
    memberships,
    with_bounds,
)
from parc_jax.published.sets.minkowski import grow, minkowski_sum, polygon_sum, with_axis_rows
from parc_jax.published.sets.pontryagin import pontryagin_difference, shrink
from parc_jax.published.sets.redundancy import without_redundant_rows
from parc_jax.published.sets.sampling import sample_polytope
from parc_jax.published.sets.support import support
from parc_jax.published.sets.volume import triangulate, volume
from parc_jax.sets.bounding_box import bounding_box
from parc_jax.sets.box import Box, box
from parc_jax.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.sets.rational import rational_vertices
from parc_jax.sets.vertices import chebyshev_center, vertices

__all__ = [
    "AHPolytope",
    "Box",
    "HPolytope",
    "LPStatus",
    "Published",
    "ahpolytope",
    "as_ah",
    "bounding_box",
    "box",
    "chebyshev_center",
    "convex_hull",
    "feasible",
    "feasible_batch",
    "find_point",
    "find_points",
    "from_box",
    "grow",
    "hpolytope",
    "image",
    "intersection",
    "is_proved_empty",
    "is_proved_outside",
    "membership",
    "memberships",
    "minkowski_sum",
    "polygon_sum",
    "pontryagin_difference",
    "preimage",
    "product",
    "projection",
    "rational_vertices",
    "sample_polytope",
    "sample_polytopes",
    "shrink",
    "solve",
    "solve_batch",
    "support",
    "triangulate",
    "vertices",
    "volume",
    "with_axis_rows",
    "with_bounds",
    "without_redundant_rows",
]
