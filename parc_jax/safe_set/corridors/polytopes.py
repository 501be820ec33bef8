"""The safe set as polytopes: corridors cut to cells (region, bin), where the network is affine;
vertices, volumes, uniform samples. [T29]
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import jax
import numpy as np
from jaxtyping import ArrayLike

from parc_jax.common.errors import InputError, check_count
from parc_jax.common.keys import generator
from parc_jax.common.sets.extent import chebyshev_center
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import Solid, sample_solid, solid
from parc_jax.common.spelling import rounded_down
from parc_jax.learning.network.maps import pattern_map
from parc_jax.safe_set.corridors.build import greedy
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.safe_plans import as_plans, members
from parc_jax.safe_set.corridors.sampling import Place, Points, ends_from, safe_ones
from parc_jax.safe_set.corridors.search import draw_safe_plans
from parc_jax.safe_set.corridors.stopping import Coverage, Limit, nothing_covered, stopping_rule
from parc_jax.safe_set.verdict.scene import Scene

COUNTED = 6000  # fresh safe plans that measure the coverage


@dataclass(frozen=True, eq=False)
class SafePolytope:
    """The polytope of all (p0, k) of one activation pattern and one bin that satisfy a corridor.

    p0 (n_p,), k (n_k,): a point strictly inside. pattern (n_hidden,) bool.
    """

    scene: Scene
    p0: np.ndarray
    k: np.ndarray
    pattern: np.ndarray
    bin: int
    corridor: Corridor

    @property
    def cell(self) -> bytes:
        """Name of its region and bin, as of `cell_of`."""
        return cell_of(self.pattern[None], np.array([self.bin]))[0].tobytes()

    @cached_property
    def halfspaces(self) -> HPolytope:
        """The polytope as float64 rows over (p0, k), each pulled in by the rounding tolerance."""
        model, scene = self.scene.model, self.scene
        A, b, C, d = _cell_rows(scene, self.pattern, self.bin)
        rows, bounds = [A], [b]
        # the inequalities w . p^ > threshold (o, T, i), for each point of each obstacle at both
        # ends of every interval; rounding tolerance included
        w, points = self.corridor.w, self.corridor.points
        threshold = self.corridor.threshold(model.tube.during(self.bin))
        active = np.asarray(scene.obstacles.active)[: len(w)]
        C = C.reshape(len(C), model.n_points, model.n_p, -1)[:, points]
        d = d.reshape(len(d), model.n_points, model.n_p)[:, points]
        w = np.broadcast_to(w[:, :, None], (*threshold.shape, model.n_p))
        for shift in (0, 1):
            knots = slice(shift, shift + model.time.n_steps)
            along = np.einsum("otip,toipk->otik", w, C[knots])
            offset = np.einsum("otip,toip->oti", w, d[knots])
            both = np.concatenate([w, along], axis=3)[active]
            rows.append(-both.reshape(-1, both.shape[-1]))
            bounds.append((offset - threshold)[active].ravel())
        A, b = np.concatenate(rows), np.concatenate(bounds)
        size = np.abs(A).sum(axis=1)
        real = size > 0
        return HPolytope(A[real], b[real] - float(scene.slack) * size[real])


def _cell_rows(scene: Scene, pattern: np.ndarray, bin: int):
    """Rows A (h, n_p + n_k), b (h,) of the goal-reaching set of a cell: its bin, region, shrunken
    goal and start set. Map of its places, C (T + 1, n_c, n_k), d (T + 1, n_c), relative to the
    start of the first point.
    """
    tube, layout, n_p, n_k = scene.model.tube, scene.model.layout, scene.model.n_p, scene.model.n_k
    lo, hi = tube.bin_box(bin)
    lo, hi = np.maximum(lo, scene.k_lo), np.minimum(hi, scene.k_hi)
    region_A, region_b, C, d = pattern_map(scene.model.net, pattern)
    q_C, q_d = C[layout.n_offsets :], d[layout.n_offsets :]
    C = np.concatenate([np.zeros((n_p, n_k)), C[: layout.n_offsets]]).reshape(-1, layout.n_c, n_k)
    d = np.concatenate([np.zeros(n_p), d[: layout.n_offsets]]).reshape(-1, layout.n_c)
    goal_c, goal_q = np.split(scene.goal_A, [layout.n_c], axis=1)
    goal_p = goal_c.reshape(len(goal_c), -1, n_p).sum(axis=1)  # every point moves with p0
    goal_k = goal_c @ C[-1] + goal_q @ q_C
    at_zero = goal_c @ d[-1] + goal_q @ q_d
    goal_b = scene.goal_b - tube.support_at_end(scene.goal_A, bin) - at_zero
    # normals over p0 and over k
    eye = np.eye(n_k)
    of_p = [np.zeros((2 * n_k + len(region_b), n_p)), goal_p, scene.start_A]
    of_k = [eye, -eye, region_A, goal_k, np.zeros((len(scene.start_b), n_k))]
    A = np.concatenate([np.concatenate(of_p), np.concatenate(of_k)], axis=1)
    return A, np.concatenate([hi, -lo, region_b, goal_b, scene.start_b]), C, d


def cell_of(pattern: np.ndarray, bins: np.ndarray) -> np.ndarray:
    """(b,) byte strings that are equal exactly when pattern (b, n_hidden) and bin (b,) are."""
    packed = np.packbits(pattern, axis=1)
    tail = np.ascontiguousarray(bins, dtype="<i4").view(np.uint8).reshape(len(packed), 4)
    name = np.ascontiguousarray(np.concatenate([packed, tail], axis=1))
    return name.view(f"V{name.shape[1]}")[:, 0]


def groups(cells: np.ndarray):
    """Pairs (cell bytes, indices) of equal cells."""
    order = np.argsort(cells, kind="stable")
    names, first = np.unique(cells[order], return_index=True)
    own = np.split(order, first[1:])
    return [(name.tobytes(), index) for name, index in zip(names, own, strict=False)]


def cut_around(
    scene: Scene, corridors: Corridors, counts: np.ndarray, points: Points
) -> list[SafePolytope]:
    """Polytopes around the plans that satisfy a corridor: in each cell a greedy set cover of them.

    counts: (c,) plans in each corridor, by which ties are broken: the most popular is taken.
    """
    popular = np.argsort(-counts, kind="stable")
    kept = corridors.kept(points.path, points.bin)[:, popular]
    cuts = []
    for _, cell in groups(cell_of(points.pattern, points.bin)):
        for c in greedy(kept[cell]):
            inside = points.at(cell[kept[cell, c]])
            # a polytope is convex: the mean of plans inside is inside too
            p0, k = inside.p0.mean(axis=0), inside.k.mean(axis=0)
            corridor = corridors.all[popular[c]]
            cuts.append(SafePolytope(scene, p0, k, inside.pattern[0], int(inside.bin[0]), corridor))
    return cuts


@dataclass(eq=False, repr=False)
class Polytopes:
    """Safe convex polytopes of (p0, k), each inside one region and one bin; in k alone where all
    plans have one start. From `Answer.polytopes`. All arrays are float64. [T29]

    all: the polytopes: pattern, bin, corridor and inner point each. coverage: share of the model's
    safe set inside them, of a look at fresh plans. proved: the checker accepted each; refused: how
    many it did not accept, which were left out.
    """

    scene: Scene
    all: list[SafePolytope]
    coverage: Coverage
    proved: bool = False
    refused: int = 0

    def __post_init__(self) -> None:
        corridors = {id(p.corridor): p.corridor for p in self.all}
        place = {name: i for i, name in enumerate(corridors)}
        self._corridors = Corridors(self.scene.model.tube, corridors.values())
        self._corridor_of = np.array([place[id(p.corridor)] for p in self.all], int)
        self._by_cell: dict[bytes, list[int]] = {}
        for index, polytope in enumerate(self.all):
            self._by_cell.setdefault(polytope.cell, []).append(index)

    def __len__(self) -> int:
        return len(self.all)

    def __iter__(self) -> Iterator[SafePolytope]:
        return iter(self.all)

    def __repr__(self) -> str:
        least, sure = rounded_down(100 * self.coverage.at_least, 3), self.coverage.confidence
        of = f", at least {least} % of their answer's safe set (confidence {sure})"
        return f"<Polytopes: {len(self):,}{of if self.coverage.share else ''}>"

    @cached_property
    def _solids(self) -> list[Solid]:
        """Geometry of polytopes thicker than rounding; of sections if all plans have one start."""
        return [shape for shape in map(self._solid, self.all) if shape is not None]

    def _solid(self, polytope: SafePolytope) -> Solid | None:
        if (start := self.scene.at) is None:
            return solid(polytope.halfspaces, np.concatenate([polytope.p0, polytope.k]))
        n_p = len(start)
        A, b = polytope.halfspaces.A, polytope.halfspaces.b
        moves = A[:, n_p:].any(axis=1)
        section = solid(HPolytope(A[moves, n_p:], (b - A[:, :n_p] @ start)[moves]), polytope.k)
        if section is None:
            return None
        starts = np.tile(start, (len(section.vertices), 1))
        return section._replace(vertices=np.concatenate([starts, section.vertices], axis=1))

    @property
    def sets(self) -> list[HPolytope]:
        """The polytopes by rows over (p0, k), or over k alone, without redundant rows."""
        return [shape.polytope for shape in self._solids]

    @property
    def volumes(self) -> np.ndarray:
        """(m,) volumes of `sets` [units of p0 and k multiplied]; those of a region may overlap."""
        return np.array([shape.volume for shape in self._solids])

    def project(self, dims: Sequence[int]) -> list[np.ndarray]:
        """Vertices (v, len(dims)) of each of `sets`, projected onto coordinates of (p0, k)."""
        n = self.scene.model.n_p + self.scene.model.n_k
        if not all(0 <= d < n for d in dims):
            raise InputError(f"project: expected axes of (p0, k), 0 to {n - 1}; got {list(dims)}.")
        return [shape.vertices[:, list(dims)] for shape in self._solids]

    def centre(self) -> tuple[np.ndarray, float]:
        """Centre (n_p + n_k,) and radius of the largest ball inside one polytope, in (p0, k) units;
        of k alone, (n_k,), where all plans have one start.

        The radius is a margin for command error, and for that of the start where plans have not
        one: every plan in the ball is safe. Raises InputError without polytopes.
        """
        balls = [chebyshev_center(s) for s in self.sets]
        feasible = [(b.center, float(b.radius)) for b in balls if b.radius >= 0]
        if not feasible:
            raise InputError("centre: expected safe polytopes; there are none.")
        return max(feasible, key=lambda ball: ball[1])

    def contains(self, p0: ArrayLike, k: ArrayLike) -> np.ndarray:
        """(b,) bool: which plans p0 (b, n_p), k (b, n_k) are in a polytope. Raises InputError."""
        return members(self.scene, self.has, *as_plans("contains", self.scene.model, p0, k))

    def has(self, safe: Points) -> np.ndarray:
        """(b,) bool: which of some plans that reach the goal are inside a polytope."""
        return self.count(safe) > 0

    def count(self, at: Points) -> np.ndarray:
        """(b,) number of polytopes around each point."""
        rows, polytopes = [np.zeros(0, int)], [np.zeros(0, int)]
        for cell, index in groups(cell_of(at.pattern, at.bin)):
            here = self._by_cell.get(cell, [])
            rows.append(np.repeat(index, len(here)))
            polytopes.append(np.tile(np.array(here, int), len(index)))
        rows = np.concatenate(rows)
        # within a polytope's cell, its corridor is the polytope
        corridors = self._corridor_of[np.concatenate(polytopes)]
        inside = self._corridors.kept_pairs(at.path, at.bin, rows, corridors)
        return np.bincount(rows[inside], minlength=len(at.k))

    def sample(self, key: jax.Array, n: int) -> np.ndarray:
        """n plans (n, n_p + n_k), uniform over the union: a point of m polytopes is accepted with
        probability 1 / m. Consumes `key`. Raises InputError.
        """
        check_count("sample", n, 0, "1000")
        rng = generator(key)
        solids = [s for s in self._solids if s.volume > 0]
        if not solids:
            raise InputError("sample: expected safe polytopes; there are none to sample from.")
        volumes = np.array([s.volume for s in solids])
        model = self.scene.model
        out = [np.zeros((0, model.n_p + model.n_k))]
        tries = 0
        while sum(len(part) for part in out) < n:
            counts = rng.multinomial(max(2 * n, 64), volumes / volumes.sum())
            x = np.concatenate(
                [sample_solid(s, rng, int(c)) for s, c in zip(solids, counts, strict=True) if c]
            )
            of = x if self.scene.at is None else x[:, model.n_p :]
            around = sum(s.polytope.contains(of).astype(int) for s in solids)
            x = x[rng.random(len(x)) * np.maximum(around, 1) < 1]  # one of them drew it
            p0, k = x[:, : model.n_p], x[:, model.n_p :]
            _, safe = safe_ones(self.scene, ends_from(p0, model, k), k)
            out.append(np.concatenate([safe.p0, safe.k], axis=1)[self.has(safe)])
            tries += 1
            if tries > 100 and len(out[-1]) == 0:
                raise InputError(
                    "sample: the safe polytopes are thinner than float64 resolves; sample a wider "
                    "scene."
                )
        return rng.permutation(np.concatenate(out))[:n]


def cut_polytopes(
    scene: Scene,
    corridors: Corridors,
    key: jax.Array,
    n: int,
    *,
    within: Place | None,
    confidence: float,
    accepts: Callable[[list[SafePolytope]], np.ndarray] | None,
) -> Polytopes:
    """Polytopes around n fresh safe plans, and the share of the model's safe set inside them. [T31]

    within: the place of the search, if any. accepts: the checker, which says (m,) bool which
    polytopes hold; None leaves them unproved.
    """

    def safe_plans(number: int, n: int) -> Points:
        part = jax.random.fold_in(key, number)
        drawn = draw_safe_plans(
            scene, part, generator(part), n, confidence, Limit(math.inf), within
        )
        return drawn.points

    plans = safe_plans(0, n) if len(corridors) else None
    if plans is None or not len(plans.k):
        return Polytopes(scene, [], nothing_covered(confidence), proved=accepts is not None)
    first = corridors.first(plans.path, plans.bin)
    counts = np.bincount(first[first >= 0], minlength=len(corridors))
    polytopes = cut_around(scene, corridors, counts, plans)
    refused = 0
    if accepts is not None and polytopes:
        accepted = accepts(polytopes)
        refused = int((~accepted).sum())
        polytopes = [p for p, good in zip(polytopes, accepted, strict=True) if good]
    # the coverage is of the polytopes that are returned, by plans that none was cut around;
    # a single look, whatever the target: nothing stops here
    cut = Polytopes(
        scene, polytopes, nothing_covered(confidence), proved=accepts is not None, refused=refused
    )
    fresh = safe_plans(1, COUNTED)
    if len(fresh.k):
        cut.coverage = stopping_rule(0.5, confidence).after(cut.has(fresh)).coverage
    return cut
