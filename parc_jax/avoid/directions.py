"""Directions that separate, with the multipliers that make them proofs. [T12a]

A direction is w = lambda_i A_i + lambda_j A_j with lambda >= 0 on two rows of the obstacle that meet in a corner;
then h_O(w) <= lambda_i b_i + lambda_j b_j for any such lambda, with equality because the corner attains both.
Multipliers are short binary fractions, so a certificate spells them exactly in a few bytes.
"""

import math
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from flax import struct

from parc_jax.avoid.grown import bucket
from parc_jax.avoid.polygon import corners, decimal
from parc_jax.problem import Disc, ReachAvoid

N_DIRECTIONS = 48  # per obstacle, about 7.5 degrees apart
TABLE_BITS = 6  # lambda of the table: multiples of 2^-6, largest 1
POINT_BITS = 26  # lambda of a direction made for one point: multiples of 2^-26


class Multiplier(NamedTuple):
    """Rows and nonnegative multipliers of one obstacle: w = sum of value * A_row."""

    rows: tuple[int, ...]
    values: tuple[Fraction, ...]


@struct.dataclass
class DirectionTable:
    """Directions of every obstacle of a scene, padded with repetitions. Facet normals come first.

    w: (o, d, 2). reach: (o, d) [m * |w|] >= support of obstacle + (-body) along w, rounded to nearest.
    multipliers: per obstacle a tuple of d Multiplier (host only). cones: per obstacle the pairs of neighbouring rows.
    n_facets: number of leading directions that hold all facet normals, padded to few values.
    """

    w: np.ndarray
    reach: np.ndarray
    multipliers: tuple = struct.field(pytree_node=False)
    cones: tuple = struct.field(pytree_node=False)
    n_facets: int = struct.field(pytree_node=False)


def direction_table(problem: ReachAvoid) -> DirectionTable:
    """Facet normals and evenly spread directions in the normal cone of every corner of every obstacle."""
    n_o = bucket(len(problem.obstacles))
    w, reach = np.zeros((n_o, N_DIRECTIONS, 2)), np.zeros((n_o, N_DIRECTIONS))
    spelled, cones = [], []
    for j, obstacle in enumerate(problem.obstacles):
        cones.append(tuple(_cones(obstacle, f"obstacle {j}")))
        fan = _fan(obstacle.A.tobytes(), cones[-1])
        spelled.append(fan.multipliers)
        w[j], reach[j] = fan.w, _reaches(problem, j, fan)
    facets = [len({m.rows for m in chosen if len(m.rows) == 1}) for chosen in spelled]
    n_facets = min(N_DIRECTIONS, bucket(max(facets, default=1)))
    return DirectionTable(w, reach, tuple(spelled), tuple(cones), n_facets)


def direction(problem: ReachAvoid, obstacle: int, m: Multiplier) -> tuple[np.ndarray, float]:
    """The direction w (2,) of a multiplier and the reach of obstacle + (-body) along it, both rounded to nearest."""
    part = problem.obstacles[obstacle]
    rows = [(decimal(part.A[i, 0]), decimal(part.A[i, 1]), decimal(part.b[i])) for i in m.rows]
    x, y, reach = (sum(v * row[c] for v, row in zip(m.values, rows, strict=True)) for c in range(3))
    w = np.array([float(x), float(y)])
    if isinstance(problem.body, Disc):
        return w, float(reach) + problem.body.radius * float(np.hypot(*w))
    return w, float(reach) + float((-problem.body.vertices @ w).max())


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
    """Obstacles of one shape share their fan: in a batch, or a loop of replanning, it is made once."""
    A = np.frombuffer(A).reshape(-1, 2)
    chosen = _spread(A, cones)
    rows = [[decimal(v) for v in row] for row in A]
    w = np.array([[float(sum(v * rows[i][c] for i, v in zip(*m, strict=True))) for c in (0, 1)] for m in chosen])
    denominator = math.lcm(*(v.denominator for m in chosen for v in m.values))
    whole = [[0] * len(A) for _ in chosen]
    for line, m in zip(whole, chosen, strict=True):
        for i, v in zip(*m, strict=True):
            line[i] = v.numerator * (denominator // v.denominator)
    return _Fan(tuple(chosen), w, whole, denominator)


def _reaches(problem: ReachAvoid, obstacle: int, fan: _Fan) -> np.ndarray:
    """Reach of obstacle + (-body) along every direction of the fan: (d,), the obstacle's part rounded once."""
    b = [decimal(v) for v in problem.obstacles[obstacle].b]
    scale = math.lcm(*(v.denominator for v in b))
    offsets = [v.numerator * (scale // v.denominator) for v in b]
    total = fan.denominator * scale
    reach = np.array([sum(m * x for m, x in zip(line, offsets, strict=True)) / total for line in fan.whole])
    if isinstance(problem.body, Disc):
        return reach + problem.body.radius * np.hypot(*fan.w.T)
    return reach + (-problem.body.vertices @ fan.w.T).max(axis=0)


def multiplier_near(problem: ReachAvoid, table: DirectionTable, obstacle: int, w: np.ndarray) -> Multiplier:
    """The multiplier whose direction is nearest to w (2,), on the two rows whose normals enclose w."""
    part = problem.obstacles[obstacle]
    A, pairs = part.A, np.array(table.cones[obstacle])
    first, second = A[pairs[:, 0]], A[pairs[:, 1]]
    det = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    share = np.stack([w[0] * second[:, 1] - w[1] * second[:, 0], first[:, 0] * w[1] - first[:, 1] * w[0]], axis=1)
    share = share / det[:, None]
    best = int(np.argmax(share.min(axis=1)))  # the normal cones of a bounded polygon cover the plane
    return _rounded(A, tuple(int(i) for i in pairs[best]), np.maximum(share[best], 0), POINT_BITS)


def _spread(A: np.ndarray, cones) -> list[Multiplier]:
    """N_DIRECTIONS multipliers for normals A (h, 2): every facet, then each cone in proportion to its angle."""
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
    """Pairs of rows (i, j), counter-clockwise neighbours that meet in a corner: their cones tile the plane."""
    found = {}
    for corner in corners(obstacle, name):
        rows = corner.rows
        for i, j in zip(rows, rows[1:] + rows[:1], strict=True):
            cross = obstacle.A[i, 0] * obstacle.A[j, 1] - obstacle.A[i, 1] * obstacle.A[j, 0]
            if cross > 0:
                found[i, j] = None
    return list(found)


def _rounded(A: np.ndarray, rows, share, bits: int) -> Multiplier:
    """Multipliers near `share`, rounded as if the rows had unit length: rows may be spelled in any units."""
    power = [int(np.frexp(np.hypot(*A[i]))[1]) for i in rows]
    size = np.array([s * 2.0**p for s, p in zip(share, power, strict=True)])
    whole = [round(float(s / size.max()) * 2**bits) for s in size]
    scaled = [Fraction(n, 2**bits) * Fraction(2) ** (max(power) - p) for n, p in zip(whole, power, strict=True)]
    kept = [(r, v) for r, v in zip(rows, scaled, strict=True) if v > 0]
    return Multiplier(tuple(r for r, _ in kept), tuple(v for _, v in kept))
