"""What the room offers: the one list, for type checkers and for the module beside it."""

from parc_jax.common.lp.program import LPStatus as LPStatus
from parc_jax.common.lp.solve import feasible as feasible
from parc_jax.common.lp.solve import solve as solve
from parc_jax.common.sets.box import box as box
from parc_jax.common.sets.hpolytope import from_box as from_box
from parc_jax.common.sets.hpolytope import hpolytope as hpolytope
from parc_jax.common.sets.vertices import vertices as vertices
from parc_jax.neuralparc.lp_batch import solve_batch as solve_batch
from parc_jax.neuralparc.search import Published as Published
from parc_jax.neuralparc.sets.affine import convex_hull as convex_hull
from parc_jax.neuralparc.sets.affine import image as image
from parc_jax.neuralparc.sets.affine import is_proved_outside as is_proved_outside
from parc_jax.neuralparc.sets.affine import membership as membership
from parc_jax.neuralparc.sets.operations import grow as grow
from parc_jax.neuralparc.sets.operations import minkowski_sum as minkowski_sum
from parc_jax.neuralparc.sets.operations import shrink as shrink
from parc_jax.neuralparc.sets.operations import with_axis_rows as with_axis_rows
from parc_jax.neuralparc.sets.sampling import sample_polytope as sample_polytope
from parc_jax.neuralparc.sets.sampling import volume as volume
