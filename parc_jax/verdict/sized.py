"""Scenes padded to few sizes, so that scenes that differ in values alone share compiled programs.

Padding never holds a plan back: rows 0 x <= 1, obstacles that are never active.
"""

import numpy as np

from parc_jax.obstacles.grown import GrownObstacles
from parc_jax.obstacles.pairs import Pairs
from parc_jax.verdict.scene import Scene

LEAST_ROWS = 8  # of goal and start, so that most scenes agree; a row costs little


def size_class(n: int, least: int = 1) -> int:
    """Padded size for n rows, obstacles or corners: the next power of two. Depends on the scene
    alone.
    """
    return max(least, 1 << max(n - 1, 0).bit_length())


def sized(scene: Scene, least_obstacles: int = 1) -> Scene:
    """One scene padded to its size class, as a kernel takes it: without what only the host
    reads. least_obstacles: to which it is padded at least.
    """
    goal_A, goal_b = more_rows(scene.goal_A, scene.goal_b)
    start_A, start_b = more_rows(scene.start_A, scene.start_b)
    return scene.replace(
        goal_A=goal_A,
        goal_b=goal_b,
        start_A=start_A,
        start_b=start_b,
        obstacles=_sized_obstacles(scene.obstacles, least_obstacles),
        directions=None,
        problem=None,
        apart=None,
        at=None,
    )


def more_rows(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (..., h, n), b (..., h) with padding rows up to their size class."""
    extra = (0, size_class(b.shape[-1], LEAST_ROWS) - b.shape[-1])
    none = [(0, 0)] * (b.ndim - 1)
    return np.pad(A, [*none, extra, (0, 0)]), np.pad(b, [*none, extra], constant_values=1.0)


def _sized_obstacles(obstacles: GrownObstacles | Pairs, least: int) -> GrownObstacles | Pairs:
    more_o = (0, size_class(len(obstacles.active), least) - len(obstacles.active))
    none = (0, 0)
    corners = obstacles.vertices if isinstance(obstacles, Pairs) else obstacles.corner
    more_m = (0, size_class(corners.shape[1], 2 ** corners.shape[2]) - corners.shape[1])
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
