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

SPREAD = 8  # predicted ends at which `share_of_k` tries every k
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

        A k counts when a start in the set leads to one of a few predicted ends, those of inner
        plans. Sufficient, so the share is never too large.
        """
        rng = np.random.default_rng(0)
        k = rng.uniform(self.model.domain.lo, self.model.domain.hi, (n, self.model.n_k))
        if not len(self.inner):
            return 0.0
        hit = np.zeros(n, bool)
        for z in self._ends() if self.scene.at is None else self.scene.at[None]:
            left = np.flatnonzero(~hit)
            if len(left) == 0:
                break
            some = k[left]
            ends_here = np.broadcast_to(z, (len(left), len(z)))
            if self.scene.at is not None:
                ends_here = ends_from(self.scene.at, self.model, some)
            screened, safe = safe_ones(self.scene, ends_here, some)
            hit[left[screened.row]] = self.has(safe)
        return least_probability(int(hit.sum()), n, 0.001)

    def _ends(self) -> np.ndarray:
        """A few well-spread predicted ends (m, n_p) of inner plans: farthest-point order."""
        p0, k = np.split(self.inner, [self.model.n_p], axis=1)
        ends = paths_of(self.model, p0, k)[:, -1, : self.model.n_p]
        chosen = [int(np.argmin(np.abs(ends - np.median(ends, axis=0)).sum(axis=1)))]
        distance = np.full(len(ends), np.inf)
        while len(chosen) < min(SPREAD, len(ends)):
            distance = np.minimum(distance, np.abs(ends - ends[chosen[-1]]).sum(axis=1))
            chosen.append(int(np.argmax(distance)))
        return ends[chosen]


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
        raise InputError("best: expected an objective that is finite; at no plan drawn it is.")
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
