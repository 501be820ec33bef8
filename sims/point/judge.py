"""Costs of an episode by a judge of its own, from true poses alone."""

from dataclasses import dataclass

import numpy as np

from sims.point.world import HAZARD


@dataclass(frozen=True)
class Judged:
    """Of true poses (n, 3) every half step. contact: steps at whose end the robot's middle was in a
    hazard; depth: [m] by which it was then, summed; ever: whether it was at any pose; nearest: [m]
    from the edge of one.
    """

    contact: int
    depth: float
    ever: bool
    nearest: float


def judge(path: np.ndarray, hazards: np.ndarray) -> Judged:
    """Costs of a path among hazards (m, 2) of radius HAZARD."""
    edge = np.linalg.norm(path[:, None, :2] - hazards, axis=-1) - HAZARD
    inside = np.maximum(-edge[2::2], 0.0).sum(axis=1)
    ever = not (edge > 0).all()
    return Judged(int((inside > 0).sum()), float(inside.sum()), ever, float(edge.min()))
