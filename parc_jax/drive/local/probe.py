"""Probes: a few runs on each of some small boxes of K, and how nearly all of them would be safe.

Nothing is claimed of one. Its score is the room that its runs leave, when the plan is meant to end
at one place and an affine map of k says from where it starts. [T24]
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common.arrays import map_rows
from parc_jax.common.climb import Ranked, climb
from parc_jax.common.keys import Stage
from parc_jax.common.sets.box import Box
from parc_jax.common.shapes import Path, State, Vector
from parc_jax.drive.local.safe_box import box_around
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.network.predict import moved_to
from parc_jax.learning.runs.batch import RolloutBatch, concatenate
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.system import System
from parc_jax.safe_set.verdict.pointwise import clearance, row_margin
from parc_jax.safe_set.verdict.scene import Scene

MANY = 1.25  # [1] errors of many runs, over those of a few
CHUNK = 512  # runs from one start each, per compiled call
TRIED = 64  # places of a box that are looked at for smaller boxes
ENOUGH = 3  # [parameters of an affine map] runs that such a box must hold to be judged
ENDS = 12  # places to end that are tried, every round
SPREAD = 0.06  # [sides of the box of ends] of the first of them about the given one
FEW = 32  # runs that judge a place to end, before all of them do


class Probe(NamedTuple):
    """A box of K and what a few runs on it promise. end: (n_p,) where its plans are meant to end.
    room: [m, .] least margin of all its runs. unrest: [m, .] largest half width of their ends about
    an affine map of k.
    """

    box: Box
    end: np.ndarray
    runs: RolloutBatch
    room: float
    unrest: float

    @property
    def score(self) -> float:
        """Room that is left when errors grow as those of many runs do; larger is better."""
        return self.room - (MANY - 1) * self.unrest


class Aim(NamedTuple):
    """A box of K to probe, and where its plans are meant to end (n_p,)."""

    box: Box
    end: np.ndarray


def probes(
    system: System,
    scene: Scene,
    places: Sequence[Aim],
    runs: int,
    key: jax.Array,
    rng: np.random.Generator,
) -> list[Probe]:
    """A probe of every place, the best first; boxes with too few finite runs are left out."""
    n_k = places[0].box.n
    k = np.concatenate([rng.uniform(at.box.lo, at.box.hi, (runs, n_k)) for at in places])
    seen = concatenate(stream_rollouts(system, key, len(k), Stage.SEARCH, k=k, quiet=True))
    found = []
    for number, at in enumerate(places):
        own = replace(seen.select(slice(number * runs, (number + 1) * runs)), domain=at.box)
        own = own.finite
        if own.n >= ENOUGH * (n_k + 1):
            found.append(_probe(scene, at, own, rng))
    return sorted(found, key=lambda probe: probe.score, reverse=True)


def _probe(scene: Scene, at: Aim, runs: RolloutBatch, rng: np.random.Generator) -> Probe:
    """The probe of a place, its end moved to where the runs have most room."""
    ends = _ends(runs)
    left = _left(runs.k, ends)
    starts = left[:, : len(at.end)] - ends[:, : len(at.end)]  # of plans meant to end at the origin
    size = scene.z_hi - scene.z_lo
    few = slice(FEW)

    def closer(best: Ranked, spread: float) -> np.ndarray:
        moves = spread * size * rng.uniform(-1, 1, (ENDS, len(at.end)))
        return np.concatenate([best.x, best.x + moves])

    def rooms(ends: np.ndarray) -> np.ndarray:
        return rooms_of(scene, runs.select(few), ends[:, None] + starts[few])

    end = at.end
    # where a box is still so large that runs jump, a few of them tell nothing of the others
    for worth, spreads in ((np.median, (1, 1 / 2)), (np.min, (1 / 4, 1 / 8))):
        begin = Ranked(end[None], np.array([-np.inf]))
        value = lambda ends: worth(rooms(ends), axis=1)  # noqa: B023, E731
        end = climb(begin, closer, value, SPREAD * np.array(spreads), kept=1).x[0]
    room = float(rooms_of(scene, runs, end[None, None] + starts).min())
    return Probe(at.box, end, runs, room, _half_width(left))


def inside(
    probe: Probe, scene: Scene, part: float, rng: np.random.Generator
) -> list[tuple[float, Aim]]:
    """Places whose boxes are a part of that of a probe each, with what its runs promise there: the
    room of the run that has least, less the half width of the ends about an affine map of k. The
    best first, apart from each other.

    The boxes are smaller along all axes alike, or along one alone: a robot may jump along one
    parameter and hardly feel another.
    """
    whole = probe.box
    n = whole.n
    shapes = [np.full(n, part ** (1 / n)), *np.where(np.eye(n) > 0, part, 1.0)]
    k, ends = probe.runs.k, _ends(probe.runs)
    n_p = len(probe.end)
    size = scene.z_hi - scene.z_lo
    spread = np.repeat([SPREAD / 2, SPREAD / 8], ENDS)[:, None]
    moves = spread * size * rng.uniform(-1, 1, (2 * ENDS, n_p))
    tried = probe.end + np.concatenate([np.zeros((1, n_p)), moves])
    rooms = rooms_of(scene, probe.runs, tried[:, None] - ends[:, :n_p])
    found = []
    for shape in shapes:
        for centre in k[rng.permutation(len(k))[:TRIED]]:
            box = box_around(centre, shape, whole)
            held = ((box.lo <= k) & (k <= box.hi)).all(axis=1)
            if held.sum() >= ENOUGH * (n + 1):
                least = rooms[:, held].min(axis=1)
                unrest = _half_width(_left(k[held], ends[held]))
                found.append((least.max() - unrest, Aim(box, tried[least.argmax()])))
    found.sort(key=lambda one: one[0], reverse=True)
    chosen: list[tuple[float, Aim]] = []
    for value, place in found:
        far = [np.abs(place.box.center - other.box.center) for _, other in chosen]
        if all((gap / (whole.hi - whole.lo)).max() >= part / 2 for gap in far):
            chosen.append((value, place))
    return chosen


def rooms_of(scene: Scene, runs: RolloutBatch, p0: np.ndarray) -> np.ndarray:
    """(m, n) least margins of n runs from starts p0 (m, n, n_p), as they ran: straight between
    knots, in a tube that holds what bends there.
    """
    path = np.asarray(runs.p[:, :: runs.time.stride], np.float64)
    bent = _bent(runs, path)
    which = np.tile(np.arange(runs.n), len(p0))
    arrays = scene.arrays
    found = map_rows(
        CHUNK,
        lambda start, run: _rooms(arrays, start, path[run], bent[run], runs.q[run]),
        p0.reshape(len(which), -1),
        which,
    )
    return found.reshape(len(p0), runs.n)


def _bent(runs: RolloutBatch, path: np.ndarray) -> np.ndarray:
    """(n, T, n_points, n_p) half widths of what runs leave the straight line between knots by."""
    n, knots, n_c = path.shape
    stride = runs.time.stride
    steps = np.asarray(runs.p[:, :-1], np.float64).reshape(n, knots - 1, stride, n_c)
    share = (np.arange(stride) / stride)[:, None]
    straight = path[:, :-1, None] * (1 - share) + path[:, 1:, None] * share
    return np.abs(steps - straight).max(axis=2).reshape(n, knots - 1, -1, runs.n_p)


def _room(
    scene: Scene, p0: Vector, path: Path, bent: Float[ArrayLike, "intervals n_points n_p"], q: State
):
    """Least margin of one run: its path about the start, half widths bent around it. Kernel."""
    moved = moved_to(p0, path)
    end = jnp.concatenate([moved[-1], q])
    goal = row_margin(scene.goal_A, scene.goal_b, end, scene.slack)
    start = row_margin(scene.start_A, scene.start_b, p0, scene.slack)
    return jnp.minimum(jnp.minimum(goal, start), clearance(scene, moved, ErrorBox(bent)))


_rooms = jax.jit(jax.vmap(_room, in_axes=(None, 0, 0, 0, 0)))


def _ends(runs: RolloutBatch) -> np.ndarray:
    """(n, n_c + n_q) where runs end."""
    last = np.asarray(runs.p[:, -1], np.float64).reshape(runs.n, -1)
    return np.concatenate([last, np.asarray(runs.q, np.float64)], axis=1)


def _left(k: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """(n, m) what an affine map of k (n, n_k) leaves of ends (n, m)."""
    columns = np.concatenate([np.ones((len(k), 1)), k - k.mean(axis=0)], axis=1)
    return ends - columns @ np.linalg.lstsq(columns, ends, rcond=None)[0]


def _half_width(left: np.ndarray) -> float:
    return float((left.max(axis=0) - left.min(axis=0)).max() / 2)
