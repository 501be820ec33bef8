"""Directions that separate, with the multipliers that make them proofs. [T12a]

A direction is w = lambda_i A_i + lambda_j A_j with lambda >= 0 on two rows of the obstacle that
meet in a corner; then h_O(w) <= lambda_i b_i + lambda_j b_j for any such lambda, with equality
because the corner attains both. Multipliers are short binary fractions, so a certificate spells
them exactly in a few bytes.
"""

import math
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from flax import struct

from parc_jax.body import Disc, Polygon
from parc_jax.obstacles.grown import bucket
from parc_jax.obstacles.polygon import corners
from parc_jax.problem import ReachAvoid
from parc_jax.sets.hpolytope import HPolytope

N_DIRECTIONS = 48  # per obstacle, about 7.5 degrees apart
TABLE_BITS = 6  # lambda of the table: multiples of 2^-6, largest 1
POINT_BITS = 26  # lambda of a direction made for one point: multiples of 2^-26


class Multiplier(NamedTuple):
    """Rows and nonnegative multipliers of one obstacle: w = sum of value * A_row."""

    rows: tuple[int, ...]
    values: tuple[Fraction, ...]


@struct.dataclass
class DirectionTable:
    """Directions of every pair of an obstacle and a part of the body, obstacle by obstacle, padded
    with repetitions. Facet normals come first.

    w: (o, d, 2). support: (o, d) [m * |w|] of obstacle + (-shape) along w, rounded to nearest.
    n_facets: number of leading directions that hold all facet normals, padded to few values.
    multipliers: per pair a tuple of d Multiplier. cones: per pair the neighbouring rows of its
        obstacle. obstacles, shapes: of every pair. These four are for the host only.
    """

    w: np.ndarray
    support: np.ndarray
    n_facets: int = struct.field(pytree_node=False)
    multipliers: tuple = struct.field(pytree_node=False, default=())
    cones: tuple = struct.field(pytree_node=False, default=())
    obstacles: tuple[HPolytope, ...] = struct.field(pytree_node=False, default=())
    shapes: tuple[Disc | Polygon, ...] = struct.field(pytree_node=False, default=())

    @property
    def arrays(self) -> "DirectionTable":
        """The table without what only the host reads."""
        return DirectionTable(self.w, self.support, self.n_facets)

    def spelled(self) -> np.ndarray:
        """Multipliers (o, d) as an object array, looked up by index like w; None for obstacles that
        only pad.
        """
        out = np.empty(self.support.shape, object)
        for j, row in enumerate(self.multipliers):
            for d, m in enumerate(row):
                out[j, d] = m
        return out

    def direction(self, o: int, m: Multiplier) -> tuple[np.ndarray, float]:
        """The direction of a multiplier of pair o, as `direction` gives it."""
        return direction(self.obstacles[o], self.shapes[o], m)

    def nearest(self, o: int, w: np.ndarray) -> Multiplier:
        """The multiplier of pair o whose direction is nearest to w (2,), on the two rows whose
        normals enclose w.
        """
        A = self.obstacles[o].A
        pairs = np.array(self.cones[o])
        first, second = A[pairs[:, 0]], A[pairs[:, 1]]
        det = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        share = np.stack(
            [
                w[0] * second[:, 1] - w[1] * second[:, 0],
                first[:, 0] * w[1] - first[:, 1] * w[0],
            ],
            axis=1,
        )
        share = share / det[:, None]
        # the normal cones of a bounded polygon cover the plane
        best = int(np.argmax(share.min(axis=1)))
        rows = tuple(int(i) for i in pairs[best])
        return _rounded(A, rows, np.maximum(share[best], 0), POINT_BITS)


def direction_table(problem: ReachAvoid) -> DirectionTable:
    """Facet normals and evenly spread directions in the normal cone of every corner of every
    obstacle, for every part of the body.
    """
    shapes = tuple(part.shape for part in problem.parts)
    n_o = bucket(len(problem.obstacles) * len(shapes))
    w = np.zeros((n_o, N_DIRECTIONS, 2))
    support = np.zeros((n_o, N_DIRECTIONS))
    multipliers, cones = [], []
    for j, obstacle in enumerate(problem.obstacles):
        own = tuple(_cones(obstacle, f"obstacle {j}"))
        fan = _fan(obstacle.A.tobytes(), own)
        for shape in shapes:
            w[len(cones)] = fan.w
            support[len(cones)] = _supports(obstacle.b, shape, fan)
            multipliers.append(fan.multipliers)
            cones.append(own)
    facets = [len({m.rows for m in chosen if len(m.rows) == 1}) for chosen in multipliers]
    n_facets = min(N_DIRECTIONS, bucket(max(facets, default=1)))
    return DirectionTable(
        w,
        support,
        n_facets,
        tuple(multipliers),
        tuple(cones),
        tuple(obstacle for obstacle in problem.obstacles for _ in shapes),
        shapes * len(problem.obstacles),
    )


def direction(obstacle: HPolytope, body: Disc | Polygon, m: Multiplier) -> tuple[np.ndarray, float]:
    """The direction w (2,) of a multiplier and the support of obstacle + (-body) along it, both
    rounded to nearest.
    """
    rows = [(*map(Fraction, obstacle.A[i]), Fraction(obstacle.b[i])) for i in m.rows]
    x, y, bound = (sum(v * row[c] for v, row in zip(m.values, rows, strict=True)) for c in range(3))
    w = np.array([float(x), float(y)])
    return w, float(bound) + float(_body_support(body, w[None])[0])


class _Fan(NamedTuple):
    """Directions of an obstacle's normals, whatever its offsets: multipliers and w (d, 2).

    whole, denominator: the multipliers once more, as whole numbers (d, rows) over one denominator.
    """

    multipliers: tuple[Multiplier, ...]
    w: np.ndarray
    whole: list[list[int]]
    denominator: int


@lru_cache(maxsize=256)
def _fan(A: bytes, cones: tuple) -> _Fan:
    """Obstacles of one shape share their fan: in a batch, or a loop of replanning, it is made
    once.
    """
    A = np.frombuffer(A).reshape(-1, 2)
    chosen = _spread(A, cones)
    rows = [[Fraction(v) for v in row] for row in A]
    w = np.array(
        [
            [float(sum(v * rows[i][c] for i, v in zip(*m, strict=True))) for c in (0, 1)]
            for m in chosen
        ]
    )
    denominator = math.lcm(*(v.denominator for m in chosen for v in m.values))
    whole = [[0] * len(A) for _ in chosen]
    for line, m in zip(whole, chosen, strict=True):
        for i, v in zip(*m, strict=True):
            line[i] = v.numerator * (denominator // v.denominator)
    return _Fan(tuple(chosen), w, whole, denominator)


def _supports(b: np.ndarray, body: Disc | Polygon, fan: _Fan) -> np.ndarray:
    """Support of obstacle + (-body) along every direction of the fan: (d,), the obstacle's part
    rounded once.
    """
    exact = [Fraction(v) for v in b]
    scale = math.lcm(*(v.denominator for v in exact))
    bounds = [v.numerator * (scale // v.denominator) for v in exact]
    total = fan.denominator * scale
    own = [sum(m * x for m, x in zip(line, bounds, strict=True)) / total for line in fan.whole]
    return np.array(own) + _body_support(body, fan.w)


def _body_support(body: Disc | Polygon, w: np.ndarray) -> np.ndarray:
    """Support of -body along directions w (d, 2): (d,)."""
    if isinstance(body, Disc):
        return body.radius * np.hypot(*w.T)
    return (-body.vertices @ w.T).max(axis=0)


def _spread(A: np.ndarray, cones) -> list[Multiplier]:
    """N_DIRECTIONS multipliers for normals A (h, 2): every facet, then each cone in proportion to
    its angle.
    """
    facets = [Multiplier((i,), (Fraction(1),)) for i in dict.fromkeys(i for i, _ in cones)]
    angle = np.arctan2(A[:, 1], A[:, 0])
    width = np.array([(angle[j] - angle[i]) % (2 * np.pi) for i, j in cones])
    count = np.floor(width / width.sum() * (N_DIRECTIONS - len(facets))).astype(int)
    out = list(facets)
    for (i, j), n, span in zip(cones, count, width, strict=True):
        for step in range(1, n + 1):
            a = angle[i] + span * step / (n + 1)
            share = np.linalg.solve(A[[i, j]].T, [np.cos(a), np.sin(a)])
            out.append(_rounded(A, (i, j), np.maximum(share, 0), TABLE_BITS))
    return (out + [facets[0]] * N_DIRECTIONS)[:N_DIRECTIONS]


def _cones(obstacle, name: str) -> list[tuple[int, int]]:
    """Pairs of rows (i, j), counter-clockwise neighbours that meet in a corner: their cones tile
    the plane.
    """
    found = {}
    for corner in corners(obstacle, name):
        rows = corner.rows
        for i, j in zip(rows, rows[1:] + rows[:1], strict=True):
            cross = obstacle.A[i, 0] * obstacle.A[j, 1] - obstacle.A[i, 1] * obstacle.A[j, 0]
            if cross > 0:
                found[i, j] = None
    return list(found)


def _rounded(A: np.ndarray, rows, share, bits: int) -> Multiplier:
    """Multipliers near `share`, rounded as if the rows had unit length: rows may be spelled in any
    units.
    """
    power = [int(np.frexp(np.hypot(*A[i]))[1]) for i in rows]
    size = np.array([s * 2.0**p for s, p in zip(share, power, strict=True)])
    whole = [round(float(s / size.max()) * 2**bits) for s in size]
    scaled = [
        Fraction(n, 2**bits) * Fraction(2) ** (max(power) - p)
        for n, p in zip(whole, power, strict=True)
    ]
    kept = [(r, v) for r, v in zip(rows, scaled, strict=True) if v > 0]
    return Multiplier(tuple(r for r, _ in kept), tuple(v for _, v in kept))
