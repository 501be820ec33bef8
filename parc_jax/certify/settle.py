"""Intervals that need no choice: one facet normal separates every candidate there. Most of a manoeuvre is like that."""

import numpy as np

from parc_jax.certify.draw import Points
from parc_jax.certify.scene import Scene


def settle(scene: Scene, tube, points: Points) -> np.ndarray:
    """(o, T) direction index that separates all points, 0 where the obstacle is absent, -1 where a choice is needed.

    Runs are kept long: a direction goes on for as long as it separates everything.
    """
    n_o, n_steps = scene.obstacles.active.shape
    settled = np.zeros((n_o, n_steps), int)
    error = np.maximum.reduce(tube.interval[np.unique(points.bin)])
    lowest = np.minimum(points.path[:, :-1], points.path[:, 1:])
    highest = np.maximum(points.path[:, :-1], points.path[:, 1:])
    lo, hi = lowest.min(axis=0), highest.max(axis=0)
    for o in range(n_o):
        w = scene.directions.w[o, : scene.directions.n_facets]
        need = scene.directions.reach[o, : len(w), None] + np.abs(w) @ (error.T + scene.slack)
        least = np.where(w[:, :1, None] > 0, w[:, :1, None] * lo[:, 0], w[:, :1, None] * hi[:, 0])[:, 0]
        least = least + np.where(w[:, 1:, None] > 0, w[:, 1:, None] * lo[:, 1], w[:, 1:, None] * hi[:, 1])[:, 0]
        settled[o] = longest(least > need)
        settled[o, ~scene.obstacles.active[o]] = 0
    return settled


def longest(ok: np.ndarray) -> np.ndarray:
    """ok (d, T) -> (T,): index of the direction that lasts longest from each change on, -1 where none holds."""
    length = np.zeros(ok.shape, int)
    for t in range(ok.shape[1] - 1, -1, -1):
        length[:, t] = np.where(ok[:, t], 1 + (length[:, t + 1] if t + 1 < ok.shape[1] else 0), 0)
    out, current = np.full(ok.shape[1], -1), -1
    for t in range(ok.shape[1]):
        if current < 0 or not ok[current, t]:
            current = int(np.argmax(length[:, t])) if ok[:, t].any() else -1
        out[t] = current
    return out
