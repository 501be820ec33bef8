"""Does a rectangle touch a cylinder? Decided where both truly are."""

import numpy as np

CHUNK = 2_000_000  # distances at a time


def distance_to_cylinders(poses, size, cylinders: np.ndarray, radius: float) -> np.ndarray:
    """Distance (n,) [m] from a rectangle at each pose (n, 3), middle x, y [m] and heading [rad], to
    the nearest cylinder; 0 or less is contact. size: length and width [m]; cylinders (m, 2) [m].
    Infinite where there are none.
    """
    poses = np.atleast_2d(np.asarray(poses, np.float64))
    if len(cylinders) == 0:
        return np.full(len(poses), np.inf)
    step = max(1, CHUNK // len(cylinders))
    parts = [_nearest(poses[i : i + step], size, cylinders) for i in range(0, len(poses), step)]
    return np.concatenate([np.empty(0), *parts]) - radius


def _nearest(poses: np.ndarray, size, cylinders: np.ndarray) -> np.ndarray:
    """Distance (n,) to the nearest middle; negative inside, by how deep."""
    away = cylinders[None] - poses[:, None, :2]
    cos, sin = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
    along = cos * away[..., 0] + sin * away[..., 1]
    across = cos * away[..., 1] - sin * away[..., 0]
    outside = np.stack([np.abs(along) - size[0] / 2, np.abs(across) - size[1] / 2])
    beyond = np.hypot(*np.maximum(outside, 0.0))
    return (beyond + np.minimum(outside.max(axis=0), 0.0)).min(axis=1)
