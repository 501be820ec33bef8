"""The narrowest gap for the true rectangle: a body that turns fits where its circle does not."""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.learning.learn import learn
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import ReachAvoid
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import sample_part
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

# a study that only shows that everything fits together
QUICK = {
    "hidden": (4, 4),
    "bins": (2, 2),
    "rollouts": 64,
    "profile_runs": 64,
    "fresh": 128,
    "eps": 0.1,
    "delta": 0.1,
    "seeds": 1,
    "steps": 20,
}


class Narrowest(NamedTuple):
    """apart [m] between the cars at the narrowest gap with a plan, None for no plan at all. proved:
    the checker accepted that plan.
    """

    apart: float | None
    proved: bool | None


def narrowest_for_rectangle(key: jax.Array, quick: bool = False) -> Narrowest:
    """Learn the model of `sims.drift_parking.narrow`, close the gap, prove the last plan."""
    from sims import rectangle
    from sims.drift_parking.narrow import how_narrow, narrow_settings
    from sims.drift_parking.scenario import problem
    from sims.drift_parking.system import system

    settings = narrow_settings().replace(**QUICK if quick else {})
    car = system("ode", rectangle.BODY)
    model = learn(car, key, settings=settings, quiet=True)
    at, plans = how_narrow(model, np.random.default_rng(0))
    if not len(plans):
        return Narrowest(None, None)
    return Narrowest(at, proved(model, problem(rectangle.BODY, at), plans[0]))


def proved(model: TrajectoryModel, problem: ReachAvoid, plan: np.ndarray) -> bool:
    """Does the checker accept this one plan (n_p + n_k,)?"""
    scene = scene_of(problem, model)
    p0, k = plan[None, : model.n_p], plan[None, model.n_p :]
    e = verdicts(scene, p0, k)
    part = sample_part(scene, model.tube, p0[0], k[0], e.path[0])
    return bool(prove(problem, model, [part])[0].all())
