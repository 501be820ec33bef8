"""The published search: region by region outward, sample Omega, drop starts that lie in an avoid
set. [NP, Sec. IV] As a method of a query it is a baseline beside `parc_jax.method.Exact`.

Two interchangeable ways to decide: "lp" with AH-polytopes and one LP per question, as published,
and "supports" with the same avoid sets as polygons.
"""

import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.neuralparc.brs import ReachSet, reach_sets
from benchmarks.neuralparc.by_lp import avoid_by_lp, reach_by_lp, safe_by_lp
from benchmarks.neuralparc.by_support import outside, shadows
from benchmarks.neuralparc.cells import Cell, cells_outward, stacks
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.scene import PaperScene, Tally, paper_scene
from benchmarks.neuralparc.sets.sampling import sample_polytopes
from parc_jax.common.errors import InputError
from parc_jax.common.keys import generator
from parc_jax.common.lp.exact import gamma
from parc_jax.common.status import Ended
from parc_jax.proof.regions import regions_of
from parc_jax.safe_set.corridors.sampling import points
from parc_jax.safe_set.corridors.search import UNTIMED, Cover
from parc_jax.safe_set.corridors.stopping import nothing_covered
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene


@dataclass(frozen=True)
class Published:
    """The published search, samples only, region by region from the middle of K outward.
    [NP, Sec. IV]

    lps: decide with linear programs, as published; False does the same through support functions.
    """

    lps: bool = False

    def search(self, scene: Scene, key: jax.Array, settings: Settings) -> tuple[Cover, None]:
        """A cover without corridors, of plans that the exact verdict accepts. Consumes `key`."""
        if scene.at is not None:
            raise InputError(
                "at: expected the exact engine for plans from one place; the published search "
                "knows sets of starts only. Leave method out."
            )
        begin = time.perf_counter()
        model = scene.model
        cells = cells_outward(regions_of(model), model.tube, model.domain.center)
        method = "lp" if self.lps else "supports"
        drawn = paper_search(
            key, cells, paper_scene(scene.problem, model.tube), method=method
        ).samples
        p0, k = drawn[:, : model.n_p], drawn[:, model.n_p :]
        e = verdicts(scene, p0, k)
        safe = points(p0, k, e).at(e.safe)
        found = time.perf_counter() - begin if len(safe.k) else None
        cover = Cover(
            drawn=len(drawn),
            reaching=len(drawn),
            safe=len(safe.k),
            volume=float("nan"),
            points=safe,
            coverage=nothing_covered(settings.confidence),
            timings={**UNTIMED, "first_sample_s": found},
            ended=Ended.TARGET if len(safe.k) else Ended.WORK,
        )
        return cover.pick(generator(key), settings.samples), None


SAMPLES_PER_REGION = 50  # as published
_THIN = 16  # hit-and-run steps between samples
_TOGETHER = 256  # regions handled at once by "supports" when all are to be visited
_ROWS = 8  # rows are padded to a multiple of this


class PaperAnswer(NamedTuple):
    """Plans of the published search, safe by the region maps, read as the floats they are, inside
    the tube.

    samples: (n, n_p + n_k) starts and parameters. region: (n,) their regions. tally: counts.
    """

    samples: np.ndarray
    region: np.ndarray
    tally: Tally


def paper_search(
    key,
    regions: Iterable[list[Cell]],
    scene: PaperScene,
    *,
    method: str = "supports",
    anytime: bool = False,
    samples: int = SAMPLES_PER_REGION,
) -> PaperAnswer:
    """Safe (p0, k) of a problem by the published method. `key` is not consumed: every cell folds
    in its numbers.

    regions: cells of one region after the other, outward from a seed (`cells_outward`). method:
        "supports" or "lp".
    anytime: stop at the first region with a safe sample; else visit all.
    samples: drawn from Omega per region, evenly from its cells, by hit-and-run.
    Raises InputError.
    """
    if method not in ("supports", "lp"):
        raise InputError(f'paper_search: expected method "supports" or "lp"; got {method!r}.')
    tally = Tally()
    points, numbers = [np.zeros((0, scene.n_p + scene.n_k))], [np.zeros(0, int)]
    together = 1 if anytime or method == "lp" else _TOGETHER
    regions = iter(regions)
    while batch := list(islice(regions, together)):
        tally.regions += len(batch)
        cells = [cell for region in batch for cell in region]
        if not cells:
            continue
        search = _search_by_lp if method == "lp" else _search_by_supports
        found = search(key, cells, scene, samples, tally)
        points += [x for _, x in found]
        numbers += [np.full(len(x), number) for number, x in found]
        if anytime and any(len(x) for _, x in found):
            break
    return PaperAnswer(np.concatenate(points), np.concatenate(numbers), tally)


def _search_by_supports(
    key, cells: list[Cell], scene: PaperScene, samples: int, tally: Tally
) -> list[tuple[int, np.ndarray]]:
    """Region numbers and safe samples of the cells, many at once."""
    active, drawn = scene.grown.active.T, {}  # by cell: points, and which of them are safe
    for index, stacked in stacks(cells):  # rows behind the index are padding
        reach = reach_sets(stacked, scene.goals, scene.goal_box, scene.start, scene.n_p)
        points = _draw(key, stacked, reach, samples)
        beyond = outside(shadows(stacked, scene.grown), points[:, :, : scene.n_p])
        safe = (beyond | ~active).all(axis=(2, 3)) & _strictly_inside(reach, points)
        for row in np.flatnonzero(_live(reach, len(index), tally)):
            drawn[int(index[row])] = points[row], safe[row]
    quota = _quota(cells, sorted(drawn), samples)
    parts = {i: [part[:n] for part in drawn[i]] for i, n in quota.items()}
    return [(int(cells[i].region), points[safe]) for i, (points, safe) in parts.items()]


def _search_by_lp(
    key, cells: list[Cell], scene: PaperScene, samples: int, tally: Tally
) -> list[tuple[int, np.ndarray]]:
    """Region numbers and safe samples of the cells of one region, one LP after the other."""
    reach = [reach_by_lp(cell, scene) for cell in cells]
    live = [i for i, one in enumerate(reach) if _live(one, 1, tally)]
    quota = _quota(cells, live, samples)
    found = []
    for i in live:
        one = jax.tree.map(lambda a: np.asarray(a)[None], (cells[i], reach[i]))
        drawn = _draw(key, *one, samples)[0, : quota[i]]
        avoid_sets = avoid_by_lp(cells[i], reach[i], scene, tally)
        safe = safe_by_lp(drawn[:, : scene.n_p], avoid_sets, tally)
        safe &= _strictly_inside(reach[i], drawn)
        found.append((int(cells[i].region), drawn[safe]))
    return found


def _live(reach: ReachSet, count: int, tally: Tally) -> np.ndarray:
    """(count,) bool: Omegas with an inner point to sample from; undecided ones are counted."""
    status = np.atleast_1d(reach.status)[:count]
    tally.unknown += int((status == int(LPStatus.UNKNOWN)).sum())
    return status == int(LPStatus.FEASIBLE)


def _quota(cells: list[Cell], live: list[int], samples: int) -> dict[int, int]:
    """Samples per live cell: those of a region are shared evenly among its live cells."""
    sharing = Counter(int(cells[i].region) for i in live)
    return {i: -(-samples // sharing[int(cells[i].region)]) for i in live}


def _draw(key, cells: Cell, reach: ReachSet, samples: int) -> np.ndarray:
    """Hit-and-run samples (r, s, n_p + n_k) of stacked Omegas, from keys that depend on region and
    bin only.
    """
    fill = -reach.b.shape[1] % _ROWS
    A = np.pad(reach.A, ((0, 0), (0, fill), (0, 0)))
    b = np.pad(reach.b, ((0, 0), (0, fill)), constant_values=1.0)
    numbers = np.stack([cells.region, cells.bin], axis=1)
    keys = _cell_keys(key, jnp.asarray(numbers, jnp.uint32))
    return sample_polytopes(keys, A, b, np.nan_to_num(reach.inner), samples, _THIN)


def _strictly_inside(reach: ReachSet, points: np.ndarray) -> np.ndarray:
    """Which points (..., s, n) satisfy the rows of Omega by more than rounding: (..., s)."""
    rows = np.swapaxes(reach.A, -1, -2)
    b = reach.b[..., None, :]
    slack = gamma(points.shape[-1] + 2) * (np.abs(points) @ np.abs(rows) + np.abs(b))
    return (points @ rows + slack < b).all(axis=-1)


# keys (r,) of cells, from their numbers (r, 2) of region and bin
_cell_keys = jax.jit(
    jax.vmap(lambda key, n: jax.random.fold_in(jax.random.fold_in(key, n[0]), n[1]), (None, 0))
)
