"""The published search: region by region outward, sample Omega, drop starts that lie in an avoid set. [NP Sec. IV]

Two interchangeable ways to decide: "lp" with AH-polytopes and one LP per question, as published, and "supports" with
the same avoid sets as polygons. Faults of published code (`Fault`) are not repeated; for parity they can be asked for
by name, and then the answer says "assumed".
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.avoid.paper_lp import Fault, avoid_by_lp, reach_by_lp, safe_by_lp
from parc_jax.avoid.paper_scene import PaperScene
from parc_jax.avoid.shadow import clear_of_reach, outside, shadows
from parc_jax.avoid.tally import Tally
from parc_jax.errors import InputError
from parc_jax.lp.status import LPStatus
from parc_jax.lp.witness import gamma
from parc_jax.reach.brs import ReachSet, reach_sets
from parc_jax.reach.pieces import Piece, stacks
from parc_jax.sets.hit_and_run import sample_polytopes

SAMPLES_PER_REGION = 50  # as published
_THIN = 16  # hit-and-run steps between samples
_TOGETHER = 256  # regions handled at once by "supports" when all are to be visited
_ROWS = 8  # rows are padded to a multiple of this


@dataclass(frozen=True)
class PaperAnswer:
    """What the published search found.

    samples: (n, n_p + n_k) starts and parameters, safe for the model inside the tube. region: (n,) their regions.
    label: "model" (safe by the region maps, read as the floats they are) or "assumed" (a fault was asked for).
    tally: counts and times.
    """

    samples: np.ndarray
    region: np.ndarray
    label: str
    tally: Tally


def paper_search(
    key, regions: Iterable[list[Piece]], scene: PaperScene, *,
    method: str = "supports", anytime: bool = False, samples: int = SAMPLES_PER_REGION,
    faults: frozenset[Fault] = frozenset(),
) -> PaperAnswer:  # fmt: skip
    """Safe (p0, k) of a problem by the published method. `key` is not consumed: every piece folds in its own numbers.

    regions: pieces of one region after the other, outward from a seed (`pieces_outward`). method: "supports" or "lp".
    anytime: stop at the first region with a safe sample; else visit all. samples: drawn from Omega per region, evenly
    from its pieces, by hit-and-run. faults: only with "lp". Raises InputError.
    """
    if method not in ("supports", "lp"):
        raise InputError(f'paper_search: expected method "supports" or "lp"; got {method!r}.')
    if faults and method != "lp":
        raise InputError('paper_search: faults of the published code exist only in method "lp".')
    tally, points, numbers = Tally(), [np.zeros((0, scene.n_p + scene.n_k))], [np.zeros(0, int)]
    for batch in _batches(regions, 1 if anytime or method == "lp" else _TOGETHER):
        tally.regions += len(batch)
        pieces = [piece for region in batch for piece in region]
        if not pieces:
            continue
        if method == "lp":
            kept = _search_by_lp(key, pieces, scene, samples, faults, tally)
        else:
            kept = _search_by_supports(key, pieces, scene, samples, tally)
        points += [x for _, x in kept]
        numbers += [np.full(len(x), number) for number, x in kept]
        if anytime and any(len(x) for _, x in kept):
            break
    label = "assumed" if faults else "model"
    return PaperAnswer(np.concatenate(points), np.concatenate(numbers), label, tally)


def _search_by_supports(key, pieces, scene: PaperScene, samples: int, tally: Tally) -> list[tuple[int, np.ndarray]]:
    """Region numbers and safe samples of the pieces, many at once."""
    live, drawn, safe, active = [], {}, {}, scene.grown.active.T
    for index, stacked in stacks(pieces):
        with tally.timed("reach"):
            reach = reach_sets(stacked, scene.goals, scene.goal_box, scene.start, scene.n_p)
        inner = np.flatnonzero(_live(reach, len(index), tally))
        with tally.timed("avoid"):
            polygons = shadows(stacked, scene.grown)
            clear = clear_of_reach(polygons, reach.lo[:, : scene.n_p], reach.hi[:, : scene.n_p])
        tally.avoid_sets += int(active.sum()) * len(inner)
        tally.avoid_empty += int((clear[inner] & active).sum())
        with tally.timed("samples"):
            points = _draw(key, stacked, reach, samples)
        with tally.timed("check"):
            fine = (outside(polygons, points[:, :, : scene.n_p]) | ~active).all(axis=(2, 3))
            fine &= _strictly_inside(reach, points)
        live += index[inner].tolist()
        drawn |= dict(zip(index.tolist(), points, strict=False))  # the padding beyond `index` is left out
        safe |= dict(zip(index.tolist(), fine, strict=False))
    live.sort()
    quota = _quota(pieces, live, samples)
    tally.reachable += len({int(pieces[i].region) for i in live})
    return [(int(pieces[i].region), drawn[i][: quota[i]][safe[i][: quota[i]]]) for i in live]


def _search_by_lp(key, pieces, scene, samples: int, faults, tally: Tally) -> list[tuple[int, np.ndarray]]:
    """Region numbers and safe samples of the pieces of one region, one LP after the other."""
    with tally.timed("reach"):
        reach = [reach_by_lp(piece, scene) for piece in pieces]
    live = [i for i, one in enumerate(reach) if _live(one, 1, tally)]
    tally.reachable += bool(live)
    quota, out = _quota(pieces, live, samples), []
    for i in live:
        with tally.timed("samples"):
            one = jax.tree.map(lambda a: np.asarray(a)[None], (pieces[i], reach[i]))
            drawn = _draw(key, *one, samples)[0, : quota[i]]
        with tally.timed("avoid"):
            avoid_sets = avoid_by_lp(pieces[i], reach[i], scene, faults, tally)
        with tally.timed("check"):
            safe = safe_by_lp(drawn[:, : scene.n_p], avoid_sets, faults, tally) & _strictly_inside(reach[i], drawn)
        out.append((int(pieces[i].region), drawn[safe]))
    return out


def _live(reach: ReachSet, count: int, tally: Tally) -> np.ndarray:
    """Which of the first `count` Omegas have an inner point to sample from; undecided ones are counted only."""
    status = np.atleast_1d(reach.status)[:count]
    tally.unknown += int((status == int(LPStatus.UNKNOWN)).sum())
    return status == int(LPStatus.FEASIBLE)


def _quota(pieces: list[Piece], live: list[int], samples: int) -> dict[int, int]:
    """Samples per live piece: those of a region are shared evenly among its live pieces."""
    sharing = Counter(int(pieces[i].region) for i in live)
    return {i: -(-samples // sharing[int(pieces[i].region)]) for i in live}


def _draw(key, pieces: Piece, reach: ReachSet, samples: int) -> np.ndarray:
    """Hit-and-run samples (r, s, n_p + n_k) of stacked Omegas, from keys that depend on region and bin only."""
    fill = -reach.b.shape[1] % _ROWS
    A, b = np.pad(reach.A, ((0, 0), (0, fill), (0, 0))), np.pad(reach.b, ((0, 0), (0, fill)), constant_values=1.0)
    keys = _piece_keys(key, jnp.asarray(np.stack([pieces.region, pieces.bin], axis=1), jnp.uint32))
    return sample_polytopes(keys, A, b, np.nan_to_num(reach.inner), samples, _THIN)


def _strictly_inside(reach: ReachSet, points: np.ndarray) -> np.ndarray:
    """Which points (..., s, n) satisfy the rows of Omega by more than rounding: (..., s)."""
    rows, b = np.swapaxes(reach.A, -1, -2), reach.b[..., None, :]
    slack = gamma(points.shape[-1] + 2) * (np.abs(points) @ np.abs(rows) + np.abs(b))
    return (points @ rows + slack < b).all(axis=-1)


def _batches(regions: Iterable[list[Piece]], size: int) -> Iterator[list[list[Piece]]]:
    iterator = iter(regions)
    while batch := list(islice(iterator, size)):
        yield batch


_piece_keys = jax.jit(
    jax.vmap(lambda key, number: jax.random.fold_in(jax.random.fold_in(key, number[0]), number[1]), in_axes=(None, 0))
)
