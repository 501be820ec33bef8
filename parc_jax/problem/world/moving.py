"""Moving obstacles as polytopes with intervals of existence."""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.arrays import as_float64, content_hash
from parc_jax.common.errors import InputError, check_count
from parc_jax.common.lp.exact import round_up
from parc_jax.common.said import slot
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope, hpolytope, owned
from parc_jax.common.sets.hull import convex_hull
from parc_jax.common.sets.rational import Point, exact_support, rational_vertices
from parc_jax.common.spelling import counted, exact
from parc_jax.problem.problem import SAME, Span


def moving(
    obstacle: Box | HPolytope,
    velocity: ArrayLike,
    span: tuple[int, int],
    dt: float,
    *,
    at: float | None = None,
    every: int = 1,
    off_by: float = 0.0,
) -> tuple[list[HPolytope], list[Span]]:
    """An obstacle in motion, in the plane or in space, as obstacles and spans for `reach_avoid` and
    `Loop.step`. Raises InputError.

    obstacle: Box or HPolytope [m] as it stands at time 0 of the manoeuvre, its floats taken as they
    are. velocity: (n_p,) [m/s]. span: first and last interval in which it exists. dt: [s] of an
    interval, `model.time.dt`. at: [s] of the clock when it stands so, which a loop compares with
    the moment of its pose; None for whenever a plan begins. every: intervals per returned polytope;
    more makes fewer and larger ones. off_by: [m/s] by which its true velocity differs from this
    one, at most, whenever; with a velocity of zeros its greatest speed. After t seconds it is
    within off_by * t [m] of where it would be. Each polytope contains all places of the obstacle
    during its intervals and SAME around them; offsets are rounded up. A path that bends is several
    calls; a union is several obstacles. [T38]
    """
    at = None if at is None else float(as_float64("moving at", at, ()))
    poly = owned(obstacle, "moving")
    v = as_float64("velocity", velocity, (poly.n,))
    dt, off_by = float(as_float64("moving dt", dt, ())), float(as_float64("off_by", off_by, ()))
    if np.shape(span) != (2,):
        raise InputError(f"moving: expected span = (first, last); got {span!r:.40}.")
    first, last = span
    for name, number, least in (("first", first, 0), ("last", last, 0), ("every", every, 1)):
        check_count(f"moving {name}", number, least, "1")
    if not first <= last or not dt > 0:
        raise InputError(f"moving: expected first <= last and dt > 0; got {span}, dt = {dt}.")
    if not off_by >= 0:
        raise InputError(f"moving: expected off_by of 0 m/s or more; got {off_by!r:.40}.")
    if not (vertices := rational_vertices(poly)):
        raise InputError(
            "moving: expected an obstacle with points in it; its rows contradict each other."
        )
    A = np.concatenate([poly.A, _sides(vertices, v)]) if v.any() else poly.A
    # "no plan is safe" is of these places, which are more than where it will be
    most, wide = f"{slot(exact(off_by))} m/s", counted(every, "interval")
    speed = f"within {most} of the velocity told" if v.any() else f"no faster than {most}"
    when = "" if at is not None else "stands as told when a plan begins, "
    said = f"Who moves {when}is {speed}, and told of as all of its places in {wide}."
    said = said if off_by or v.any() else ""
    mover = f"{content_hash(poly.A, poly.b, v, [off_by, first, last])[:12]} from {first}"
    spans = spans_of(first, last, every, dt, at, None, said, mover)
    rows = [(exact_support(vertices, w), _fastest(w, v, off_by)) for w in A]
    step = Fraction(float(dt))
    ends = [(first * step - SAME, (last + 1) * step + SAME) for first, last in spans]
    # w . x grows evenly, so it reaches most at one of the ends of a span
    bounds = [[round_up(now + max(rate * t for t in end)) for now, rate in rows] for end in ends]
    return [hpolytope(A, b) for b in bounds], spans


def spans_of(first: int, last: int, every: int, *told: Any) -> list[Span]:
    """Spans of so many intervals each, from the first to the last. told: as of `Span`."""
    pairs = [(t, min(t + every - 1, last)) for t in range(first, last + 1, every)]
    return [Span(pair, *told) for pair in pairs]


def require_under_way(spans: Sequence[Span | None]) -> None:
    """Raises InputError where the robot of an obstacle has left its manoeuvre since."""
    for j, span in enumerate(spans):
        if span is not None and span.void:
            raise InputError(
                f"span of obstacle {j}: expected places of a manoeuvre that is under way; it "
                f"{span.void}. Make it anew."
            )


def _sides(vertices: list[Point], v: np.ndarray) -> np.ndarray:
    """Normals of a sweep's further sides, along its way v but for rounding: offsets are exact."""
    if len(v) == 2:
        return np.array([[-v[1], v[0]], [v[1], -v[0]]])
    across = np.linalg.svd(v[None])[2][1:]  # the shadow that is cast along v
    shadow = np.array([[float(c) for c in x] for x in vertices]) @ across.T
    hull = convex_hull(shadow)
    # a line or a point has ends besides
    flat = np.linalg.svd(shadow - shadow[0])[2]
    return (np.concatenate([flat, -flat]) if hull is None else hull.equations[:, :2]) @ across


def _fastest(w: np.ndarray, v: np.ndarray, off_by: float) -> Fraction:
    """Most that w . x may grow in a second, for a velocity that is off_by from v at most."""
    exact = [Fraction(float(c)) for c in w]
    length = math.hypot(*w)
    while Fraction(length) ** 2 < sum(c * c for c in exact):
        length = math.nextafter(length, math.inf)
    known = sum(c * Fraction(float(each)) for c, each in zip(exact, v, strict=True))
    return known + Fraction(length) * Fraction(float(off_by))
