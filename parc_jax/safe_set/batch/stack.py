"""Many problems as stacked arrays: scenes of one padded size share one compiled program."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import ReachAvoid
from parc_jax.safe_set.verdict.scene import (
    SceneArrays,
    apart_from_plans,
    scene_arrays,
    size_class,
    sized,
)

FEW = 4  # obstacles that cost less than telling which of them are far


class SizeClass(NamedTuple):
    """Scenes of one padded size.

    rows: (s,) where they stand in the question. scenes: with a leading axis s.
    """

    rows: np.ndarray
    scenes: SceneArrays


def stack_problems(problems: Sequence[ReachAvoid], model: TrajectoryModel) -> list[SizeClass]:
    """Lay out a list of problems, grouped by padded size, without the obstacles that no plan comes
    near. Raises InputError that names the first bad one.

    About a millisecond of Python per problem: the corners of grown obstacles are exact.
    `box_scenes` has no such cost.
    """
    alike: dict[int, list[tuple[int, SceneArrays]]] = {}
    for row, problem in enumerate(problems):
        try:
            one = _laid_out(problem, model)
        except InputError as error:
            raise InputError(f"problem {row} of the batch: {error}") from None
        alike.setdefault(size_class(len(problem.obstacles)), []).append((row, one))
    groups: dict[tuple, list[tuple[int, SceneArrays]]] = {}
    for some in alike.values():
        # all as large as the largest: to leave obstacles out is not to make more programs
        most = size_class(max(len(one.obstacles.active) for _, one in some))
        for row, one in some:
            padded = sized(one, most)
            groups.setdefault(shape_of(padded), []).append((row, padded))
    return [
        SizeClass(
            np.array([row for row, _ in group]),
            jax.tree.map(lambda *x: np.stack(x), *(one for _, one in group)),
        )
        for group in groups.values()
    ]


def _laid_out(problem: ReachAvoid, model: TrajectoryModel) -> SceneArrays:
    few = len(problem.obstacles) <= FEW
    return scene_arrays(problem, model, None if few else apart_from_plans(problem, model))


def shape_of(scenes: SceneArrays) -> tuple:
    """Shapes of all arrays: scenes that agree in it can be stacked."""
    return tuple(np.shape(x) for x in jax.tree.leaves(scenes))


def check_stack(scenes: SceneArrays, model: TrajectoryModel) -> int:
    """Number of scenes in stacked arrays. Raises InputError when they are no stack for this
    model.
    """
    leaves = jax.tree.leaves(scenes)
    counts = {np.shape(x)[0] if np.ndim(x) else None for x in leaves}
    if scenes.count is not None or len(counts) != 1 or None in counts:
        raise InputError(
            "solve_batch: expected stacked scenes, every array with the same leading axis; "
            f"got {sorted(map(str, counts))}. Build them with box_scenes or stack_problems."
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
