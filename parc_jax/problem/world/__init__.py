"""The world around the robot: outlines, maps and lidar scans as few convex obstacles that cover it.
Shapely and the like (the extra `maps`) are loaded on first use.
"""

from parc_jax.problem.world.free_space import FreeSpace, free_place
from parc_jax.problem.world.grid_map import GridMap, load_map, occupancy_grid
from parc_jax.problem.world.outlines import Footprint, convex_pieces, read_footprint
from parc_jax.problem.world.seen import seen_from

__all__ = [
    "Footprint",
    "FreeSpace",
    "GridMap",
    "convex_pieces",
    "free_place",
    "load_map",
    "occupancy_grid",
    "read_footprint",
    "seen_from",
]
