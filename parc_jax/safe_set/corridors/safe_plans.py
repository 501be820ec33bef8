"""The plans that satisfy one of some corridors: membership, uniform samples, share of K, the best.

No region and no polytope is needed, so this is as cheap for many parameters as for two: rejection
from draws that are uniform over all that could reach the goal.
"""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common.arrays import as_float64, slices, x64
from parc_jax.common.climb import Ranked, climb, ranked
from parc_jax.common.errors import InputError, reading
from parc_jax.learning.bound.counts import least_probability
from parc_jax.learning.model import TrajectoryModel
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.sampling import (
    FIRST_DRAW,
    HOPELESS,
    LARGEST_DRAW,
    Counts,
    Place,
    Points,
    draw,
    ends_from,
    points,
    safe_ones,
)
from parc_jax.safe_set.verdict.pointwise import paths_of, predictions, verdicts
from parc_jax.safe_set.verdict.scene import Scene, unpruned_scene

NEIGHBOURS = 7  # plans near a k whose ends `share_of_k` tries
DRAWS = 2048  # first look over the whole set
KEPT = 4  # plans around which the closer search draws: of these, then the best so far
EACH = 128  # draws of a round around one of them: all together fill one compiled verdict
# [ways between two plans] each round draws closer to the best
SPREADS = np.cumprod(np.full(25, 0.75))

NAMED = ("clearance", "room")
Objective = str | Sequence[float] | np.ndarray | Callable
ENDS = 400  # drawn predicted ends that a start of one k is looked for among
PREDICTED = 4096  # plans whose paths are held at a time
ROWS = 100  # k whose starts are judged together, for memory


class SafePlans:
    """All safe plans that satisfy a corridor; within a place, where the search was within one."""

    def __init__(self, scene: Scene, corridors: Corridors, within: Place | None):
        self.model = scene.model
        self.scene = scene
        self.corridors = corridors
        self.within = within

    @property
    def inner(self) -> np.ndarray:
        """(m, n_p + n_k) the plan of each corridor."""
        none = np.zeros((0, self.model.n_p + self.model.n_k))
        return np.vstack([none, *(np.concatenate([c.p0, c.k]) for c in self.corridors.all)])

    def has(self, safe: Points) -> np.ndarray:
        """(b,) bool: which of some plans that reach the goal satisfy a corridor."""
        return self.corridors.first(safe.path, safe.bin) >= 0

    def contains(self, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
        """(b,) bool: which plans p0 (b, n_p), k (b, n_k) are shown safe by a corridor. [T27]"""
        return members(self.scene, self.has, p0, k)

    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """n plans (n, n_p + n_k), uniform over the set, by rejection from `draw`."""
        if not len(self.corridors):
            raise InputError("sample: expected an answer with corridors; this one has none.")
        tally = Counts()
        parts = [self.inner[:0]]
        left = n
        while left > 0:
            size = 1.2 * left * tally.drawn / max(n - left, 1)
            some = int(np.clip(size, FIRST_DRAW, LARGEST_DRAW))
            one = draw(self.scene, rng, some, self.within)
            held = self.has(one.safe)  # paths are large, and not copied
            parts.append(np.concatenate([one.safe.p0[held], one.safe.k[held]], axis=1))
            tally = tally.plus(one)
            left -= len(parts[-1])
            if left == n and tally.drawn >= HOPELESS:
                raise InputError(
                    f"sample: expected a set that one of {HOPELESS:,} draws meets; this one is too "
                    "small. Use `samples`, or sample from `answer.polytopes(key)`."
                )
        return np.concatenate(parts)[:n]

    def starts(self, rng: np.random.Generator, k: np.ndarray, most: int = 1) -> list[np.ndarray]:
        """For each k (b, n_k) at most so many starts (m, n_p) that the set has for it, the first
        ones among ENDS drawn: each uniform over all of them.
        """
        found = []
        for rows in slices(len(k), ROWS):
            p0 = starts_of_ends(self.scene, rng, k[rows])
            n, ends, n_p = p0.shape
            held = self.contains(p0.reshape(-1, n_p), np.repeat(k[rows], ends, axis=0))
            found += [p0[i, row][:most] for i, row in enumerate(held.reshape(n, ends))]
        return found

    def share_of_k(self, n: int = 20_000) -> float:
        """Lower 99.9 % confidence bound of the share of K that has a safe start in the set, by n
        draws of k that are always the same.

        A k counts when a start in the set leads to an end drawn for it, or to one of the ends of
        plans in the set with k near it. Sufficient, so the share is never too large.
        """
        from scipy.spatial import cKDTree  # heavy to load, and seldom needed

        if not len(self.inner):
            return 0.0
        scene, model, rng = self.scene, self.model, np.random.default_rng(0)
        lo, hi = model.domain.lo, model.domain.hi
        sides = np.where(hi > lo, hi - lo, 1.0)
        k, hit = rng.uniform(lo, hi, (n, model.n_k)), np.zeros(n, bool)

        def look(rows: np.ndarray, ends: np.ndarray) -> None:
            screened, safe = safe_ones(scene, ends, k[rows])
            hit[rows[screened.row]] = self.has(safe)

        z_lo, z_hi, at = scene.z_lo, scene.z_hi, scene.at
        ends = rng.uniform(z_lo, z_hi, (n, len(z_lo))) if at is None else ends_from(at, model, k)
        look(np.arange(n), ends)
        if at is None:
            p0, of = np.split(self.inner, [model.n_p], axis=1)
            ends = np.concatenate([paths_of(model, p0, of)[:, -1, : model.n_p], ends[hit]])
            tree, rows = cKDTree(np.concatenate([of, k[hit]]) / sides), np.flatnonzero(~hit)
            some = range(1, 1 + min(NEIGHBOURS, len(ends)))
            for near in tree.query(k[rows] / sides, some)[1].T:
                left = ~hit[rows]
                look(rows[left], ends[near[left]])
        return least_probability(int(hit.sum()), n, 0.001)


def starts_of_ends(scene: Scene, rng: np.random.Generator, k: np.ndarray) -> np.ndarray:
    """(b, ends, n_p) starts from which k (b, n_k) leads to ENDS ends, uniform over the goal's box;
    or the only start of the scene.
    """
    model = scene.model
    if scene.at is not None:
        return np.broadcast_to(scene.at, (len(k), 1, model.n_p))
    ends = rng.uniform(scene.z_lo, scene.z_hi, (len(k), ENDS, model.n_p))
    return ends - ends_from(0.0, model, k)[:, None]


def members(
    scene: Scene, has: Callable[[Points], np.ndarray], p0: np.ndarray, k: np.ndarray
) -> np.ndarray:
    """(b,) bool: which plans reach the goal for all errors of the tube and are in a set. [T27]

    has: membership of plans that reach; the corridor that holds one shows that it touches nothing,
    so no distance is measured.
    """
    out = np.zeros(len(k), bool)
    for rows in slices(len(k), PREDICTED):
        e = predictions(scene, p0[rows], k[rows])
        reach = e.reaches
        held = has(points(p0[rows], k[rows], e).at(reach))
        out[rows.start + np.flatnonzero(reach)] = held
    return out if scene.at is None else out & (p0 == scene.at).all(axis=1)


def as_plans(
    name: str, model: TrajectoryModel, p0: object, k: object
) -> tuple[np.ndarray, np.ndarray]:
    """Starts p0 (b, n_p) and parameters k (b, n_k) as float64 arrays; one plan becomes a batch.

    name: of the caller. Raises InputError for other shapes.
    """
    with reading(name, "numbers"):
        p0, k = np.atleast_2d(np.asarray(p0, float)), np.atleast_2d(np.asarray(k, float))
    if p0.shape[1:] != (model.n_p,) or k.shape != (len(p0), model.n_k):
        raise InputError(
            f"{name}: expected p0 (b, {model.n_p}) and k (b, {model.n_k}); got "
            f"{p0.shape}, {k.shape}."
        )
    return p0, k


def best_plan(
    plans: SafePlans, objective: Objective, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    """Plan (n_p + n_k,) of a safe set with the largest objective found, and its value.

    objective: as of `Answer.best`. Raises InputError.
    """
    value, n_p = _value(plans, objective), plans.model.n_p
    try:
        drawn = plans.sample(rng, DRAWS)
    except InputError:  # too small a set for draws: those that it is known by
        drawn = plans.inner
        if not len(drawn):
            raise
    starts = ranked(drawn, value(drawn)).at(slice(KEPT))

    def closer(best: Ranked, spread: float) -> np.ndarray:
        # ways from one drawn plan to another fit the set as a whole
        a, b = rng.integers(0, len(drawn), (2, len(best.x), EACH))
        x = (best.x[:, None] + spread * (drawn[a] - drawn[b])).reshape(-1, drawn.shape[1])
        return x[plans.contains(x[:, :n_p], x[:, n_p:])]

    best = climb(starts, closer, value, SPREADS, KEPT)
    if not np.isfinite(best.value[0]):
        so = "" if plans.scene.problem.obstacles else "; there is no obstacle"
        raise InputError(f"best: expected an objective that is finite; at no plan drawn it is{so}.")
    return best.x[0], float(best.value[0])


def _value(plans: SafePlans, objective: Objective):
    """Objective of plans (b, n_p + n_k) -> (b,) on the host; NaN counts as worst."""
    n_p, n_k = plans.model.n_p, plans.model.n_k
    if isinstance(objective, str):
        if objective not in NAMED:
            raise InputError(
                f'best: expected "clearance", "room", a vector or a function; got {objective!r}.'
            )
        # of all obstacles, those too that no plan comes near
        scene = unpruned_scene(plans.scene)
        return lambda x: getattr(verdicts(scene, x[:, :n_p], x[:, n_p:]), objective)
    if not callable(objective):
        c = as_float64("best: linear objective", objective, (n_p + n_k,))
        return lambda x: x @ c
    compiled = jax.jit(jax.vmap(lambda x: jnp.asarray(objective(x[:n_p], x[n_p:]))))

    def value(x: Float[ArrayLike, "b n"]):
        with x64():
            found = np.asarray(compiled(x), float)
            return np.where(np.isnan(found), -np.inf, found)

    return value
