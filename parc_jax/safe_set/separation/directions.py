"""Directions that separate, with the multipliers that make them proofs. [T12a, T20]

A direction is w = lambda_i A_i + lambda_j A_j with lambda >= 0 on two rows of the obstacle that
meet in a corner, in space on three; then h_O(w) <= lambda_i b_i + lambda_j b_j for any such lambda,
with equality because the corner attains both. Multipliers are short binary fractions, so a
certificate spells them exactly in a few bytes.
"""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.common import struct
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.problem.body import Disc, Polygon
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.separation.pairs import bucket, corners, numbered_pairs

Cones = Sequence[tuple[int, ...]]  # rows of an obstacle that meet in a corner, n_p each
N_DIRECTIONS = {2: 48, 3: 96}  # per obstacle, by dimension: about 7.5 and 20 degrees apart
TABLE_BITS = 6  # lambda of the table: multiples of 2^-6, largest 1
POINT_BITS = 26  # lambda of a direction made for one point: multiples of 2^-26
N_POOL = 1500  # directions in space, of which the table takes those that spread best
APART = np.radians(20)  # of the middle of two or three normals in space, to be worth a place
# [largest volume that three unit normals span at a corner] three that span less are no cone
FLAT = 1e-9


class Multiplier(NamedTuple):
    """Rows and nonnegative multipliers of one obstacle: w = sum of value * A_row."""

    rows: tuple[int, ...]
    values: tuple[Fraction, ...]


@struct.dataclass
class DirectionTable:
    """Directions of every pair of an obstacle and a part of the body, obstacle by obstacle, padded
    with repetitions. Facet normals come first.

    w: (o, d, n_p). support: (o, d) [m * |w|] of obstacle + (-shape) along w, rounded to nearest.
    n_facets: number of leading directions that hold all facet normals, padded to few values.
    multipliers: per pair a tuple of d Multiplier. cones: per pair the rows of its obstacle, n_p
        each, that meet in a corner. obstacles, shapes: of every pair. These four are host-only.
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
        """The table without the fields of the host."""
        return DirectionTable(self.w, self.support, self.n_facets)

    @property
    def of_unit_length(self) -> "DirectionTable":
        """Its facet normals alone, at length one, where they are not zero."""
        w, support = self.w[:, : self.n_facets], self.support[:, : self.n_facets]
        size = np.linalg.norm(w, axis=-1)
        size = np.where(size > 0, size, 1)
        return DirectionTable(w / size[..., None], support / size, self.n_facets)

    def spelled(self) -> np.ndarray:
        """Multipliers (o, d) as an object array, looked up by index like w; None for padding."""
        out = np.empty(self.support.shape, object)
        for j, row in enumerate(self.multipliers):
            for d, m in enumerate(row):
                out[j, d] = m
        return out

    def direction(self, o: int, m: Multiplier) -> tuple[np.ndarray, float]:
        """The direction w (n_p,) of a multiplier of pair o, and the support of its obstacle +
        (-shape) along it, both rounded to nearest.
        """
        obstacle, rows = self.obstacles[o], list(m.rows)
        columns = np.concatenate([obstacle.A[rows], obstacle.b[rows, None]], axis=1).T.tolist()
        *along, bound = (_rounded_sum(m.values, column) for column in columns)
        w = np.array(along)
        return w, bound + float(body_support(self.shapes[o], w[None])[0])

    def nearest_of_many(self, o: int, w: np.ndarray) -> list[Multiplier]:
        """Of pair o the multipliers whose directions are nearest to each of w (m, n_p), on the rows
        whose normals enclose it.
        """
        return _nearest(self.obstacles[o].A, np.array(self.cones[o]), w, POINT_BITS)


def direction_table(
    problem: Problem, n_p: int, kept: Sequence[int] | np.ndarray | None = None, size: int = 0
) -> DirectionTable:
    """Facet normals and evenly spread directions in the normal cone of every corner of every
    obstacle, for every part of the body; or of the pairs of these numbers alone. size: pairs that
    there is room for, at least.
    """
    pairs = numbered_pairs(problem, kept)
    n_o = max(size, bucket(len(pairs)))
    n_d = N_DIRECTIONS[n_p]
    w = np.zeros((n_o, n_d, n_p))
    support = np.zeros((n_o, n_d))
    told = []  # of every pair what only the host needs
    for o, (j, part) in enumerate(pairs):
        obstacle, shape = problem.obstacles[j], problem.parts[part].shape
        cones = tuple(_cones(obstacle, f"obstacle {j}"))
        chosen, w[o] = _fan(obstacle.A.tobytes(), cones)
        bounds = [_rounded_sum(m.values, obstacle.b[list(m.rows)].tolist()) for m in chosen]
        support[o] = bounds + body_support(shape, w[o])
        told.append((chosen, cones, obstacle, shape))
    facets = [len({m.rows for m in chosen if len(m.rows) == 1}) for chosen, *_ in told]
    n_facets = min(n_d, bucket(max(facets, default=1)))
    return DirectionTable(w, support, n_facets, *zip(*told, strict=True))


def _rounded_sum(values: tuple[Fraction, ...], column: list[float]) -> float:
    """The sum of value * x, rounded once: whole numbers over one denominator, which `/` rounds."""
    ratios = [x.as_integer_ratio() for x in column]
    terms = [
        (v.numerator * above, v.denominator * below)
        for v, (above, below) in zip(values, ratios, strict=True)
    ]
    scale = math.lcm(*(below for _, below in terms))
    return sum(above * (scale // below) for above, below in terms) / scale


@lru_cache(maxsize=256)
def _fan(A: bytes, cones: Cones) -> tuple[tuple[Multiplier, ...], np.ndarray]:
    """Multipliers and directions w (d, n_p) of an obstacle's normals, which do not depend on its
    offsets: in a batch, or a loop of replanning, obstacles of one shape share them.
    """
    n_p = len(cones[0])
    A = np.frombuffer(A).reshape(-1, n_p)
    chosen = _spread_in_plane(A, cones) if n_p == 2 else _spread_in_space(A, cones)
    w = [[_rounded_sum(m.values, c) for c in A[list(m.rows)].T.tolist()] for m in chosen]
    return tuple(chosen), np.array(w)


def body_support(body: Disc | Polygon, w: np.ndarray) -> np.ndarray:
    """Support of -body along directions w (d, n_p): (d,)."""
    if isinstance(body, Disc):
        return body.radius * np.hypot.reduce(w, axis=1)
    return (-body.vertices @ w.T).max(axis=0)


def _spread_in_plane(A: Float[np.ndarray, "h 2"], cones: Cones) -> list[Multiplier]:
    """Multipliers for normals A: every facet, then each cone in proportion to its angle."""
    facets = [Multiplier((i,), (Fraction(1),)) for i in dict.fromkeys(i for i, _ in cones)]
    n_d = N_DIRECTIONS[2]
    angle = np.arctan2(A[:, 1], A[:, 0])
    power = _sizes(A)
    width = np.array([(angle[j] - angle[i]) % (2 * np.pi) for i, j in cones])
    count = np.floor(width / width.sum() * (n_d - len(facets))).astype(int)
    out = list(facets)
    for (i, j), n, span in zip(cones, count, width, strict=True):
        a = angle[i] + span * np.arange(1, n + 1) / (n + 1)
        share = np.linalg.solve(A[[i, j]].T, np.stack([np.cos(a), np.sin(a)])).T
        out += [_rounded(power, (i, j), s, TABLE_BITS) for s in np.maximum(share, 0).tolist()]
    return (out + [facets[0]] * n_d)[:n_d]


def _spread_in_space(A: Float[np.ndarray, "h 3"], cones: Cones) -> list[Multiplier]:
    """Multipliers for normals A: every facet, then always the direction that is farthest from all
    so far: first among the middles of two or three normals that meet, then all around.
    """
    n_d = N_DIRECTIONS[3]
    cones = np.array(cones)
    facets = np.unique(cones)
    unit = A / np.linalg.norm(A, axis=1)[:, None]
    pairs = np.unique(np.sort(cones[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1), axis=0)
    middles = np.concatenate([unit[pairs].sum(axis=1), unit[cones].sum(axis=1)])
    middles = middles / np.linalg.norm(middles, axis=1)[:, None]
    chosen = unit[facets]
    for pool, apart in ((middles, APART), (sphere(N_POOL), 0.0)):
        chosen = _with_farthest(chosen, pool, apart, n_d)
    facets = [Multiplier((int(i),), (Fraction(1),)) for i in facets]
    return (facets + _nearest(A, cones, chosen[len(facets) :], TABLE_BITS))[:n_d]


def _with_farthest(chosen: np.ndarray, pool: np.ndarray, apart: float, n: int) -> np.ndarray:
    """Up to n unit vectors: the chosen, then the pool's farthest from all, by more than `apart`."""
    alike = (pool @ chosen.T).max(axis=1)
    while len(chosen) < n and alike.min() < np.cos(apart):
        farthest = pool[int(np.argmin(alike))]
        chosen = np.concatenate([chosen, farthest[None]])
        alike = np.maximum(alike, pool @ farthest)
    return chosen


def sphere(n: int) -> np.ndarray:
    """(n, 3) unit vectors, spread evenly: a spiral that turns by the golden angle."""
    i = np.arange(n)
    height = 1 - (2 * i + 1) / n
    angle = np.pi * (3 - np.sqrt(5)) * i
    around = np.sqrt(1 - height**2)
    return np.stack([around * np.cos(angle), around * np.sin(angle), height], axis=1)


def _cones(obstacle: HPolytope, name: str) -> list[tuple[int, ...]]:
    """Rows that meet in a corner and whose normals span a cone: together these cones fill the
    plane, as pairs of counter-clockwise neighbours (i, j), or space, as all triples.
    """
    found = {}
    for corner in corners(obstacle, name):
        rows = corner.rows
        if obstacle.n == 2:
            for i, j in zip(rows, rows[1:] + rows[:1], strict=True):
                if _det(obstacle.A[[i, j]]) > 0:
                    found[i, j] = None
        else:
            triples = np.array(list(combinations(rows, 3)))
            normals = obstacle.A[triples]
            spanned = np.abs(_det(normals)) / np.linalg.norm(normals, axis=-1).prod(axis=-1)
            wide = triples[spanned > FLAT * spanned.max()]
            found.update(dict.fromkeys(map(tuple, wide.tolist())))
    return list(found)


def _nearest(A: np.ndarray, cones: np.ndarray, w: np.ndarray, bits: int) -> list[Multiplier]:
    """The multipliers whose directions are nearest to w (m, n_p), each on the cone (c, n_p) of rows
    that holds it: the normal cones of the corners of a bounded set cover everything.
    """
    normals = A[cones]
    share = []
    for i in range(w.shape[1]):
        with_w = np.tile(normals, (len(w), 1, 1, 1))
        with_w[:, :, i] = w[:, None]
        share.append(_det(with_w))
    share = np.stack(share, axis=2) / _det(normals)[:, None]
    best = share.min(axis=2).argmax(axis=1)
    share = np.maximum(share[np.arange(len(w)), best], 0)
    size = _sizes(A)
    chosen = cones[best].tolist()
    return [_rounded(size, tuple(c), s, bits) for c, s in zip(chosen, share.tolist(), strict=True)]


def _det(rows: np.ndarray):
    """(...) determinants of rows (..., n, n), n = 2 or 3."""
    if rows.shape[-1] == 3:
        return (rows[..., 0, :] * np.cross(rows[..., 1, :], rows[..., 2, :])).sum(axis=-1)
    return rows[..., 0, 0] * rows[..., 1, 1] - rows[..., 0, 1] * rows[..., 1, 0]


def _sizes(A: np.ndarray) -> list[int]:
    """Of every row the power of two just above its length."""
    return np.frexp(np.hypot.reduce(A, axis=1))[1].tolist()


def _rounded(power: list[int], rows: Sequence[int], share: list[float], bits: int) -> Multiplier:
    """Multipliers near `share`, rounded as if rows of sizes 2^power had unit length."""
    power = [power[i] for i in rows]
    size = [s * 2.0**p for s, p in zip(share, power, strict=True)]
    largest = max(size)
    kept, values = [], []
    for row, s, p in zip(rows, size, power, strict=True):
        whole = round(s / largest * 2**bits)
        if whole > 0:
            kept.append(row)
            values.append(Fraction(whole << (max(power) - p), 1 << bits))
    return Multiplier(tuple(kept), tuple(values))


class Run(NamedTuple):
    """A direction that separates one obstacle from interval `first` up to, not including, `end`."""

    first: int
    end: int
    multiplier: Multiplier


def merged_runs(multipliers: Iterable[Multiplier], intervals: Iterable[int]) -> list[Run]:
    """Runs of one and the same multiplier over consecutive intervals."""
    runs: list[Run] = []
    for m, t in zip(multipliers, intervals, strict=True):
        if runs and runs[-1].multiplier is m:
            runs[-1] = runs[-1]._replace(end=int(t) + 1)
        else:
            runs.append(Run(int(t), int(t) + 1, m))
    return runs


def longest_lasting(holds: np.ndarray) -> np.ndarray:
    """Fewest runs of directions over time.

    holds: (d, T) bool.
    Returns (T,) the number of a direction, which stays until it fails, then the one that lasts
        longest; -1 where none holds.
    """
    n_steps = holds.shape[1]
    length = np.zeros((len(holds), n_steps + 1), int)
    for t in range(n_steps - 1, -1, -1):
        length[:, t] = np.where(holds[:, t], 1 + length[:, t + 1], 0)
    out = np.full(n_steps, -1)
    current = -1
    for t in range(n_steps):
        if current < 0 or not holds[current, t]:
            current = int(np.argmax(length[:, t])) if holds[:, t].any() else -1
        out[t] = current
    return out
