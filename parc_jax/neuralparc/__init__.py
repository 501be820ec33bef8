"""The published method (PARC, NeuralPARC), a guest room: the baseline of benchmarks, the method
`Published` of a query, and the sets and checked linear programs that both are written in:
docs/sets.md and docs/lp.md. Nothing of the engine comes in.
"""

from parc_jax.common.lp.program import LPStatus
from parc_jax.common.lp.solve import feasible, solve
from parc_jax.common.sets.bounding_box import bounding_box
from parc_jax.common.sets.box import Box, box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.common.sets.rational import rational_vertices
from parc_jax.common.sets.vertices import chebyshev_center, vertices
from parc_jax.neuralparc.lp_batch import feasible_batch, solve_batch
from parc_jax.neuralparc.search import Published
from parc_jax.neuralparc.sets.affine import (
    AHPolytope,
    ahpolytope,
    as_ah,
    convex_hull,
    image,
    intersection,
    preimage,
    product,
    projection,
)
from parc_jax.neuralparc.sets.membership import (
    find_point,
    find_points,
    is_proved_empty,
    is_proved_outside,
    membership,
    memberships,
    support,
    with_bounds,
)
from parc_jax.neuralparc.sets.operations import (
    grow,
    minkowski_sum,
    polygon_sum,
    pontryagin_difference,
    shrink,
    with_axis_rows,
    without_redundant_rows,
)
from parc_jax.neuralparc.sets.sampling import sample_polytope, sample_polytopes, triangulate, volume

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
