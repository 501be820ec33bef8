"""The published search: region by region outward, sample Omega, drop starts that lie in an avoid set. [NP Sec. IV]

Two interchangeable ways to decide the avoid sets: "lp" with AH-polytopes and one LP per question, as published, and
"supports" with the same sets as polygons. Faults of published code (SOUNDNESS A5, A6) are not repeated; for parity they
can be asked for by name, and then the answer says "assumed".
"""

import enum
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.avoid.bas import avoid_set, within_reach
from parc_jax.avoid.paper_scene import PaperScene
from parc_jax.avoid.shadow import clear_of_reach, outside, shadows
from parc_jax.errors import InputError
from parc_jax.lp.status import LPStatus
from parc_jax.lp.witness import gamma
from parc_jax.reach.brs import ReachSet, reach_set, reach_sets
from parc_jax.reach.pieces import Piece
from parc_jax.sets.ahpolytope import AHPolytope
from parc_jax.sets.emptiness import find_point
from parc_jax.sets.hit_and_run import sample_polytopes
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.sets.membership import membership

SAMPLES_PER_REGION = 50  # as published
_THIN = 16  # hit-and-run steps between samples
_ROW_BUCKET = 8  # rows are padded to a multiple of this


class Fault(enum.Enum):
    """Faults of published code that a caller may ask for, for parity. Each makes the answer "assumed"."""

    TROUBLE_IS_SAFE = "an undecided LP counts as empty or not contained (A5)"
    START_BEFORE_HULL = "starts outside P0 are cut off before the hull is taken (A6)"


@dataclass
class PaperAnswer:
    """What the published search found.

    samples: (n, n_p + n_k) starts and parameters, safe for the model inside the tube. region: (n,) their regions.
    label: "model" (safe by the region maps in float64, rounding covered) or "assumed" (a fault was asked for).
    regions, reachable: regions visited, and those with a non-empty Omega. avoid_sets, avoid_empty: avoid sets of the
    reachable pieces, and those pruned as empty. unknown: LPs that stayed undecided, never safe without a fault.
    seconds: wall time by part: "reach", "avoid", "samples", "check".
    """

    samples: np.ndarray
    region: np.ndarray
    label: str
    regions: int = 0
    reachable: int = 0
    avoid_sets: int = 0
    avoid_empty: int = 0
    unknown: int = 0
    seconds: dict[str, float] = field(default_factory=dict)


def paper_search(
    key, regions: Iterable[list[Piece]], scene: PaperScene, *,
    method: str = "supports", anytime: bool = False, samples: int = SAMPLES_PER_REGION,
    faults: frozenset[Fault] = frozenset(), together: int = 64,
) -> PaperAnswer:  # fmt: skip
    """Safe (p0, k) of a problem by the published method. `key` is not consumed: every piece folds in its own numbers.

    regions: pieces of one region after the other, outward from a seed (`pieces_outward`). method: "supports" or "lp".
    anytime: stop at the first region with a safe sample; else visit all. samples: drawn from Omega per region.
    together: regions handled in one batch by "supports"; larger batches are faster.
    Raises InputError.
    """
    if method not in ("supports", "lp"):
        raise InputError(f'paper_search: expected method "supports" or "lp"; got {method!r}.')
    if faults and method != "lp":
        raise InputError('paper_search: faults of the published code exist only in method "lp".')
    answer = PaperAnswer(np.zeros((0, 0)), np.zeros(0, int), "assumed" if faults else "model")
    found: list[tuple[int, np.ndarray]] = []
    for batch in _batches(regions, 1 if method == "lp" or anytime else together):
        answer.regions += len(batch)
        pieces = [piece for region in batch for piece in region]
        reached = _reach(pieces, scene, method, answer, faults)
        answer.reachable += len({piece.region for piece, _ in reached})
        if reached:
            found += _safe_of(key, reached, scene, method, samples, answer, faults)
        if anytime and found:
            break
    nothing = np.zeros((0, scene.n_p + scene.n_k))
    answer.samples = np.concatenate([nothing, *(points for _, points in found)])
    answer.region = np.repeat([number for number, _ in found], [len(points) for _, points in found]).astype(int)
    return answer


def _reach(pieces, scene: PaperScene, method: str, answer: PaperAnswer, faults) -> list[tuple[Piece, ReachSet]]:
    """Pieces whose Omega is not proved empty and has an inner point to sample from."""
    with _timed(answer, "reach"):
        if method == "lp":
            goals = scene.goals
            sets = [
                reach_set(p, HPolytope(goals.A, goals.b[p.bin]), scene.goal_box, scene.start, scene.n_p) for p in pieces
            ]
        else:
            sets = reach_sets(pieces, scene.goals, scene.goal_box, scene.start, scene.n_p)
    answer.unknown += sum(s.status is LPStatus.UNKNOWN for s in sets)
    return [(p, s) for p, s in zip(pieces, sets, strict=True) if s.status is LPStatus.FEASIBLE]


def _safe_of(key, reached, scene, method, samples, answer, faults) -> list[tuple[int, np.ndarray]]:
    """Safe samples of the reachable pieces, with their region numbers."""
    with _timed(answer, "samples"):
        drawn = _draw(key, reached, samples)
    # The pieces of a region share its samples evenly.
    sharing = Counter(piece.region for piece, _ in reached)
    drawn = [points[: -(-samples // sharing[piece.region])] for points, (piece, _) in zip(drawn, reached, strict=True)]
    if method == "lp":
        verdicts = _by_lp(reached, scene, drawn, answer, faults)
    else:
        verdicts = _by_supports(reached, scene, drawn, answer)
    out = []
    for (piece, reach), points, safe in zip(reached, drawn, verdicts, strict=True):
        kept = points[safe & _strictly_inside(reach.set, points)]
        if len(kept):
            out.append((piece.region, kept))
    return out


def _by_supports(reached, scene: PaperScene, drawn, answer: PaperAnswer) -> list[np.ndarray]:
    """Safe or not, per piece and sample, from polygons."""
    with _timed(answer, "avoid"):
        pieces = [piece for piece, _ in reached]
        polygons = shadows(pieces, scene.grown)
        lo, hi = (np.array([getattr(reach, side)[: scene.n_p] for _, reach in reached]) for side in ("lo", "hi"))
        clear = clear_of_reach(polygons, lo, hi)
    active = scene.grown.active.T
    answer.avoid_sets += int(active.sum()) * len(reached)
    answer.avoid_empty += int((clear & active).sum())
    with _timed(answer, "check"):
        starts = np.zeros((len(reached), max(map(len, drawn)), scene.n_p))
        for i, points in enumerate(drawn):
            starts[i, : len(points)] = points[:, : scene.n_p]
        safe = (outside(polygons, starts) | ~active).all(axis=(2, 3))
        return [row[: len(points)] for row, points in zip(safe, drawn, strict=True)]


def _by_lp(reached, scene: PaperScene, drawn, answer: PaperAnswer, faults) -> list[np.ndarray]:
    """Safe or not, per piece and sample: one LP per avoid set for emptiness, one per set and sample for membership."""
    out = []
    restrict = scene.start if Fault.START_BEFORE_HULL in faults else None
    for (piece, reach), points in zip(reached, drawn, strict=True):
        with _timed(answer, "avoid"):
            kept = list(_avoid_sets(piece, reach, scene, restrict, answer, faults))
        with _timed(answer, "check"):
            out.append(np.array([_misses_all(x[: scene.n_p], kept, answer, faults) for x in points]))
    return out


def _avoid_sets(piece, reach: ReachSet, scene: PaperScene, restrict, answer, faults) -> Iterator[AHPolytope]:
    """Avoid sets of a piece that are not proved disjoint from the shadow of its Omega."""
    for t, j in zip(*np.nonzero(scene.grown.active.T), strict=True):
        avoid = avoid_set(piece, scene.grown.at(piece.bin, int(t), int(j)), int(t), restrict)
        answer.avoid_sets += 1
        if _proved(find_point(within_reach(avoid, reach.set)).status, answer, faults):
            answer.avoid_empty += 1
        else:
            yield avoid


def _misses_all(p0: np.ndarray, avoid_sets: list[AHPolytope], answer, faults) -> bool:
    return all(_proved(membership(avoid, p0).status, answer, faults) for avoid in avoid_sets)


def _proved(status: LPStatus, answer: PaperAnswer, faults) -> bool:
    """Only a proof says empty or outside, unless the fault A5 was asked for."""
    answer.unknown += status is LPStatus.UNKNOWN
    return status is LPStatus.INFEASIBLE or (status is LPStatus.UNKNOWN and Fault.TROUBLE_IS_SAFE in faults)


def _draw(key, reached, samples: int) -> np.ndarray:
    """Hit-and-run samples (r, s, n_p + n_k) of every Omega, from keys that depend on region and bin only."""
    n, height = len(reached[0][1].inner), max(len(reach.set.b) for _, reach in reached)
    height += -height % _ROW_BUCKET
    A, b = np.zeros((len(reached), height, n)), np.ones((len(reached), height))
    for i, (_, reach) in enumerate(reached):
        A[i, : len(reach.set.b)], b[i, : len(reach.set.b)] = reach.set.A, reach.set.b
    numbers = np.array([[piece.region, piece.bin] for piece, _ in reached], np.uint32)
    keys = _piece_keys(key, jnp.asarray(numbers))
    return sample_polytopes(keys, A, b, np.array([reach.inner for _, reach in reached]), samples, _THIN)


def _strictly_inside(rows: HPolytope, points: np.ndarray) -> np.ndarray:
    """Inside by more than rounding: (s,)."""
    size = np.abs(points) @ np.abs(rows.A).T + np.abs(rows.b)
    return (points @ rows.A.T + gamma(rows.n + 2) * size < rows.b).all(axis=1)


def _batches(regions: Iterable[list[Piece]], size: int) -> Iterator[list[list[Piece]]]:
    iterator = iter(regions)
    while batch := list(islice(iterator, size)):
        yield batch


class _timed:
    """Adds the wall time of a block to one part of the answer."""

    def __init__(self, answer: PaperAnswer, part: str):
        self.seconds, self.part = answer.seconds, part

    def __enter__(self):
        self.begin = time.perf_counter()

    def __exit__(self, *exception):
        self.seconds[self.part] = self.seconds.get(self.part, 0.0) + time.perf_counter() - self.begin


_piece_keys = jax.jit(
    jax.vmap(lambda key, number: jax.random.fold_in(jax.random.fold_in(key, number[0]), number[1]), in_axes=(None, 0))
)
