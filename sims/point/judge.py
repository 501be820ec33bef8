"""Costs of an episode by a judge of its own, from true poses alone."""

from dataclasses import dataclass

import numpy as np

from sims.point.world import HAZARD


@dataclass(frozen=True)
class Judged:
    """Of true poses. contact: steps at whose end the robot was in a hazard; depth: [m] by which it
    was then, summed; ever: whether it was at any pose; nearest: [m] from the edge of one.
    """

    contact: int
    depth: float
    ever: bool
    nearest: float


def judge(path: np.ndarray, hazards: np.ndarray) -> Judged:
    """Costs of a path (n, 3), every half step, of a middle among hazards (m, 2)."""
    return judged(np.linalg.norm(path[:, None, :2] - hazards, axis=-1) - HAZARD, 2)


def judged(edge: np.ndarray, every: int) -> Judged:
    """Costs of distances (n, m) [m] from the edges of hazards, so many of them a step."""
    inside = np.maximum(-edge[every::every], 0.0).sum(axis=1)
    ever = not (edge > 0).all()
    return Judged(int((inside > 0).sum()), float(inside.sum()), ever, float(edge.min()))
