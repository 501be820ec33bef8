"""A safe piece: pattern, bin, directions and one inner point. Everything else follows from them."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from parc_jax.avoid.directions import Multiplier
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel
from parc_jax.sets.hpolytope import HPolytope


class Run(NamedTuple):
    """A direction that separates one obstacle from interval `first` up to, not including, `end`.

    w (2,), reach: support of obstacle and body along w. multiplier: what spells w exactly.
    """

    first: int
    end: int
    multiplier: Multiplier
    w: np.ndarray
    reach: float


class Piece:
    """The polytope of all (p0, k) with this pattern, in this bin, separated by these runs. Build with `grow_pieces`.

    p0 (n_p,), k (n_k,): a point strictly inside. pattern (n_hidden,) bool. runs: per obstacle a tuple of Run.
    """

    def __init__(self, model: TrajectoryModel, scene: Scene, p0, k, pattern, bin_number: int, runs):
        self.p0, self.k, self.pattern, self.bin, self.runs = p0, k, pattern, int(bin_number), runs
        self._model, self._scene = model, scene

    @cached_property
    def separation(self) -> tuple[np.ndarray, np.ndarray]:
        """Every inequality w . p^_knot > bound: rows (r, 3) of (w_x, w_y, knot) and bounds (r,), slack included."""
        error = self._model.tube.interval[self.bin]
        knots, ws, bounds = [], [], []
        for runs in self.runs:
            for run in runs:
                span = np.arange(run.first, run.end)
                need = run.reach + np.abs(run.w) @ error[span].T + self._scene.slack * np.abs(run.w).sum()
                for shift in (0, 1):
                    knots.append(span + shift)
                    bounds.append(need)
                    ws.append(np.broadcast_to(run.w, (len(span), 2)))
        if not knots:
            return np.zeros((0, 3)), np.zeros(0)
        rows = np.column_stack([np.concatenate(ws), np.concatenate(knots)])
        return rows, np.concatenate(bounds)

    def contains_paths(self, path: np.ndarray) -> np.ndarray:
        """path (b, T + 1, 2) of points known to share pattern, bin, goal and start -> bool (b,): inside this piece."""
        rows, bounds = self.separation
        at = path[:, rows[:, 2].astype(int)]
        return (at[..., 0] * rows[:, 0] + at[..., 1] * rows[:, 1] > bounds).all(axis=1)

    @cached_property
    def polytope(self) -> HPolytope:
        """The piece as float64 rows over (p0, k), redundant time rows dropped; every row is pulled in by the slack."""
        model, scene, n_p = self._model, self._scene, self._model.n_p
        first, C, d = affine_map(model.net, self.pattern)
        T = model.time.n_steps
        offset_C = np.concatenate([np.zeros((1, n_p, model.n_k)), C[: T * n_p].reshape(T, n_p, -1)])
        offset_d = np.concatenate([np.zeros((1, n_p)), d[: T * n_p].reshape(T, n_p)])
        lo, hi = model.tube.bin_box(self.bin)
        eye, none = np.eye(model.n_k), np.zeros((model.n_k, n_p))
        final = model.tube.final[self.bin]
        goal_p, goal_q = scene.goal_A[:, :n_p], scene.goal_A[:, n_p:]
        rows, bounds = self.separation
        knot = rows[:, 2].astype(int)
        parts = [
            (np.hstack([none, eye]), hi),
            (np.hstack([none, -eye]), -lo),
            (np.hstack([np.zeros((len(first[0]), n_p)), first[0]]), first[1]),
            (
                np.hstack([goal_p, goal_p @ offset_C[-1] + goal_q @ C[T * n_p :]]),
                scene.goal_b - np.abs(scene.goal_A) @ final - goal_p @ offset_d[-1] - goal_q @ d[T * n_p :],
            ),
            (np.hstack([scene.start_A, np.zeros((len(scene.start_A), model.n_k))]), scene.start_b),
            (
                np.hstack([-rows[:, :2], -np.einsum("ri,rik->rk", rows[:, :2], offset_C[knot])]),
                -bounds + np.einsum("ri,ri->r", rows[:, :2], offset_d[knot]),
            ),
        ]
        A, b = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
        size = np.abs(A).sum(axis=1)
        real = size > 0
        return HPolytope(A[real], b[real] - scene.slack * size[real])


def affine_map(net, pattern: np.ndarray):
    """Region rows ((h, n_k), (h,)) and output map C (n_out, n_k), d (n_out,) of an activation pattern. Float64."""
    C, d = np.eye(net.n_in), np.zeros(net.n_in)
    rows, bounds, at = [], [], 0
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        C, d = W @ C, W @ d + b
        on = pattern[at : at + len(b)]
        at += len(b)
        sign = np.where(on, -1.0, 1.0)
        rows.append(sign[:, None] * C)
        bounds.append(-sign * d)
        C, d = np.where(on[:, None], C, 0.0), np.where(on, d, 0.0)
    region = (np.concatenate(rows), np.concatenate(bounds)) if rows else (np.zeros((0, net.n_in)), np.zeros(0))
    return region, net.weights[-1] @ C, net.weights[-1] @ d + net.biases[-1]
