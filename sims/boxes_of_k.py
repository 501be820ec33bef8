"""Search for boxes of K where plans are safe, or nearly so. Nothing is proved or claimed. [T24]

Plans of a model are ranked by the least margin of the verdict, which is negative where a plan is
not safe. A few runs on each of some small boxes (pilot samples) are scored by the margin that they
leave when all plans of a box are meant to end at one place and an affine map of k says from where
each starts.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common.arrays import map_rows
from parc_jax.common.climb import Ranked, climb, ranked
from parc_jax.common.keys import Stage
from parc_jax.common.sets.box import Box
from parc_jax.common.shapes import Path, State, Vector
from parc_jax.drive.local.safe_box import box_around
from parc_jax.learning.bound.declared import stand_in
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import moved_to
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.joined import concatenate
from parc_jax.learning.system import System
from parc_jax.safe_set.verdict.pointwise import anchor, clearance, paths_of, row_margin, verdicts
from parc_jax.safe_set.verdict.scene import Scene

DRAWS = 1024  # uniform plans of the first round
CHILDREN = 512  # of all parents together, every round
PARENTS = 16
SPREADS = np.cumprod([0.2, *[0.65] * 7])  # [sides of the boxes of k and of ends] of the children
RANKED = 256  # plans that stay from round to round

GROWTH = 1.25  # [1] errors of many runs, over those of a pilot sample
CHUNK = 512  # runs from one start each, per compiled call
CENTRES = 64  # of smaller boxes that are tried in a pilot sample
ENOUGH = 3  # [parameters of an affine map] runs that a smaller box must hold to be scored
ENDS = 12  # places to end that are tried, every round
SPREAD = 0.06  # [sides of the box of ends] of the first of them about the given one
FEW = 32  # runs that score a place to end, before all of them do


def under(scene: Scene, model: TrajectoryModel) -> Scene:
    """The same arrays with another model of the same layout: to rank plans. The slack is that of
    the first model, so a "safe" of this scene is no verdict.
    """
    return scene.replace(nominal=replace(scene.nominal, model=model))


def rank_plans(
    scene: Scene, rng: np.random.Generator, part: float = 1.0, spacing: float = 0.0
) -> Ranked:
    """Search for the plans (p0, k) of a model with the largest margins: uniform draws, then rounds
    ever closer to the best.

    part: of the tube under which they are scored, 0 for the model alone.
    spacing: [sides of K] least distance of the plans around which the next are drawn, so that
    several places of K are searched.
    """
    model = scene.model
    scored_by = scene
    if part != 1.0:  # of which nothing is claimed; a bin without claim stays without one
        claim = stand_in(model.claim, scaled_tube(model.tube, part))
        scored_by = under(scene, model.replace(claim=claim))
    lo, hi = model.domain.lo, model.domain.hi
    k = rng.uniform(lo, hi, (DRAWS, model.n_k))
    z = rng.uniform(scene.z_lo, scene.z_hi, (DRAWS, model.n_p))
    first = rank_given(scored_by, anchor(scene, z, k)[0], k)

    def closer(best: Ranked, spread: float) -> tuple[np.ndarray, np.ndarray]:
        p0, k = best.x
        if not len(k):
            return p0, k
        chosen = rng.choice(spaced(k, model.domain, PARENTS, spacing), CHILDREN)
        ends = paths_of(model, p0[chosen], k[chosen])[:, -1, : model.n_p]
        move_k = spread * (hi - lo) * rng.uniform(-1, 1, (CHILDREN, model.n_k))
        near_k = np.clip(k[chosen] + move_k, lo, hi)
        near_z = ends + spread * (scene.z_hi - scene.z_lo) * rng.uniform(-1, 1, ends.shape)
        return anchor(scene, near_z, near_k)[0], near_k

    return climb(first, closer, lambda x: verdicts(scored_by, *x).room, SPREADS, RANKED)


def rank_given(scene: Scene, p0: np.ndarray, k: np.ndarray) -> Ranked:
    """The best of the plans p0 (n, n_p), k (n, n_k), with the least margin of each."""
    margin = verdicts(scene, p0, k).room
    return ranked((p0, k), margin).at(slice(min(RANKED, int((margin > -np.inf).sum()))))


def spaced(k: np.ndarray, domain: Box, most: int, spacing: float) -> np.ndarray:
    """Indices (m,) into k (n, n_k), best first: each at least `spacing` [sides of the domain] from
    the better ones, at most `most` of them.
    """
    side = domain.hi - domain.lo
    chosen: list[int] = []
    for number, values in enumerate(k):
        if all(np.abs((values - k[other]) / side).max() >= spacing for other in chosen):
            chosen.append(number)
        if len(chosen) == most:
            break
    return np.array(chosen, int)


def scaled_tube(tube: Tube, part: float) -> Tube:
    """The tube with a part of its half widths; infinite ones, of a bin without claim, stay."""
    halves = (np.where(np.isinf(half), half, part * half) for half in tube.halves)
    return tube.with_halves(*halves)


class Aim(NamedTuple):
    """A box of K for a pilot sample, and the end (n_p,) of its plans."""

    box: Box
    end: np.ndarray


class PilotSample(NamedTuple):
    """A few runs on a box of K. end (n_p,): of its plans. margin: [m, .] least one of all runs.
    scatter: [m, .] largest half width of their ends about an affine map of k.
    """

    box: Box
    end: np.ndarray
    runs: RolloutBatch
    margin: float
    scatter: float

    @property
    def score(self) -> float:
        """The margin that is left when errors grow as those of many runs do; larger is better."""
        return self.margin - (GROWTH - 1) * self.scatter


def pilot_samples(
    system: System,
    scene: Scene,
    aims: Sequence[Aim],
    runs: int,
    key: jax.Array,
    rng: np.random.Generator,
) -> list[PilotSample]:
    """Make runs on each box, the best first; boxes with too few finite runs are left out."""
    n_k = aims[0].box.n
    k = np.concatenate([rng.uniform(aim.box.lo, aim.box.hi, (runs, n_k)) for aim in aims])
    batch = concatenate(stream_rollouts(system, key, len(k), Stage.SEARCH, k=k, quiet=True))
    samples = []
    for number, aim in enumerate(aims):
        rows = slice(number * runs, (number + 1) * runs)
        on_box = replace(batch.select(rows), domain=aim.box).finite
        if on_box.n >= ENOUGH * (n_k + 1):
            samples.append(_pilot_sample(scene, aim, on_box, rng))
    return sorted(samples, key=lambda sample: sample.score, reverse=True)


def _pilot_sample(
    scene: Scene, aim: Aim, runs: RolloutBatch, rng: np.random.Generator
) -> PilotSample:
    """The sample of a box, its end moved to where the runs have the largest margin."""
    ends, n_p = _ends(runs), len(aim.end)
    left = _residuals(runs.k, ends)
    starts = (left - ends)[:, :n_p]  # of plans that end at the origin
    size, few = scene.z_hi - scene.z_lo, slice(FEW)

    def closer(best: Ranked, spread: float) -> np.ndarray:
        return np.concatenate([best.x, best.x + spread * size * rng.uniform(-1, 1, (ENDS, n_p))])

    end = aim.end
    # where a box is still so large that runs jump, a few of them predict nothing of the others:
    # first their median decides, then the least
    for worth, spreads in ((np.median, (1, 1 / 2)), (np.min, (1 / 4, 1 / 8))):

        def value(ends: np.ndarray, worth: Callable = worth) -> np.ndarray:
            margins = margins_of(scene, runs.select(few), ends[:, None] + starts[few])
            return worth(margins, axis=1)

        begin = Ranked(end[None], np.array([-np.inf]))
        end = climb(begin, closer, value, SPREAD * np.array(spreads), kept=1).x[0]
    margin = float(margins_of(scene, runs, end[None, None] + starts).min())
    return PilotSample(aim.box, end, runs, margin, _half_width(left))


def smaller_boxes(
    sample: PilotSample, scene: Scene, part: float, rng: np.random.Generator
) -> list[tuple[float, Aim]]:
    """Boxes of a part of the volume of a pilot sample's, spaced, each with the margin that its runs
    promise there: of the run with the least, less the scatter. The best first.

    They are smaller along all axes by one factor, or along one axis: a robot may jump along one
    parameter and hardly feel another.
    """
    whole, n, n_p = sample.box, sample.box.n, len(sample.end)
    shapes = [np.full(n, part ** (1 / n)), *np.where(np.eye(n) > 0, part, 1.0)]
    k, ends = sample.runs.k, _ends(sample.runs)
    spread = np.repeat([SPREAD / 2, SPREAD / 8], ENDS)[:, None]
    moves = spread * (scene.z_hi - scene.z_lo) * rng.uniform(-1, 1, (2 * ENDS, n_p))
    tried = sample.end + np.concatenate([np.zeros((1, n_p)), moves])
    margins = margins_of(scene, sample.runs, tried[:, None] - ends[:, :n_p])
    boxes = []
    for shape in shapes:
        for centre in k[rng.permutation(len(k))[:CENTRES]]:
            box = box_around(centre, shape, whole)
            inside = box.contains(k)
            if inside.sum() >= ENOUGH * (n + 1):
                least = margins[:, inside].min(axis=1)
                scatter = _half_width(_residuals(k[inside], ends[inside]))
                boxes.append((least.max() - scatter, Aim(box, tried[least.argmax()])))
    boxes.sort(key=lambda one: one[0], reverse=True)
    chosen: list[tuple[float, Aim]] = []
    for value, aim in boxes:
        far = [np.abs(aim.box.center - other.box.center) for _, other in chosen]
        if all((gap / (whole.hi - whole.lo)).max() >= part / 2 for gap in far):
            chosen.append((value, aim))
    return chosen


def margins_of(scene: Scene, runs: RolloutBatch, p0: np.ndarray) -> np.ndarray:
    """Least margins (m, n) of n runs from starts p0 (m, n, n_p), as they ran: straight between
    knots, in a tube that holds the bends.
    """
    stride, n = runs.time.stride, runs.n
    path = np.asarray(runs.p[:, ::stride], np.float64)
    # half widths by which runs leave the straight line between knots
    steps = np.asarray(runs.p[:, :-1], np.float64).reshape(n, path.shape[1] - 1, stride, -1)
    share = (np.arange(stride) / stride)[:, None]
    straight = path[:, :-1, None] * (1 - share) + path[:, 1:, None] * share
    bend = np.abs(steps - straight).max(axis=2).reshape(n, path.shape[1] - 1, -1, runs.n_p)
    which, arrays = np.tile(np.arange(n), len(p0)), scene.arrays
    margins = map_rows(
        CHUNK,
        lambda start, run: _margins(arrays, start, path[run], bend[run], runs.q[run]),
        p0.reshape(len(which), -1),
        which,
    )
    return margins.reshape(len(p0), n)


@jax.jit
@partial(jax.vmap, in_axes=(None, 0, 0, 0, 0))
def _margins(
    scene: Scene, p0: Vector, path: Path, bend: Float[ArrayLike, "intervals n_points n_p"], q: State
):
    """Least margin of one run: its path about the start, half widths bend around it. Kernel."""
    moved = moved_to(p0, path)
    end = jnp.concatenate([moved[-1], q])
    goal = row_margin(scene.goal_A, scene.goal_b, end, scene.slack)
    start = row_margin(scene.start_A, scene.start_b, p0, scene.slack)
    return jnp.minimum(jnp.minimum(goal, start), clearance(scene, moved, ErrorBox(bend)))


def _ends(runs: RolloutBatch) -> np.ndarray:
    """(n, n_c + n_q) ends of runs."""
    last = np.asarray(runs.p[:, -1], np.float64).reshape(runs.n, -1)
    return np.concatenate([last, np.asarray(runs.q, np.float64)], axis=1)


def _residuals(k: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """(n, m) ends (n, m) less their affine map of k (n, n_k)."""
    columns = np.concatenate([np.ones((len(k), 1)), k - k.mean(axis=0)], axis=1)
    return ends - columns @ np.linalg.lstsq(columns, ends, rcond=None)[0]


def _half_width(left: np.ndarray) -> float:
    return float((left.max(axis=0) - left.min(axis=0)).max() / 2)
