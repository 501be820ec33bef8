"""What the room offers: the one list, for type checkers and for `__init__.py`."""

from parc_jax.problem.body import hull as hull
from parc_jax.problem.problem import Span as Span
from parc_jax.problem.problem import goal_of_points as goal_of_points
from parc_jax.problem.world.free_space import FreeSpace as FreeSpace
from parc_jax.problem.world.free_space import free_place as free_place
from parc_jax.problem.world.grid_map import GridMap as GridMap
from parc_jax.problem.world.grid_map import load_map as load_map
from parc_jax.problem.world.grid_map import occupancy_grid as occupancy_grid
from parc_jax.problem.world.movers import Mover as Mover
from parc_jax.problem.world.movers import mover_obstacles as mover_obstacles
from parc_jax.problem.world.movers import mover_runs as mover_runs
from parc_jax.problem.world.movers import see_mover as see_mover
from parc_jax.problem.world.moving import moving as moving
from parc_jax.problem.world.outlines import Footprint as Footprint
from parc_jax.problem.world.outlines import convex_pieces as convex_pieces
from parc_jax.problem.world.outlines import read_footprint as read_footprint
from parc_jax.problem.world.seen import seen_from as seen_from
from parc_jax.safe_set.batch.box_scenes import box_scenes as box_scenes
