"""The gap that is narrower than the circle around the car: `python -m sims.drift_parking.narrow`.

The parked cars are moved together until they stand APART. The circle around the car is wider than
that; its true outline, turning, fits. One claim over all of K, as in the main job; what differs is
where its tube is allowed to be tight: the bins keep the jumps of the manoeuvre to themselves.
docs/drift_parking.md says what each of these choices bought.

With --refine the cars stand REFINED apart, where that model has no plan: new runs are made where
the plans nearly are, and one plan is proved under a claim about a small box of K
(docs/driven_plan.md).
"""

import math
import shutil
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import tyro

from parc_jax.app.study.cache import keep_compiled
from parc_jax.learning.bound.settings import ModelBound
from parc_jax.learning.learn import Learning, learn
from parc_jax.learning.model import TrajectoryModel, load
from parc_jax.planner import Planner
from parc_jax.problem.problem_file import save_problem
from parc_jax.safe_set.settings import Settings
from sims import rectangle
from sims.drift_parking.closing_in import ClosingIn, narrowest
from sims.drift_parking.scenario import problem
from sims.drift_parking.system import system
from sims.refine import refine

APART = 4.6  # [m] between the parked cars; the circle around the car is 4.71 m across
REFINED = 4.5  # [m] the same, for a refined model
# between two jumps of the manoeuvre the car comes in straight, and the same for all k: a piece of
# K 1.5 mm/s wide, found in a map of 12,000 runs with speeds up to 9.1 m/s
CALM = (9.0066, math.radians(37.2))
WIDE, STEP = 5.2, 0.01  # [m] apart where the search begins, and how much closer each time
# Edges inside K. Few bins, so that each is learnt from many runs; the jumps of the manoeuvre, near
# 9.21, 9.6 and 9.8 m/s, on their own; the sideslips that end straightest by the degree.
SPEEDS = (9.1, 9.2, 9.22, 9.7, 9.9)
SIDESLIPS = tuple(map(math.radians, (35.5, 36.5, 37.5)))


def narrow_settings() -> Learning:
    """The settings with which the narrow gap is passed."""
    lo, hi = system("ode").domain.lo, system("ode").domain.hi
    bound = ModelBound(
        bins=((lo[0], *SPEEDS, hi[0]), (lo[1], *SIDESLIPS, hi[1])),
        shape="fitted",
        profile_runs=40_000,
        # two dozen of them may be left outside: a jump that is rarer than eps does not widen K
        fresh=40_000,
    )
    return Learning(rollouts=20_000, bound=bound)


def closing_in(apart: float) -> ClosingIn:
    """The method that finds plans with the cars so far apart [m], through wider gaps."""
    wider = np.arange(WIDE, apart, -STEP)
    return ClosingIn(tuple(problem(rectangle.BODY, float(at)) for at in wider))


def how_narrow(model: TrajectoryModel, rng: np.random.Generator) -> tuple[float, np.ndarray]:
    """The least distance of the cars [m], in steps of STEP, with a plan, and such plans (n, 4).

    Not yet proved. In a scene so narrow a search that finds none shows nothing.
    """
    at, seen = narrowest(model, lambda at: problem(rectangle.BODY, at), WIDE, STEP, rng)
    return at, np.concatenate([seen.p0, seen.k], axis=1)


@dataclass(frozen=True)
class Options:
    """Learn the model of the narrow gap, and prove plans of its scene."""

    out: Path = Path("runs/narrow")
    """Folder for model.npz, scene.toml and answer.json."""
    model: Path | None = None
    """A model of an earlier run; skips rollouts and training."""
    apart: float | None = None
    """[m] between the parked cars. Default: 4.6, refined 4.5."""
    refine: bool = False
    """New runs where the scene's plans are, or nearly are, and a claim there; then the answer is
    the refined one, and its model beside it is refined.npz."""
    seed: int = 0
    """Everything random follows from it."""


def main(options: Options) -> None:
    """100,000 runs and one network; how narrow a gap it passes; the safe set of the one asked."""
    keep_compiled()
    key = jax.random.PRNGKey(options.seed)
    if options.model is None:
        work = options.out / "unfinished"
        car = system("ode", rectangle.BODY)
        model = learn(car, key, settings=narrow_settings(), path=work)
        model.save(options.out / "model.npz")
        shutil.rmtree(work)
    else:
        model = load(options.model, system="drift_parking")
    if options.refine:
        refined(model, options, key)
        return
    least, plans = how_narrow(model, np.random.default_rng(options.seed))
    print(f"plans down to {least:.2f} m between the cars" if len(plans) else "no plan")
    apart = options.apart or APART
    scene = problem(rectangle.BODY, apart)
    save_problem(options.out / "scene.toml", scene, model.labels, model.points)
    settings = Settings(method=closing_in(apart))
    answer = Planner(model).solve(scene, key, settings)
    answer.save(options.out / "answer.json")
    print(answer.details())


def refined(model: TrajectoryModel, options: Options, key: jax.Array) -> None:
    """One plan of a narrower scene, under a claim of its own; what each stage bought."""
    scene = problem(rectangle.BODY, options.apart or REFINED)
    save_problem(options.out / "refined.toml", scene, model.labels, model.points)
    car = system("ode", rectangle.BODY)
    zoom = {"shares": (1e-4, 1e-5, 1e-6), "centres": 6, "around": (CALM,)}
    found = refine(model, scene, car, key, **zoom, say=print)
    print(found.table())
    print(found.details())
    if found.choice is not None:
        near = found.choice.near
        near.model.save(options.out / "refined.npz")
        near.answer.save(options.out / "refined.json")
        print(near.answer.details())


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
