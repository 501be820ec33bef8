"""Scenes padded to few sizes, so that scenes that differ in values alone share compiled programs.

Padding never holds a plan back: rows 0 x <= FREE, obstacles that are never active.
"""

import numpy as np

from parc_jax.safe_set.separation.pairs import Obstacles
from parc_jax.safe_set.verdict.scene import Scene, SceneArrays

LEAST_ROWS = 8  # of goal and start, so that most scenes agree; a row costs little
LEAST_OBSTACLES = 8  # to which a single scene is padded
# pairs of an obstacle and a part for which first plans and loops have room without compiling anew:
# their kernels look at those that are there, so that room costs nothing
ROOM = 128
FREE = 1e30  # [row units] offset of a row that holds nothing back, and is no plan's least margin


def size_class(n: int, least: int = 1) -> int:
    """Padded size for n rows, obstacles or corners: the next power of two. Depends on the scene
    alone.
    """
    return max(least, 1 << max(n - 1, 0).bit_length())


def padded_to_class(scene: SceneArrays, least_obstacles: int = 1) -> SceneArrays:
    """One scene of a batch padded to its size class. least_obstacles: to which at least."""
    obstacles = scene.obstacles
    n_o, n_m, n_p = obstacles.vertices.shape
    return _with_more_rows(scene).replace(
        obstacles=_padded(obstacles, size_class(n_o, least_obstacles), size_class(n_m, 2**n_p))
    )


def padded(scene: Scene, pairs: int = LEAST_OBSTACLES, corners: int = 0) -> Scene:
    """One scene with room for more obstacles and rows: another one that has a few more, or fewer,
    compiles nothing. pairs, corners: of an obstacle, for which there is room at least.
    """
    obstacles = scene.obstacles
    n_o = size_class(len(obstacles.active), pairs)
    # grown by a box, the corner that is farthest along an axis becomes two
    n_m = corners + 4 if corners and obstacles.closed else corners
    return _with_more_rows(scene).replace(obstacles=_padded(obstacles, n_o, n_m))


def _with_more_rows(scene: SceneArrays) -> SceneArrays:
    goal_A, goal_b = more_rows(scene.goal_A, scene.goal_b)
    start_A, start_b = more_rows(scene.start_A, scene.start_b)
    return scene.replace(goal_A=goal_A, goal_b=goal_b, start_A=start_A, start_b=start_b)


def more_rows(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (..., h, n), b (..., h) with padding rows up to their size class."""
    n = size_class(b.shape[-1], LEAST_ROWS)
    return _longer(A, n, 0.0, axis=-2), _longer(b, n, FREE, axis=-1)


def _padded(obstacles: Obstacles, n_o: int, n_m: int) -> Obstacles:
    """With n_o obstacles, of at least n_m corners."""

    def around(corners: np.ndarray):
        return _longer(_longer(corners, n_o), n_m, axis=1)

    return Obstacles(
        vertices=around(obstacles.vertices),
        signs=around(obstacles.signs) if obstacles.closed else _longer(obstacles.signs, n_o),
        radius=_longer(obstacles.radius, n_o, 0.0),
        points=_longer(obstacles.points, n_o),
        active=_longer(obstacles.active, n_o, False),
    )


def _longer(x: np.ndarray, n: int, fill: float | None = None, axis: int = 0) -> np.ndarray:
    """x with at least n entries along an axis: more of the last one, or of what fills. As numpy.pad
    does, in a tenth of its time, which counts where a scene is new.
    """
    have = x.shape[axis]
    if have >= n:
        return x
    if fill is None:
        return np.take(x, np.minimum(np.arange(n), have - 1), axis=axis)
    shape = list(x.shape)
    shape[axis] = n - have
    return np.concatenate([x, np.full(shape, fill, x.dtype)], axis=axis)
