"""The best plan of the safe set for an objective: drawn widely, then drawn ever closer to the best
so far.
"""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common.arrays import as_float64, x64
from parc_jax.common.climb import Ranked, climb, ranked
from parc_jax.common.errors import InputError
from parc_jax.safe_set.corridors.safe_plans import SafePlans
from parc_jax.safe_set.verdict.near import whole_scene
from parc_jax.safe_set.verdict.pointwise import verdicts

DRAWS = 2048  # first look over the whole set
KEPT = 4  # plans around which the closer search draws: of these, then the best so far
EACH = 128  # draws of a round around one of them: all together fill one compiled verdict
# [ways between two plans] each round draws closer to the best
SPREADS = np.cumprod(np.full(25, 0.75))

NAMED = ("clearance", "room")
Objective = str | Sequence[float] | np.ndarray | Callable


def best_plan(
    plans: SafePlans, objective: Objective, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    """Plan (n_p + n_k,) of a safe set with the largest objective found, and its value.

    objective: "clearance" [m], "room" (the least of clearance and of the margins of goal and
    start), a vector c (n_p + n_k,) for c . (p0, k), or a JAX function of p0 (n_p,), k (n_k,) ->
    scalar. Raises InputError.
    """
    n_p, n_k = plans.model.n_p, plans.model.n_k
    if isinstance(objective, str) and objective not in NAMED:
        raise InputError(
            f'best: expected "clearance", "room", a vector or a function; got {objective!r}.'
        )
    if not (callable(objective) or isinstance(objective, str)):
        c = as_float64("best: linear objective", objective, (n_p + n_k,))
        return _search(plans, lambda x: x @ c, rng)
    return _search(plans, _value(plans, objective), rng)


def _search(
    plans: SafePlans, value: Callable, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    try:
        drawn = plans.sample(rng, DRAWS)
    except InputError:  # too small a set for draws: those that it is known by
        drawn = plans.inner
        if not len(drawn):
            raise
    starts = ranked(drawn, value(drawn)).at(slice(KEPT))
    n_p = plans.model.n_p

    def closer(best: Ranked, spread: float) -> np.ndarray:
        # ways from one drawn plan to another fit the set as a whole
        a, b = rng.integers(0, len(drawn), (2, len(best.x), EACH))
        x = (best.x[:, None] + spread * (drawn[a] - drawn[b])).reshape(-1, drawn.shape[1])
        return x[plans.contains(x[:, :n_p], x[:, n_p:])]

    best = climb(starts, closer, value, SPREADS, KEPT)
    return best.x[0], float(best.value[0])


def _value(plans: SafePlans, objective: Objective):
    """Objective of plans (b, n_p + n_k) -> (b,) on the host; NaN counts as worst."""
    n_p = plans.model.n_p
    if isinstance(objective, str):
        # of all obstacles, those too that no plan comes near
        scene = whole_scene(plans.scene)

        def named(x: Float[ArrayLike, "b n"]):
            return getattr(verdicts(scene, x[:, :n_p], x[:, n_p:]), objective)

        return named
    compiled = jax.jit(jax.vmap(lambda x: jnp.asarray(objective(x[:n_p], x[n_p:]))))

    def value(x: Float[ArrayLike, "b n"]):
        with x64():
            return np.nan_to_num(np.asarray(compiled(x), float), nan=-np.inf)

    return value
