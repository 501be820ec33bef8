"""The published method (PARC, NeuralPARC), a baseline: the method `Published` of a query, and the
sets and checked linear programs that it is written in: README.md. The engine imports none of it.
"""

from benchmarks.neuralparc.lp_batch import solve_batch
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.lp_solve import feasible, solve
from benchmarks.neuralparc.search import Published
from benchmarks.neuralparc.sets.affine import (
    convex_hull,
    image,
    is_proved_outside,
    membership,
)
from benchmarks.neuralparc.sets.operations import grow, minkowski_sum, shrink, with_axis_rows
from benchmarks.neuralparc.sets.sampling import sample_polytope, volume
from benchmarks.neuralparc.sets.vertices import vertices
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope

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
