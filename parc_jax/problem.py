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
    """The convex hull of vertices (v, n_p) about the reference point; it does not turn with the
    robot.
    """

    vertices: np.ndarray

    def __repr__(self) -> str:
        return f"Polygon of {len(self.vertices)} vertices"


@struct.dataclass
class ReachAvoid:
    """Reach the goal at t_f, never touch an obstacle. Build with `reach_avoid`, which validates.

    goal: polytope over (p_f, q_f), closed. obstacles: polytopes over p, closed.
    spans: per obstacle (first, last) interval in which it exists, or None for always.
    body: Disc or Polygon. start: polytope over p0, or None for anywhere.
    """

    goal: HPolytope
    obstacles: tuple[HPolytope, ...]
    body: Disc | Polygon
    start: HPolytope | None = None
    spans: tuple[tuple[int, int] | None, ...] = struct.field(pytree_node=False, default=())

    @property
    def all_spans(self) -> tuple[tuple[int, int] | None, ...]:
        """`spans`, one entry per obstacle also when none were given."""
        return self.spans or (None,) * len(self.obstacles)

    def __repr__(self) -> str:
        several = "obstacle" if len(self.obstacles) == 1 else "obstacles"
        start = "anywhere" if self.start is None else f"in {len(self.start.b)} half-spaces"
        return (
            f"<ReachAvoid: goal of {len(self.goal.b)} rows over {self.goal.n} coordinates, "
            f"{len(self.obstacles)} {several}, {self.body!r}, start {start}>"
        )


def reach_avoid(
    goal, obstacles: Sequence, body, start=None, spans: Sequence | None = None
) -> ReachAvoid:
    """Validated problem. Boxes become polytopes; a number is taken as a disc radius. Raises
    InputError.
    """
    goal, obstacles = _polytope("goal", goal), tuple(_polytope("obstacle", o) for o in obstacles)
    start = None if start is None else _polytope("start", start)
    if not isinstance(body, Disc | Polygon):
        body = Disc(float(as_float64("body radius", body, ())))
    n_p = _workspace(goal, obstacles, body, start)
    for name, part in [*((f"obstacle {i}", o) for i, o in enumerate(obstacles)), ("start", start)]:
        if part is not None and part.n != n_p:
            raise InputError(
                f"{name}: expected a set in the {n_p}-D workspace; got {part.n} dimensions."
            )
    if goal.n < n_p:
        raise InputError(
            f"goal: expected at least the {n_p} workspace coordinates (p, q); got {goal.n} "
            "dimensions."
        )
    if isinstance(body, Disc) and not (np.isfinite(body.radius) and body.radius >= 0):
        raise InputError(f"body: expected a radius >= 0 m; got {body.radius}.")
    if isinstance(body, Polygon):
        body = Polygon(as_float64("body vertices", body.vertices, (None, n_p)))
        if len(body.vertices) == 0:
            raise InputError(
                "body: expected a polygon with at least one vertex; got none. For a point use "
                "radius 0."
            )
    spans = (None,) * len(obstacles) if spans is None else tuple(spans)
    if len(spans) != len(obstacles):
        raise InputError(
            f"spans: expected one entry per obstacle ({len(obstacles)}); got {len(spans)}."
        )
    for j, span in enumerate(spans):
        if span is not None and not _is_span(span):
            raise InputError(
                f"span of obstacle {j}: expected whole numbers 0 <= first <= last; got {span}."
            )
    return ReachAvoid(goal, obstacles, body, start, spans)


def _workspace(goal: HPolytope, obstacles, body, start) -> int:
    """Dimension of the workspace, from whatever names it."""
    if obstacles or start is not None:
        return obstacles[0].n if obstacles else start.n
    return (
        np.shape(body.vertices)[-1]
        if isinstance(body, Polygon) and np.ndim(body.vertices) == 2
        else goal.n
    )


def _is_span(span) -> bool:
    pair = (
        isinstance(span, tuple | list)
        and len(span) == 2
        and all(isinstance(i, int | np.integer) for i in span)
    )
    return pair and 0 <= span[0] <= span[1]


def _polytope(name: str, value) -> HPolytope:
    if isinstance(value, Box):
        return from_box(value)
    if isinstance(value, HPolytope):
        return value
    raise InputError(f"{name}: expected a Box or an HPolytope; got {type(value).__name__}.")
