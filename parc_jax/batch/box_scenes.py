"""Scenes made of boxes, laid out for a batch in whole-array operations: no Python cost per
scene.
"""

import numpy as np
from flax import struct

from parc_jax.arrays import as_float64
from parc_jax.batch.stack import LEAST_CORNERS, more_rows, size_class
from parc_jax.body import Disc, Polygon
from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel
from parc_jax.obstacles.grown import GrownObstacles, grown_obstacles
from parc_jax.problem import ReachAvoid, reach_avoid
from parc_jax.sets.box import box
from parc_jax.verdict.scene import Scene, float_slack


@struct.dataclass
class BoxScenes:
    """s problems of boxes over one body. Build with `box_scenes`, which validates.

    goal_lo, goal_hi: (s, n_p + n_q). obstacle_lo, obstacle_hi: (s, o, 2) [m]. present: (s, o) bool.
    spans: (s, o, 2) int, first and last interval of every obstacle. start_lo, start_hi: (s, 2) [m],
        infinite if free.
    """

    goal_lo: np.ndarray
    goal_hi: np.ndarray
    obstacle_lo: np.ndarray
    obstacle_hi: np.ndarray
    present: np.ndarray
    spans: np.ndarray
    start_lo: np.ndarray
    start_hi: np.ndarray
    body: Disc | Polygon

    def __len__(self) -> int:
        return len(self.goal_lo)

    def problem(self, i: int) -> ReachAvoid:
        """Scene i as a problem of its own, as `Planner.solve` takes it."""
        kept = np.flatnonzero(self.present[i])
        free = not np.isfinite(self.start_lo[i]).all()
        start = None if free else box(self.start_lo[i], self.start_hi[i])
        return reach_avoid(
            box(self.goal_lo[i], self.goal_hi[i]),
            [box(self.obstacle_lo[i, j], self.obstacle_hi[i, j]) for j in kept],
            self.body,
            start,
            [tuple(int(t) for t in self.spans[i, j]) for j in kept],
        )


def box_scenes(
    model: TrajectoryModel,
    goal_lo,
    goal_hi,
    obstacle_lo,
    obstacle_hi,
    body,
    *,
    start=None,
    present=None,
    spans=None,
) -> BoxScenes:
    """Validated scenes from arrays of boxes. Raises InputError that names the first bad scene.

    goal_lo, goal_hi (s, n_p + n_q); obstacle_lo, obstacle_hi (s, o, 2), or (o, 2) for the same in
    all; body: a disc radius [m], Disc or Polygon; start: None or (lo (s, 2), hi (s, 2)); present
    (s, o) bool: which obstacles exist; spans (s, o, 2): first and last interval of each.
    """
    n_p = model.n_p
    T = model.time.n_steps
    goal_lo = as_float64("goal_lo", goal_lo, (None, n_p + model.n_q))
    s = len(goal_lo)
    goal_hi = as_float64("goal_hi", goal_hi, goal_lo.shape)
    lo = _of_every_scene("obstacle_lo", obstacle_lo, s, n_p)
    hi = _of_every_scene("obstacle_hi", obstacle_hi, s, n_p)
    o = lo.shape[1]
    present = np.ones((s, o), bool) if present is None else np.asarray(present, bool)
    spans = np.tile([0, T - 1], (s, o, 1)) if spans is None else np.asarray(spans, np.int64)
    if start is None:
        start_lo = np.full((s, n_p), -np.inf)
        start_hi = np.full((s, n_p), np.inf)
    else:
        start_lo, start_hi = (as_float64("start", x, (s, n_p)) for x in start)
    fits = hi.shape == lo.shape and present.shape == (s, o) and spans.shape == (s, o, 2)
    if not fits or n_p != 2:
        raise InputError(
            f"box_scenes: expected planar obstacles ({s}, {o}, 2), present ({s}, {o}), spans ({s}, "
            f"{o}, 2); got {hi.shape}, {present.shape}, {spans.shape}."
        )
    narrow = 2 * model.tube.final.min(axis=0)
    first = spans[..., 0]
    last = spans[..., 1]
    no_span = (first < 0) | (first > last) | (last >= T)
    faults = {
        "a goal wider than twice the model's smallest final error": (goal_hi - goal_lo) < narrow,
        "obstacles with lo <= hi": (lo > hi).any(axis=2) & present,
        "a start with lo <= hi": start_lo > start_hi,
        f"spans 0 <= first <= last < {T}": no_span & present,
    }
    for expected, fault in faults.items():
        bad = fault.any(axis=1)
        if bad.any():
            scene = int(np.argmax(bad))
            raise InputError(f"box_scenes: expected {expected}; scene {scene} differs.")
    body = body if isinstance(body, Disc | Polygon) else Disc(float(body))
    any_goal = box(goal_lo[0], goal_hi[0]) if s else box([0.0, 0.0], [1.0, 1.0])
    reach_avoid(any_goal, [], body)  # checks the body
    return BoxScenes(goal_lo, goal_hi, lo, hi, present, spans, start_lo, start_hi, body)


def _of_every_scene(name: str, value, s: int, n_p: int) -> np.ndarray:
    """Corners of obstacles (s, o, n_p), given so or as (o, n_p) for all scenes alike."""
    value = np.asarray(value, np.float64)
    if value.ndim == 2:
        value = np.broadcast_to(value, (s, *value.shape))
    return as_float64(name, value, (s, None, n_p))


def lay_out_boxes(boxes: BoxScenes, model: TrajectoryModel) -> Scene:
    """Stacked arrays, equal to those of `scene` for every problem up to one rounding of corners of
    a polygon body.
    """
    s, o, _ = boxes.obstacle_lo.shape
    grown = _grown(boxes, model.time.n_steps, size_class(o))
    goal_size = np.abs(np.concatenate([boxes.goal_lo, boxes.goal_hi], axis=1))
    size = goal_size.max(axis=1, initial=0.0)
    size = size + np.abs(grown.corner).max(axis=(1, 2, 3), initial=0.0) + grown.radius
    goal_A, goal_b = _rows(boxes.goal_lo, boxes.goal_hi)
    start_A, start_b = _rows(boxes.start_lo, boxes.start_hi)
    return Scene(
        goal_A=goal_A,
        goal_b=goal_b,
        start_A=start_A,
        start_b=start_b,
        z_lo=boxes.goal_lo[:, : model.n_p],
        z_hi=boxes.goal_hi[:, : model.n_p],
        k_lo=np.broadcast_to(model.domain.lo, (s, model.n_k)),
        k_hi=np.broadcast_to(model.domain.hi, (s, model.n_k)),
        obstacles=grown,
        directions=None,
        slack=float_slack(model, size),
    )


def _grown(boxes: BoxScenes, T: int, n_o: int) -> GrownObstacles:
    """The obstacles grown by the body, padded to n_o obstacles and a size class of corners."""
    s, o, _ = boxes.obstacle_lo.shape
    body_corner, body_sign = _body_table(boxes.body, T)
    m = len(body_corner)
    n_m = size_class(m, LEAST_CORNERS)
    upper = (body_sign > 0)[None, None]  # (1, 1, m, 2)
    kept = np.where(upper, boxes.obstacle_hi[:, :, None], boxes.obstacle_lo[:, :, None])
    kept = np.where(boxes.present[..., None, None], kept + body_corner[None, None], 0.0)
    corner = np.zeros((s, n_o, n_m, 2))
    corner[:, :o, :m] = kept
    corner[:, :o, m:] = kept[:, :, -1:]
    sign = np.pad(body_sign, ((0, n_m - m), (0, 0)), mode="edge")
    t = np.arange(T)[None, None]
    during = (t >= boxes.spans[..., :1]) & (t <= boxes.spans[..., 1:])
    active = np.zeros((s, n_o, T), bool)
    active[:, :o] = boxes.present[..., None] & during
    radius = boxes.body.radius if isinstance(boxes.body, Disc) else 0.0
    return GrownObstacles(
        corner=corner,
        sign=np.broadcast_to(sign, (s, n_o, n_m, 2)),
        radius=np.full(s, float(radius)),
        active=active,
    )


def _body_table(body, T: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners (m, 2) and signs (m, 2) of a point obstacle grown by the body: added to a box's
    corner of equal sign.
    """
    point = reach_avoid(box([-1.0, -1.0], [1.0, 1.0]), [box([0.0, 0.0], [0.0, 0.0])], body)
    table = grown_obstacles(point, T)
    return table.corner[0], table.sign[0]


def _rows(lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (s, h, n), b (s, h) of boxes; an infinite side becomes the padding row 0 x <= 1."""
    s, n = lo.shape
    b = np.concatenate([hi, -lo], axis=1)
    bounded = np.isfinite(b)
    normals = np.concatenate([np.eye(n), -np.eye(n)])
    A = np.broadcast_to(normals, (s, 2 * n, n)) * bounded[..., None]
    return more_rows(A, np.where(bounded, b, 1.0))
