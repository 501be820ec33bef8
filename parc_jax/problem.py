"""The question: goal, obstacles, body, start set."""

from collections.abc import Sequence

import numpy as np
from flax import struct

from parc_jax.arrays import as_float64
from parc_jax.errors import InputError
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope, from_box


@struct.dataclass
class Disc:
    """A ball of the given radius [m] about the reference point."""

    radius: float


@struct.dataclass
class Polygon:
    """The convex hull of vertices (v, n_p) about the reference point; it does not turn with the robot."""

    vertices: np.ndarray


@struct.dataclass
class ReachAvoid:
    """Reach the goal at t_f, never touch an obstacle. Build with `reach_avoid`, which validates.

    goal: polytope over (p_f, q_f), closed. obstacles: polytopes over p, closed.
    steps: per obstacle (first, last) interval in which it exists, or None for always.
    body: Disc or Polygon. start: polytope over p0, or None for anywhere.
    """

    goal: HPolytope
    obstacles: tuple[HPolytope, ...]
    body: Disc | Polygon
    start: HPolytope | None = None
    steps: tuple[tuple[int, int] | None, ...] = struct.field(pytree_node=False, default=())

    @property
    def spans(self) -> tuple[tuple[int, int] | None, ...]:
        """`steps`, one entry per obstacle also when none were given."""
        return self.steps or (None,) * len(self.obstacles)


def reach_avoid(goal, obstacles: Sequence, body, start=None, steps: Sequence | None = None) -> ReachAvoid:
    """Validated problem. Boxes become polytopes; a number is taken as a disc radius. Raises InputError."""
    goal, obstacles = _polytope("goal", goal), tuple(_polytope("obstacle", o) for o in obstacles)
    start = None if start is None else _polytope("start", start)
    if not isinstance(body, Disc | Polygon):
        body = Disc(float(as_float64("body radius", body, ())))
    n_p = _workspace(goal, obstacles, body, start)
    for name, part in [*((f"obstacle {i}", o) for i, o in enumerate(obstacles)), ("start", start)]:
        if part is not None and part.n != n_p:
            raise InputError(f"{name}: expected a set in the {n_p}-D workspace; got {part.n} dimensions.")
    if goal.n < n_p:
        raise InputError(f"goal: expected at least the {n_p} workspace coordinates (p, q); got {goal.n} dimensions.")
    if isinstance(body, Disc) and not (np.isfinite(body.radius) and body.radius >= 0):
        raise InputError(f"body: expected a radius >= 0 m; got {body.radius}.")
    if isinstance(body, Polygon):
        body = Polygon(as_float64("body vertices", body.vertices, (None, n_p)))
        if len(body.vertices) == 0:
            raise InputError("body: expected a polygon with at least one vertex; got none. For a point use radius 0.")
    steps = (None,) * len(obstacles) if steps is None else tuple(steps)
    if len(steps) != len(obstacles):
        raise InputError(f"steps: expected one entry per obstacle ({len(obstacles)}); got {len(steps)}.")
    for j, span in enumerate(steps):
        if span is not None and not _is_span(span):
            raise InputError(f"steps of obstacle {j}: expected whole numbers 0 <= first <= last; got {span}.")
    return ReachAvoid(goal, obstacles, body, start, steps)


def _workspace(goal: HPolytope, obstacles, body, start) -> int:
    """Dimension of the workspace, from whatever names it."""
    if obstacles or start is not None:
        return obstacles[0].n if obstacles else start.n
    return np.shape(body.vertices)[-1] if isinstance(body, Polygon) and np.ndim(body.vertices) == 2 else goal.n


def _is_span(span) -> bool:
    pair = isinstance(span, tuple | list) and len(span) == 2 and all(isinstance(i, int | np.integer) for i in span)
    return pair and 0 <= span[0] <= span[1]


def _polytope(name: str, value) -> HPolytope:
    if isinstance(value, Box):
        return from_box(value)
    if isinstance(value, HPolytope):
        return value
    raise InputError(f"{name}: expected a Box or an HPolytope; got {type(value).__name__}.")
