"""How near CRAX's robot is to what costs, from true poses alone: a judge of its own."""

import numpy as np

from sims.crax.world import SIDES, WALLS
from sims.point.judge import Judged, judged

BALL, ARROW, HALF = 0.1, 0.1, 0.05  # [m] its ball's radius, the middle of its arrow, half the edge
SUBSTEPS = 4  # poses a step
SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


def judge(path: np.ndarray, world) -> Judged:
    """Costs of true poses (n, 3) every step of MuJoCo: a middle in a flat hazard, the robot's
    outline as seen from above in a solid one or a wall.
    """
    return judged(edges(path, world), SUBSTEPS)


def edges(path: np.ndarray, world) -> np.ndarray:
    """(n, hazards and walls) [m] from what costs, negative where it does."""
    columns = []
    for middle, size, square, solid in zip(
        world.hazards, world.sizes, world.square, world.solid, strict=True
    ):
        if not solid:
            columns.append(np.linalg.norm(path[:, :2] - middle, axis=1) - size)
        elif square:
            columns.append(_from_box(path, middle, np.full(2, size)))
        else:
            columns.append(_from_disc(path, middle, size))
    columns += [_from_box(path, middle, half) for middle, half in zip(WALLS, SIDES, strict=True)]
    return np.stack(columns, axis=1)


def _from_disc(path: np.ndarray, middle: np.ndarray, radius: float) -> np.ndarray:
    ball = np.linalg.norm(path[:, :2] - middle, axis=1) - BALL
    arrow = _outside(_in_arrow(path, middle[None])[:, 0], np.full(2, HALF))
    return np.minimum(ball, arrow) - radius


def _from_box(path: np.ndarray, middle: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Of two boxes a corner of one is nearest to the other, or the first inside it."""
    ball = _outside(path[:, :2] - middle, half) - BALL
    cos, sin = np.cos(path[:, 2]), np.sin(path[:, 2])
    local = [ARROW, 0.0] + HALF * SQUARE
    turned = np.stack(
        [
            np.outer(cos, local[:, 0]) - np.outer(sin, local[:, 1]),
            np.outer(sin, local[:, 0]) + np.outer(cos, local[:, 1]),
        ],
        axis=-1,
    )
    own = _outside(path[:, None, :2] + turned - middle, half).min(axis=1)
    other = _outside(_in_arrow(path, middle + half * SQUARE), np.full(2, HALF)).min(axis=1)
    return np.minimum(ball, np.minimum(own, other))


def _in_arrow(path: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (m, 2) as seen from the arrow's middle at each pose, (n, m, 2)."""
    away = points - path[:, None, :2]
    cos, sin = np.cos(path[:, 2])[:, None], np.sin(path[:, 2])[:, None]
    x = cos * away[..., 0] + sin * away[..., 1] - ARROW
    return np.stack([x, cos * away[..., 1] - sin * away[..., 0]], axis=-1)


def _outside(points: np.ndarray, half: np.ndarray) -> np.ndarray:
    """(...,) [m] of points (..., 2) from a box around 0, negative inside."""
    over = np.abs(points) - half
    return np.linalg.norm(np.maximum(over, 0.0), axis=-1) + np.minimum(over.max(axis=-1), 0.0)
