"""Many problems as stacked arrays: scenes of one padded size share one compiled program."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel
from parc_jax.obstacles.grown import GrownObstacles
from parc_jax.obstacles.pairs import Pairs
from parc_jax.problem import ReachAvoid
from parc_jax.verdict.scene import Scene, bare_scene

LEAST_ROWS = 8  # of goal and start, so that most scenes agree; a row costs little


class SizeClass(NamedTuple):
    """Scenes of one padded size.

    rows: (s,) where they stand in the question. scenes: Scene with a leading axis s.
    """

    rows: np.ndarray
    scenes: Scene


def size_class(n: int, least: int = 1) -> int:
    """Padded size for n rows, obstacles or corners: the next power of two. Depends on the scene
    alone.
    """
    return max(least, 1 << max(n - 1, 0).bit_length())


def stack_problems(problems: Sequence[ReachAvoid], model: TrajectoryModel) -> list[SizeClass]:
    """Lay out a list of problems, grouped by padded size. Raises InputError that names the first
    bad one.

    About a millisecond of Python per problem: the corners of grown obstacles are exact.
    `box_scenes` has no such cost.
    """
    groups: dict[tuple, list[tuple[int, Scene]]] = {}
    for row, problem in enumerate(problems):
        try:
            one = sized(bare_scene(problem, model))
        except InputError as error:
            raise InputError(f"problem {row} of the batch: {error}") from None
        groups.setdefault(shape_of(one), []).append((row, one))
    return [
        SizeClass(
            np.array([row for row, _ in group]),
            jax.tree.map(lambda *x: np.stack(x), *(one for _, one in group)),
        )
        for group in groups.values()
    ]


def sized(scene: Scene) -> Scene:
    """One scene padded to its size class. Padding never holds a plan back: rows 0 x <= 1, obstacles
    never active.
    """
    obstacles = _sized_obstacles(scene.obstacles)
    goal_A, goal_b = more_rows(scene.goal_A, scene.goal_b)
    start_A, start_b = more_rows(scene.start_A, scene.start_b)
    return scene.replace(
        goal_A=goal_A,
        goal_b=goal_b,
        start_A=start_A,
        start_b=start_b,
        obstacles=obstacles,
        directions=None,
        problem=None,
    )


def _sized_obstacles(obstacles: GrownObstacles | Pairs) -> GrownObstacles | Pairs:
    more_o = (0, size_class(len(obstacles.active)) - len(obstacles.active))
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


def shape_of(scenes: Scene) -> tuple:
    """Shapes of all arrays: scenes that agree in it can be stacked."""
    return tuple(np.shape(x) for x in jax.tree.leaves(scenes))


def check_stack(scenes: Scene, model: TrajectoryModel) -> int:
    """Number of scenes in stacked arrays. Raises InputError when they are no stack for this
    model.
    """
    leaves = jax.tree.leaves(scenes)
    counts = {np.shape(x)[0] if np.ndim(x) else None for x in leaves}
    if scenes.directions is not None or len(counts) != 1 or None in counts:
        raise InputError(
            "solve_batch: expected stacked scenes: every array with the same leading axis, "
            f"directions None; got leading axes {sorted(map(str, counts))}. Build them with "
            "box_scenes or stack_problems."
        )
    want = (model.time.n_steps, model.n_p, model.n_k)
    have = (
        scenes.obstacles.active.shape[-1],
        scenes.z_lo.shape[-1],
        scenes.k_lo.shape[-1],
    )
    if want != have:
        raise InputError(
            f"solve_batch: expected scenes of this model, (T, n_p, n_k) = {want}; got {have}."
        )
    return counts.pop()


def more_rows(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (..., h, n), b (..., h) with padding rows up to their size class."""
    extra = (0, size_class(b.shape[-1], LEAST_ROWS) - b.shape[-1])
    none = [(0, 0)] * (b.ndim - 1)
    return np.pad(A, [*none, extra, (0, 0)]), np.pad(b, [*none, extra], constant_values=1.0)
