"""A search for scenes that are too narrow for draws: plans of a wider scene are looked around, then
those of a less wide one, and so on down to the scene that was asked about.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from parc_jax.common.keys import generator
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.corridors.sampling import Points, draw, joined, near
from parc_jax.safe_set.corridors.search import UNTIMED, Cover, corridors_around
from parc_jax.safe_set.corridors.stopping import nothing_covered
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.scene import Scene, scene_of

FIRST = 20_000  # plans drawn in the widest scene
AROUND = 2_000  # plans tried around the last ones, at each step
TRIES = 4  # times, before a step counts as the last
MOST = 400  # plans that are kept


@dataclass(frozen=True)
class ClosingIn:
    """A method of `Settings`: from each of the wider problems to the next, then to the asked one.

    The answer's corridors lie around the plans found; nothing is said of the rest of the safe set,
    so its coverage is unknown.
    """

    wider: tuple[Problem, ...]

    def search(self, scene: Scene, key, settings: Settings) -> tuple[Cover, None]:
        """A cover around the plans of the last step. Consumes `key`."""
        begin = time.perf_counter()
        rng = generator(key)
        model = scene.model
        seen = draw(scene_of(self.wider[0], model), rng, FIRST).safe
        for problem in self.wider[1:]:
            seen = looked_around(scene_of(problem, model), rng, seen)
        seen = looked_around(scene, rng, seen)
        for _ in range(TRIES if len(seen.k) else 0):
            seen = joined([seen, near(scene, rng, seen, AROUND)]).at(slice(-MOST, None))
        found = time.perf_counter() - begin if len(seen.k) else None
        corridors = corridors_around(scene, rng, seen) if len(seen.k) else ()
        none = nothing_covered(settings.confidence)
        n = len(seen.k)  # of no law: no share and no volume follows from how many they are
        return Cover(
            drawn=n,
            reaching=n,
            safe=n,
            volume=float("nan"),
            points=seen,
            coverage=none,
            corridors=corridors,
            timings={**UNTIMED, "first_sample_s": found},
        ).pick(rng, settings.samples), None


def looked_around(scene: Scene, rng: np.random.Generator, seen: Points) -> Points:
    """Safe plans of this scene around those of the one before; none when there were none."""
    for _ in range(TRIES):
        if not len(seen.k):
            break
        found = near(scene, rng, seen, AROUND)
        if len(found.k):
            return found.at(slice(MOST))
    return seen.at(slice(0))


def narrowest(
    model: TrajectoryModel,
    problem_at: Callable[[float], Problem],
    wide: float,
    step: float,
    rng: np.random.Generator,
) -> tuple[float, Points]:
    """The least of wide, wide - step, ... [m] at which plans were found, and these; with no plans
    when there are none even at `wide`.
    """
    at = wide
    seen = draw(scene_of(problem_at(at), model), rng, FIRST).safe
    while len(seen.k):
        closer = looked_around(scene_of(problem_at(at - step), model), rng, seen)
        if not len(closer.k):
            break
        at = at - step
        seen = closer
    return at, seen
