"""Obstacles grown by body and tube, kept implicit: a polygon whose corners move with the error box,
plus a radius.

O + (-B) + box(e): with a polygon body the sum is a polygon; every corner of it is a corner of O +
(-B) displaced by a fixed sign pattern times e. The pattern depends on the corner only, so one table
serves every interval and every bin. A disc body stays a radius: no circumscribed polygon is ever
formed.
"""

from collections.abc import Sequence
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct

from parc_jax.body import Disc
from parc_jax.claim.error_set import ErrorSet
from parc_jax.errors import InputError
from parc_jax.obstacles.polygon import corners
from parc_jax.obstacles.segment import dot2, separation, separations
from parc_jax.problem import ReachAvoid
from parc_jax.sets.rational import convex_polygon

TINY = 1e-300  # [m^2] against 0 / 0 where a corner is repeated
BUCKETS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)


@struct.dataclass
class GrownObstacles:
    """Padded obstacles of a scene. A padding obstacle is never active; a padding corner repeats the
    last one.

    corner: (o, m, 2) [m], sign: (o, m, 2) in {-1, 0, 1}: corners of the grown polygon are corner +
        sign * e, ccw.
    radius: () [m] of a disc body, 0 for a polygon body (already inside the corners).
    active: (o, T) bool, the intervals in which the obstacle exists.
    """

    corner: np.ndarray
    sign: np.ndarray
    radius: np.ndarray
    active: np.ndarray

    @property
    def points(self) -> np.ndarray:
        """(o, 1) the reference points that the body hangs on: the only one."""
        return np.zeros((*self.active.shape[:-1], 1), np.int32)

    @property
    def size(self):
        """[m] Largest coordinate and radius together."""
        axes = tuple(range(-3, 0))
        return np.abs(self.corner).max(axis=axes, initial=0.0) + self.radius

    def only(self, o) -> "GrownObstacles":
        """One of them. Kernel."""
        every = (self.corner, self.sign, self.active)
        corner, sign, active = (jnp.asarray(x)[o][None] for x in every)
        return GrownObstacles(corner, sign, self.radius, active)

    def gaps(self, path, errors: ErrorSet):
        """Gap (o, T) [m] from every obstacle, and the unit direction (o, T, 2) that shows it, of a
        path (T + 1, 2) whose errors (T, 1) are boxes. Kernel. [T14]
        """
        error = errors.half[:, 0]

        def one(corner, sign):
            corners = corner[None] + sign[None] * error[:, None]
            return separations(path[:-1], path[1:], corners, self.radius)

        return jax.vmap(one)(self.corner, self.sign)

    def gap(self, o, start, end, errors: ErrorSet):
        """The same for one obstacle and one interval: start, end (2,) its knots, errors (1,).
        Kernel.
        """
        xp = jnp if isinstance(start, jax.Array) else np
        corners = self.corner[o] + self.sign[o] * errors.half
        return separation(start, end, corners, self.radius, xp)

    def touching(self, places, errors: ErrorSet):
        """(o, t) bool: do places (t, 2) with errors (t, 1) touch for certain? Kernel."""
        touch = jax.vmap(_touching, in_axes=(0, 0, None, None, None))
        return touch(self.corner, self.sign, self.radius, places, errors.half[:, 0])

    def support(self, w):
        """(o, ...) of the obstacle and the body together along directions w (o, ..., 2), unit
        vectors. Kernel.
        """
        corner = jnp.asarray(self.corner)
        corner = corner.reshape(len(corner), *[1] * (w.ndim - 2), *corner.shape[1:])
        return dot2(corner, w[..., None, :]).max(axis=-1) + self.radius


def grown_obstacles(
    problem: ReachAvoid, n_steps: int, kept: Sequence[int] | None = None
) -> GrownObstacles:
    """Corner tables of all obstacles of a planar problem, or of those with these numbers, exact
    until the last rounding. Raises InputError.
    """
    radius = float(problem.body.radius) if isinstance(problem.body, Disc) else 0.0
    body = [(Fraction(0), Fraction(0))]
    if not isinstance(problem.body, Disc):
        body = [(-Fraction(x), -Fraction(y)) for x, y in problem.body.vertices]
    chosen = [j for j, _ in numbered_pairs(problem, kept)]
    tables = [_signed_corners(problem.obstacles[j], body, f"obstacle {j}") for j in chosen]
    n_o = bucket(len(tables))
    n_m = bucket(max((len(t) for t in tables), default=1))
    corner, sign = np.zeros((n_o, n_m, 2)), np.zeros((n_o, n_m, 2))
    active = np.zeros((n_o, n_steps), bool)
    for j, table in enumerate(tables):
        padded = table + [table[-1]] * (n_m - len(table))
        corner[j] = [[float(x) for x in point] for point, _ in padded]
        sign[j] = [s for _, s in padded]
        active[j] = exists(problem, chosen[j], n_steps)
    return GrownObstacles(corner, sign, np.float64(radius), active)


def exists(problem: ReachAvoid, j: int, n_steps: int) -> np.ndarray:
    """(T,) bool: the intervals in which obstacle j exists. Raises InputError."""
    first, last = problem.all_spans[j] or (0, n_steps - 1)
    if last >= n_steps:
        raise InputError(f"span of obstacle {j}: expected last < {n_steps} intervals; got {last}.")
    at = np.arange(n_steps)
    return (at >= first) & (at <= last)


def numbered_pairs(problem: ReachAvoid, kept: Sequence[int] | None = None) -> list[tuple[int, int]]:
    """(obstacle, part) of the pairs with these numbers, of all where none are given."""
    n_parts = len(problem.parts)
    every = range(len(problem.obstacles) * n_parts) if kept is None else kept
    return [divmod(int(pair), n_parts) for pair in every]


def _touching(corner, sign, radius, p, error):
    """(t,) bool: are points p (t, 2) inside the polygon corner (m, 2) + sign * error (t, 2), or
    within the radius?

    Edge by edge and without a division of the field into cases: this runs for every plan that is
    ever drawn. A point or a wall has no inside; their area is exactly zero, as it is measured from
    one of the corners.
    """
    inside = jnp.ones(len(p), bool)
    nearest = jnp.full(len(p), jnp.inf)
    area = jnp.zeros(len(p), p.dtype)
    corners = [c[None] + s[None] * error for c, s in zip(corner, sign, strict=True)]
    for a, b in zip([corners[-1], *corners[:-1]], corners, strict=True):
        along = b - a
        to = p - a
        from_a = a - corners[0]
        from_b = b - corners[0]
        area += from_a[:, 0] * from_b[:, 1] - from_a[:, 1] * from_b[:, 0]
        inside &= along[:, 0] * to[:, 1] >= along[:, 1] * to[:, 0]
        share = jnp.clip(dot2(to, along) / jnp.maximum(dot2(along, along), TINY), 0, 1)
        off = to - share[:, None] * along
        nearest = jnp.minimum(nearest, dot2(off, off))
    return (inside & (area > 0)) | (nearest <= radius * radius)


def bucket(n: int) -> int:
    """Padded size for n items: few compiled shapes. Powers of two beyond the last bucket."""
    for size in BUCKETS:
        if n <= size:
            return size
    return 1 << (n - 1).bit_length()


def _signed_corners(obstacle, body, name: str):
    """[(corner, sign pattern)] of obstacle + body + box(e), counter-clockwise, for every e >= 0 at
    once.

    A corner of the sum maximises some w; near an axis of w its sign pattern changes. Walking around
    the circle in the quadrants of w gives each corner of the polygon once per quadrant that its
    normal cone meets.
    """
    polygon = convex_polygon(
        [(v.point[0] + p[0], v.point[1] + p[1]) for v in corners(obstacle, name) for p in body]
    )
    out = []
    for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1)):  # quadrants of w, counter-clockwise
        entry, leave = ((sx, 0), (0, sy)) if sx == sy else ((0, sy), (sx, 0))
        start = _support(polygon, entry, leave)
        end = _support(polygon, leave, entry)
        index = start
        while True:
            out.append((polygon[index], (sx, sy)))
            if index == end:
                break
            index = (index + 1) % len(polygon)
    return out


def _support(polygon, w, tie) -> int:
    """Index of the corner that maximises w, ties broken towards `tie`. Both are plus or minus a
    unit vector.
    """
    return max(range(len(polygon)), key=lambda i: (_along(w, polygon[i]), _along(tie, polygon[i])))


def _along(axis, point):
    """axis . point of exact numbers, without a product."""
    value = point[0] if axis[0] else point[1]
    return value if sum(axis) > 0 else -value
