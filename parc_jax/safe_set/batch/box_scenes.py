"""Scenes of boxes, laid out for a batch in whole-array operations: no Python cost per scene."""

import itertools

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.model import TrajectoryModel, float_slack
from parc_jax.learning.runs.law import LOG, Subject
from parc_jax.problem.body import Body, Disc, Polygon, numbered
from parc_jax.problem.problem import Problem, Span, reach_avoid
from parc_jax.problem.robust.nominal import query
from parc_jax.safe_set.separation.pairs import Obstacles, obstacles_of
from parc_jax.safe_set.verdict.scene import (
    CORNERS,
    SceneArrays,
    in_closed_form,
    more_rows,
    size_class,
)


@struct.dataclass
class BoxScenes:
    """s problems of boxes over one body. Build with `box_scenes`, which validates.

    goal_lo, goal_hi: (s, n_c + n_q), infinite where a point but the first is free. obstacle_lo,
    obstacle_hi: (s, o, n_p) [m]. present: (s, o) bool. spans: (s, o, 2) int, first and last
    interval of every obstacle. start_lo, start_hi: (s, n_p) [m], infinite if free. of: robot and
    time grid that they are told for.
    """

    goal_lo: np.ndarray
    goal_hi: np.ndarray
    obstacle_lo: np.ndarray
    obstacle_hi: np.ndarray
    present: np.ndarray
    spans: np.ndarray
    start_lo: np.ndarray
    start_hi: np.ndarray
    body: Disc | Polygon | Body
    of: Subject = struct.field(pytree_node=False)

    def __len__(self) -> int:
        return len(self.goal_lo)

    def problem(self, i: int) -> Problem:
        """Scene i as `Planner.solve` takes it."""
        kept = np.flatnonzero(self.present[i])
        free = not np.isfinite(self.start_lo[i]).all()
        start = None if free else box(self.start_lo[i], self.start_hi[i])
        A, b = _rows(self.goal_lo[i : i + 1], self.goal_hi[i : i + 1])
        asked = (A[0] != 0).any(axis=1)
        goal = hpolytope(A[0, asked], b[0, asked])
        obstacles = [box(self.obstacle_lo[i, j], self.obstacle_hi[i, j]) for j in kept]
        spans = [Span(self.spans[i, j].tolist(), self.of.time.dt) for j in kept]
        return reach_avoid(goal, obstacles, self.body, start, spans)


def box_scenes(
    model: TrajectoryModel,
    goal_lo: ArrayLike,
    goal_hi: ArrayLike,
    obstacle_lo: ArrayLike,
    obstacle_hi: ArrayLike,
    body: float | Disc | Polygon | Body,
    *,
    start: tuple[ArrayLike, ArrayLike] | None = None,
    present: ArrayLike | None = None,
    spans: ArrayLike | None = None,
) -> BoxScenes:
    """Validated scenes from arrays of boxes. Raises InputError that names the first bad scene.

    goal_lo, goal_hi (s, n_c + n_q), which may be infinite for all points but the first;
    obstacle_lo, obstacle_hi (s, o, n_p), or (o, n_p) for the same in all; body: a radius [m], Disc,
    Polygon or Body; start: None or (lo (s, n_p), hi (s, n_p)); present (s, o) bool: which obstacles
    exist; spans (s, o, 2): first and last interval of each.
    """
    n_p, T = model.n_p, model.time.n_steps
    goal_lo, goal_hi = _goals(model, goal_lo, goal_hi)
    s = len(goal_lo)
    lo = _of_every_scene("obstacle_lo", obstacle_lo, s, n_p)
    hi = _of_every_scene("obstacle_hi", obstacle_hi, s, n_p)
    o = lo.shape[1]
    present = np.ones((s, o), bool) if present is None else np.asarray(present)
    spans = np.tile([0, T - 1], (s, o, 1)) if spans is None else np.asarray(spans)
    seconds = spans.size and spans.dtype.kind not in "iu"  # would be cut to whole intervals
    if seconds or (present.size and present.dtype != bool):
        raise InputError(
            "box_scenes: expected present as True and False, and spans in whole numbers of "
            f"intervals of {model.time.dt:g} s; got {present.dtype} and {spans.dtype}."
        )
    present, spans = present.astype(bool), spans.astype(np.int64)
    start_lo, start_hi = np.full((s, n_p), -np.inf), np.full((s, n_p), np.inf)
    if start is not None:
        start_lo, start_hi = (as_float64("start", x, (s, n_p)) for x in start)
    if hi.shape != lo.shape or present.shape != (s, o) or spans.shape != (s, o, 2):
        raise InputError(
            f"box_scenes: expected obstacles ({s}, {o}, {n_p}), present ({s}, {o}), spans ({s}, "
            f"{o}, 2); got {hi.shape}, {present.shape}, {spans.shape}."
        )
    least, most = model.tube.end_extent
    narrow = (most - least).min(axis=0)
    first, last = np.moveaxis(spans, 2, 0)
    no_span = (first < 0) | (first > last) | (last >= T)
    faults = {
        "a goal wider than the model's smallest final error": (goal_hi - goal_lo)[:, :n_p] < narrow,
        "obstacles with lo <= hi": (lo > hi).any(axis=2) & present,
        "a start with lo <= hi": start_lo > start_hi,
        f"spans 0 <= first <= last < {T}": no_span & present,
    }
    for expected, fault in faults.items():
        if fault.any():
            scene = int(np.argmax(fault.any(axis=1)))
            raise InputError(f"box_scenes: expected {expected}; scene {scene} differs.")
    # checks the body
    body = reach_avoid(box(-np.ones(n_p), np.ones(n_p)), [], body).body
    numbered(body, model.points)
    of = model.claim.subject
    return BoxScenes(goal_lo, goal_hi, lo, hi, present, spans, start_lo, start_hi, body, of)


def _goals(model: TrajectoryModel, lo: ArrayLike, hi: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Boxes of goals (s, n_c + n_q). Raises InputError where what has to be bounded is not."""
    lo, hi = (np.array(x, np.float64) for x in (lo, hi))
    free = np.zeros(model.n_c + model.n_q, bool)
    free[model.n_p : model.n_c] = True
    shape = (None, model.n_c + model.n_q)
    if lo.ndim == 2 and lo.shape[1:] == hi.shape[1:] == free.shape:
        as_float64("goal_lo", np.where(free & (lo == -np.inf), 0.0, lo), shape)
        as_float64("goal_hi", np.where(free & (hi == np.inf), 0.0, hi), lo.shape)
        return lo, hi
    lo = as_float64("goal_lo", lo, shape)
    return lo, as_float64("goal_hi", hi, lo.shape)


def _of_every_scene(name: str, value: ArrayLike, s: int, n_p: int) -> np.ndarray:
    """Corners of obstacles (s, o, n_p), given so or as (o, n_p) for all scenes alike."""
    value = np.asarray(value, np.float64)
    if value.ndim == 2:
        value = np.broadcast_to(value, (s, *value.shape))
    return as_float64(name, value, (s, None, n_p))


def lay_out_boxes(boxes: BoxScenes, model: TrajectoryModel) -> SceneArrays:
    """Stacked arrays, equal to those of every problem up to one rounding of corners of a polygon
    body. Raises InputError for a model of another robot or time grid, and as `solve` does.
    """
    names = model.system, boxes.of.system  # a log has that of its file
    free = ("K", "system") if any(not x or x.startswith(LOG) for x in names) else ("K",)
    model.claim.subject.agree("scenes of this model's robot", boxes.of, free, "Make them with it.")
    query(boxes.problem(0), model).nominal()  # refuses a body that `solve` does: all have one
    obstacles = _obstacles(boxes, model)
    bounds = np.concatenate([boxes.goal_lo, boxes.goal_hi], axis=1)
    size = np.abs(np.where(np.isfinite(bounds), bounds, 0.0)).max(axis=1, initial=0.0)
    size = size + CORNERS * obstacles.size
    s = len(boxes)
    goal_A, goal_b = _rows(boxes.goal_lo, boxes.goal_hi)
    start_A, start_b = _rows(boxes.start_lo, boxes.start_hi)
    return SceneArrays(
        goal_A=goal_A,
        goal_b=goal_b,
        start_A=start_A,
        start_b=start_b,
        z_lo=boxes.goal_lo[:, : model.n_p],
        z_hi=boxes.goal_hi[:, : model.n_p],
        k_lo=np.broadcast_to(model.domain.lo, (s, model.n_k)),
        k_hi=np.broadcast_to(model.domain.hi, (s, model.n_k)),
        obstacles=obstacles,
        slack=float_slack(model, size),
        beyond=np.full(s, np.inf),
        count=None,
    )


def _obstacles(boxes: BoxScenes, model: TrajectoryModel) -> Obstacles:
    """The obstacles as `obstacles_of` gives them for every problem, padded to size classes."""
    T, n_p = model.time.n_steps, model.n_p
    point = box(np.zeros(n_p), np.zeros(n_p))
    one = reach_avoid(box(-np.ones(n_p), np.ones(n_p)), [point], boxes.body)
    n_parts = len(one.parts)
    closed = in_closed_form(one, model)
    about = obstacles_of(one, model.points, model.layout, closed)  # every part once, at the origin
    t = np.arange(T)[None, None]
    during = (t >= boxes.spans[..., :1]) & (t <= boxes.spans[..., 1:])
    active = boxes.present[..., None] & during
    vertices = _corners(boxes, about, n_parts)
    s, n_pairs, n_v, _ = vertices.shape
    n_o, n_m = size_class(n_pairs), size_class(n_v, 2**n_p)
    own = np.resize(np.arange(n_parts), n_o)
    padded = np.zeros((s, n_o, n_m, n_p))
    padded[:, :n_pairs] = np.pad(vertices, ((0, 0), (0, 0), (0, n_m - n_v), (0, 0)), mode="edge")
    of_pairs = np.zeros((s, n_o, T), bool)
    of_pairs[:, :n_pairs] = active.repeat(n_parts, axis=1)
    more = ((0, 0), (0, n_m - n_v if closed else 0), (0, 0))
    signs = np.pad(about.signs[own], more, mode="edge") if closed else about.signs[own]
    return Obstacles(
        vertices=padded,
        signs=np.broadcast_to(signs, (s, *signs.shape)),
        radius=np.broadcast_to(about.radius[own], (s, n_o)),
        points=np.broadcast_to(about.points[own], (s, n_o, about.points.shape[1])),
        active=of_pairs,
    )


def _corners(boxes: BoxScenes, about: Obstacles, n_parts: int) -> np.ndarray:
    """(s, pairs, v, n_p): every corner of every box with every vertex of every part; in closed form
    each corner of the body with the corner of a box of equal sign.
    """
    s, o, n_p = boxes.obstacle_lo.shape
    every = list(itertools.product((False, True), repeat=n_p))
    upper = about.signs[0] > 0 if about.closed else np.array(every)
    corner = np.where(upper, boxes.obstacle_hi[:, :, None], boxes.obstacle_lo[:, :, None])
    present = boxes.present[..., None, None]
    if about.closed:
        return np.where(present, corner + about.vertices[0], 0.0)
    sums = np.where(present, corner, 0.0)[:, :, None, :, None] + about.vertices[:n_parts, None]
    return sums.reshape(s, o * n_parts, -1, n_p)


def _rows(lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (s, h, n), b (s, h) of boxes; an infinite side becomes the padding row 0 x <= 1."""
    s, n = lo.shape
    b = np.concatenate([hi, -lo], axis=1)
    bounded = np.isfinite(b)
    normals = np.concatenate([np.eye(n), -np.eye(n)])
    A = np.broadcast_to(normals, (s, 2 * n, n)) * bounded[..., None]
    return more_rows(A, np.where(bounded, b, 1.0))
