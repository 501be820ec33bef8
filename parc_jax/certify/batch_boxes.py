"""Scenes made of boxes, laid out for a batch in whole-array operations: no Python cost per scene."""

import numpy as np
from flax import struct

from parc_jax.arrays import as_float64
from parc_jax.avoid.grown import GrownObstacles, grown_obstacles
from parc_jax.certify.batch_scenes import LEAST_CORNERS, more_rows, size_class
from parc_jax.certify.scene import Scene, float_slack, floats_within
from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel
from parc_jax.problem import Disc, Polygon, ReachAvoid, reach_avoid
from parc_jax.sets.box import box


@struct.dataclass
class BoxScenes:
    """s problems of boxes over one body. Build with `box_scenes`, which validates.

    goal_lo, goal_hi: (s, n_p + n_q). obstacle_lo, obstacle_hi: (s, o, 2) [m]. present: (s, o) bool.
    steps: (s, o, 2) int, first and last interval of every obstacle. start_lo, start_hi: (s, 2) [m], infinite if free.
    """

    goal_lo: np.ndarray
    goal_hi: np.ndarray
    obstacle_lo: np.ndarray
    obstacle_hi: np.ndarray
    present: np.ndarray
    steps: np.ndarray
    start_lo: np.ndarray
    start_hi: np.ndarray
    body: Disc | Polygon

    def __len__(self) -> int:
        return len(self.goal_lo)

    def problem(self, i: int) -> ReachAvoid:
        """Scene i as a problem of its own, as `Planner.solve` takes it."""
        kept = np.flatnonzero(self.present[i])
        start = None if not np.isfinite(self.start_lo[i]).all() else box(self.start_lo[i], self.start_hi[i])
        return reach_avoid(
            box(self.goal_lo[i], self.goal_hi[i]),
            [box(self.obstacle_lo[i, j], self.obstacle_hi[i, j]) for j in kept],
            self.body, start, [tuple(int(t) for t in self.steps[i, j]) for j in kept],
        )  # fmt: skip


def box_scenes(
    model: TrajectoryModel, goal_lo, goal_hi, obstacle_lo, obstacle_hi, body, *, start=None, present=None, steps=None
) -> BoxScenes:
    """Validated scenes from arrays of boxes. Raises InputError that names the first bad scene.

    goal_lo, goal_hi (s, n_p + n_q); obstacle_lo, obstacle_hi (s, o, 2), or (o, 2) for the same in all; body: a disc
    radius [m], Disc or Polygon; start: None or (lo (s, 2), hi (s, 2)); present (s, o) bool: which obstacles exist;
    steps (s, o, 2): first and last interval of each.
    """
    goal_lo = as_float64("goal_lo", goal_lo, (None, model.n_p + model.n_q))
    s, T = len(goal_lo), model.time.n_steps
    goal_hi = as_float64("goal_hi", goal_hi, goal_lo.shape)
    lo, hi = (np.asarray(x, np.float64) for x in (obstacle_lo, obstacle_hi))
    lo, hi = (np.broadcast_to(x, (s, *x.shape)) if x.ndim == 2 else x for x in (lo, hi))
    lo, hi = (as_float64(f"obstacle_{name}", x, (s, None, model.n_p)) for name, x in (("lo", lo), ("hi", hi)))
    o = lo.shape[1]
    present = np.ones((s, o), bool) if present is None else np.asarray(present, bool)
    steps = np.tile([0, T - 1], (s, o, 1)) if steps is None else np.asarray(steps, np.int64)
    free = np.full((s, model.n_p), np.inf)
    start_lo, start_hi = (-free, free) if start is None else (as_float64("start", x, (s, model.n_p)) for x in start)
    if hi.shape != lo.shape or present.shape != (s, o) or steps.shape != (s, o, 2) or model.n_p != 2:
        raise InputError(
            f"box_scenes: expected planar obstacles ({s}, {o}, 2), present ({s}, {o}), steps ({s}, {o}, 2); "
            f"got {hi.shape}, {present.shape}, {steps.shape}."
        )
    narrow = 2 * model.tube.final.min(axis=0)
    for name, bad in {
        "a goal wider than twice the model's smallest final error": ((goal_hi - goal_lo) < narrow).any(axis=1),
        "obstacles with lo <= hi": ((lo > hi).any(axis=2) & present).any(axis=1),
        "a start with lo <= hi": (start_lo > start_hi).any(axis=1),
        f"steps 0 <= first <= last < {T}": (
            ((steps[..., 0] < 0) | (steps[..., 0] > steps[..., 1]) | (steps[..., 1] >= T)) & present
        ).any(axis=1),
    }.items():
        if bad.any():
            raise InputError(f"box_scenes: expected {name}; scene {int(np.argmax(bad))} differs.")
    body = body if isinstance(body, Disc | Polygon) else Disc(float(body))
    reach_avoid(box(goal_lo[0], goal_hi[0]) if s else box([0.0, 0.0], [1.0, 1.0]), [], body)  # checks the body
    return BoxScenes(goal_lo, goal_hi, lo, hi, present, steps, start_lo, start_hi, body)


def lay_out_boxes(boxes: BoxScenes, model: TrajectoryModel) -> Scene:
    """Stacked arrays, equal to those of `scene` for every problem up to one rounding of corners of a polygon body."""
    s, o, _ = boxes.obstacle_lo.shape
    T, body_corner, body_sign = model.time.n_steps, *_body_table(boxes.body, model)
    n_o, n_m = size_class(o), size_class(len(body_corner), LEAST_CORNERS)
    upper = (body_sign > 0)[None, None]  # (1, 1, m, 2)
    corner = np.zeros((s, n_o, n_m, 2))
    kept = np.where(upper, boxes.obstacle_hi[:, :, None], boxes.obstacle_lo[:, :, None]) + body_corner[None, None]
    kept = np.where(boxes.present[..., None, None], kept, 0.0)
    corner[:, :o, : len(body_corner)] = kept
    corner[:, :o, len(body_corner) :] = kept[:, :, -1:]
    sign = np.broadcast_to(np.pad(body_sign, ((0, n_m - len(body_sign)), (0, 0)), mode="edge"), (s, n_o, n_m, 2))
    t = np.arange(T)[None, None]
    active = np.zeros((s, n_o, T), bool)
    active[:, :o] = boxes.present[..., None] & (t >= boxes.steps[..., :1]) & (t <= boxes.steps[..., 1:])
    radius = boxes.body.radius if isinstance(boxes.body, Disc) else 0.0
    goal_size = np.abs(np.concatenate([boxes.goal_lo, boxes.goal_hi], axis=1)).max(axis=1, initial=0.0)
    slack = float_slack(model, goal_size + np.abs(corner).max(axis=(1, 2, 3), initial=0.0) + radius)
    k_lo, k_hi = (np.broadcast_to(x, (s, model.n_k)) for x in floats_within(model.domain))
    goal, start = _rows(boxes.goal_lo, boxes.goal_hi), _rows(boxes.start_lo, boxes.start_hi)
    grown = GrownObstacles(corner, sign, np.full(s, float(radius)), active)
    z_lo, z_hi = boxes.goal_lo[:, : model.n_p], boxes.goal_hi[:, : model.n_p]
    return Scene(*goal, *start, z_lo, z_hi, k_lo, k_hi, grown, None, slack)


def _body_table(body, model) -> tuple[np.ndarray, np.ndarray]:
    """Corners (m, 2) and signs (m, 2) of a point obstacle grown by the body: added to a box's corner of equal sign."""
    point = reach_avoid(box([-1.0, -1.0], [1.0, 1.0]), [box([0.0, 0.0], [0.0, 0.0])], body)
    table = grown_obstacles(point, model.time.n_steps)
    return table.corner[0], table.sign[0]


def _rows(lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (s, h, n), b (s, h) of boxes; an infinite side becomes the padding row 0 x <= 1."""
    s, n = lo.shape
    b = np.concatenate([hi, -lo], axis=1)
    A = np.broadcast_to(np.concatenate([np.eye(n), -np.eye(n)]), (s, 2 * n, n)) * np.isfinite(b)[..., None]
    return more_rows(A, np.where(np.isfinite(b), b, 1.0))
