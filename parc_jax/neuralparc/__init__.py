"""The published method (PARC, NeuralPARC), a guest room: the baseline of benchmarks, the method
`Published` of a query, and the sets and checked linear programs that both are written in:
docs/sets.md and docs/lp.md. Nothing of the engine comes in.
"""

from parc_jax.common.lp.program import LPStatus
from parc_jax.common.lp.solve import feasible, solve
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope
from parc_jax.common.sets.vertices import vertices
from parc_jax.neuralparc.lp_batch import solve_batch
from parc_jax.neuralparc.search import Published
from parc_jax.neuralparc.sets.affine import convex_hull, image
from parc_jax.neuralparc.sets.membership import is_proved_outside, membership
from parc_jax.neuralparc.sets.operations import grow, minkowski_sum, shrink, with_axis_rows
from parc_jax.neuralparc.sets.sampling import sample_polytope, volume

__all__ = [
    "LPStatus",
    "Published",
    "box",
    "convex_hull",
    "feasible",
    "from_box",
    "grow",
    "hpolytope",
    "image",
    "is_proved_outside",
    "membership",
    "minkowski_sum",
    "sample_polytope",
    "shrink",
    "solve",
    "solve_batch",
    "vertices",
    "volume",
    "with_axis_rows",
]
