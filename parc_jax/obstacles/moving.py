"""Moving obstacles as polytopes with intervals of existence."""

from fractions import Fraction

import numpy as np

from parc_jax.arrays import as_float64
from parc_jax.errors import InputError
from parc_jax.lp.exact import round_up
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.sets.rational import exact_support, rational_vertices

Span = tuple[int, int]


def moving(
    obstacle, velocity, span: Span, dt: float, *, every: int = 1
) -> tuple[list[HPolytope], list[Span]]:
    """A planar obstacle in uniform motion, as obstacles and spans for `reach_avoid`. Raises
    InputError.

    obstacle: Box or HPolytope [m] as it stands at time 0 of the manoeuvre, its floats taken as they
    are. velocity: (2,) [m/s]. span: first and last interval in which it exists. dt: [s] of an
    interval, `model.time.dt`. every: intervals per returned polytope; more makes fewer and larger
    ones. Each contains all places of the obstacle during its intervals, ends included; offsets are
    rounded up. A path that bends is several calls; a union is several obstacles.
    """
    poly = from_box(obstacle) if isinstance(obstacle, Box) else obstacle
    v = as_float64("velocity", velocity, (2,))
    first, last = span
    if not (0 <= first <= last) or every < 1 or not dt > 0:
        raise InputError(
            f"moving: expected 0 <= first <= last, every >= 1 and dt > 0; got {span}, every = "
            f"{every}, dt = {dt}."
        )
    vertices = rational_vertices(poly)
    if not vertices:
        raise InputError(
            "moving: expected an obstacle with points in it; its rows contradict each other."
        )
    across = np.array([[-v[1], v[0]], [v[1], -v[0]]])
    A = np.concatenate([poly.A, across]) if v.any() else poly.A
    spans = [(t, min(t + every - 1, last)) for t in range(first, last + 1, every)]
    return [_swept(A, vertices, v, Fraction(float(dt)), span) for span in spans], spans


def _swept(A: np.ndarray, vertices, v: np.ndarray, dt: Fraction, span: Span) -> HPolytope:
    """Hull of the polygon at the first and the last moment of its intervals: in the plane every
    edge of a sweep is an edge of the polygon or parallel to the way."""
    ends = [span[0] * dt, (span[1] + 1) * dt]
    way = [tuple(Fraction(float(c)) * t for c in v) for t in ends]
    support = [round_up(exact_support(vertices, w) + exact_support(way, w)) for w in A]
    return hpolytope(A, np.array(support))
