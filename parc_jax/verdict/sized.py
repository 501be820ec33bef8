"""Scenes padded to few sizes, so that scenes that differ in values alone share compiled programs.

Padding never holds a plan back: rows 0 x <= FREE, obstacles that are never active.
"""

import numpy as np

from parc_jax.obstacles.grown import GrownObstacles
from parc_jax.obstacles.pairs import Pairs
from parc_jax.verdict.scene import Scene

LEAST_ROWS = 8  # of goal and start, so that most scenes agree; a row costs little
# a single scene is padded to so many: kernels look at those that are there, so room costs little
LEAST_OBSTACLES = 8
FREE = 1e30  # [row units] offset of a row that holds nothing back, and is no plan's least margin


def size_class(n: int, least: int = 1) -> int:
    """Padded size for n rows, obstacles or corners: the next power of two. Depends on the scene
    alone.
    """
    return max(least, 1 << max(n - 1, 0).bit_length())


def sized(scene: Scene, least_obstacles: int = 1) -> Scene:
    """One scene of a batch padded to its size class, as a kernel takes it: without what only the
    host reads. least_obstacles: to which it is padded at least.
    """
    obstacles = scene.obstacles
    corners = obstacles.vertices if isinstance(obstacles, Pairs) else obstacles.corner
    n_o, n_m, n_p = corners.shape
    return _with_more_rows(scene).replace(
        obstacles=_padded(obstacles, size_class(n_o, least_obstacles), size_class(n_m, 2**n_p)),
        directions=None,
        problem=None,
        apart=None,
        at=None,
        count=None,
    )


def roomy(scene: Scene) -> Scene:
    """One scene with room for more obstacles and rows: another one that has a few more, or fewer,
    compiles nothing.
    """
    n_o = size_class(len(scene.obstacles.active), LEAST_OBSTACLES)
    table = scene.directions
    if table is not None:
        more = (0, n_o - len(table.w))
        w = np.pad(table.w, (more, (0, 0), (0, 0)))
        table = table.replace(w=w, support=np.pad(table.support, (more, (0, 0))))
    obstacles = _padded(scene.obstacles, n_o, 0)
    return _with_more_rows(scene).replace(obstacles=obstacles, directions=table)


def _with_more_rows(scene: Scene) -> Scene:
    goal_A, goal_b = more_rows(scene.goal_A, scene.goal_b)
    start_A, start_b = more_rows(scene.start_A, scene.start_b)
    return scene.replace(goal_A=goal_A, goal_b=goal_b, start_A=start_A, start_b=start_b)


def more_rows(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (..., h, n), b (..., h) with padding rows up to their size class."""
    extra = (0, size_class(b.shape[-1], LEAST_ROWS) - b.shape[-1])
    none = [(0, 0)] * (b.ndim - 1)
    return np.pad(A, [*none, extra, (0, 0)]), np.pad(b, [*none, extra], constant_values=FREE)


def _padded(obstacles: GrownObstacles | Pairs, n_o: int, n_m: int) -> GrownObstacles | Pairs:
    """With n_o obstacles, of at least n_m corners."""
    more_o = (0, n_o - len(obstacles.active))
    none = (0, 0)
    corners = obstacles.vertices if isinstance(obstacles, Pairs) else obstacles.corner
    more_m = (0, max(n_m - corners.shape[1], 0))
    around = (more_o, more_m, none)
    active = np.pad(obstacles.active, (more_o, none))
    if isinstance(obstacles, GrownObstacles):
        return obstacles.replace(
            corner=np.pad(obstacles.corner, around, mode="edge"),
            sign=np.pad(obstacles.sign, around, mode="edge"),
            active=active,
        )
    return Pairs(
        vertices=np.pad(obstacles.vertices, around, mode="edge"),
        radius=np.pad(obstacles.radius, more_o),
        points=np.pad(obstacles.points, (more_o, none), mode="edge"),
        active=active,
    )
