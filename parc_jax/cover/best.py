"""The best plan of the safe set for an objective: drawn widely, then drawn ever closer to the best
so far.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import as_float64, x64
from parc_jax.cover.solid import sample_solid
from parc_jax.cover.union import SafeUnion
from parc_jax.errors import InputError
from parc_jax.verdict.near import whole_scene
from parc_jax.verdict.pointwise import verdicts

DRAWS = 2048  # first look over the whole union
ROUNDS = 25
PER_ROUND = 128
# each round draws this much closer to the best point; polytopes are convex, so nothing leaves its
# polytope
SHRINK = 0.75
PULL = (
    1 - 1e-9
)  # [share] vertices are pulled towards the inner point by this, against the rounding of qhull

NAMED = ("clearance", "room")
Objective = str | np.ndarray | Callable


def best_plan(
    union: SafeUnion, objective: Objective, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    """Plan (n_p + n_k,) of the safe union with the largest objective found, and its value.

    objective: "clearance" [m], "room" (the least of clearance and of the margins of goal and
    start), a vector c (n_p + n_k,) for c . (p0, k) (exact: attained at a vertex), or a JAX function
    of p0 (n_p,), k (n_k,) -> scalar. Raises InputError.
    """
    n_p, n_k = union.model.n_p, union.model.n_k
    if isinstance(objective, str) and objective not in NAMED:
        raise InputError(
            f'best: expected "clearance", "room", a vector or a function; got {objective!r}.'
        )
    if callable(objective) or isinstance(objective, str):
        return _search(union, _value(union, objective), rng)
    c = as_float64("best: linear objective", objective, (n_p + n_k,))
    corners = [
        np.concatenate([p.p0, p.k]) * (1 - PULL) + s.vertices * PULL
        for p, s in zip(union.polytopes, union.solids, strict=True)
        if s is not None
    ]
    if not corners:
        raise InputError("best: expected an answer with safe polytopes; this one has none.")
    x = np.concatenate(corners)
    order = np.argsort(-(x @ c))
    for chunk in np.array_split(order, max(1, len(order) // 64)):
        inside = union.contains(x[chunk, :n_p], x[chunk, n_p:])
        if inside.any():
            plan = x[chunk[np.argmax(inside)]]
            return plan, float(plan @ c)
    raise InputError("best: the safe polytopes are thinner than float64 resolves.")


def _search(union: SafeUnion, value, rng) -> tuple[np.ndarray, float]:
    n_p = union.model.n_p
    x = union.sample(rng, DRAWS)
    scores = value(x)
    plan = x[np.argmax(scores)]
    score = float(scores.max())
    scale = 1.0
    for _ in range(ROUNDS):
        around = [
            sample_solid(s, rng, PER_ROUND)
            for p, s in zip(union.polytopes, union.solids, strict=True)
            if s is not None and (p.halfspaces.A @ plan <= p.halfspaces.b + 1e-12).all()
        ]
        if not around:
            break
        scale *= SHRINK
        x = plan + scale * (np.concatenate(around) - plan)
        x = x[union.contains(x[:, :n_p], x[:, n_p:])]
        scores = value(x) if len(x) else np.array([-np.inf])
        if scores.max() > score:
            plan = x[np.argmax(scores)]
            score = float(scores.max())
    return plan, score


def _value(union: SafeUnion, objective):
    """Objective of plans (b, n_p + n_k) -> (b,) on the host; NaN counts as worst."""
    n_p = union.model.n_p
    if isinstance(objective, str):
        # of all obstacles, those too that no plan comes near
        scene = whole_scene(union.scene, union.model)

        def named(x):
            e = verdicts(union.model, scene, x[:, :n_p], x[:, n_p:])
            if objective == "clearance":
                return e.clearance
            return np.minimum(np.minimum(e.goal, e.start), e.clearance)

        return named
    compiled = jax.jit(jax.vmap(lambda x: jnp.asarray(objective(x[:n_p], x[n_p:]))))

    def value(x):
        with x64():
            return np.nan_to_num(np.asarray(compiled(x), float), nan=-np.inf)

    return value
