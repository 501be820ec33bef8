"""A problem laid out for one model: what a loop that replans keeps from one query to the next."""

import logging
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import Looks
from parc_jax.common.errors import InputError, expected
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.method import Exact
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import sample_part
from parc_jax.safe_set.corridors.first import MOST, first_safe
from parc_jax.safe_set.corridors.found import Cover
from parc_jax.safe_set.corridors.placed import placed
from parc_jax.safe_set.corridors.sampling import Points
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.scene import Scene

_log = logging.getLogger(__name__)


class FirstPlans(NamedTuple):
    """Safe plans in the order in which they were drawn: uniform over the safe set, each proved in
    float64 with the margin that covers rounding. None at all says nothing of whether there are any.

    plans (n, n_p + n_k). clearance (n,) [m]: kept from every obstacle by every run inside the tube.
    drawn: plans that were looked at.
    """

    plans: np.ndarray
    clearance: np.ndarray
    drawn: int


class Prepared:
    """A problem laid out for one model. Made by `Planner.prepare`."""

    def __init__(self, scene: Scene, solve: Callable[..., Any]):
        self.scene = scene
        self._again = solve

    def __repr__(self) -> str:
        return f"Prepared({self.scene.problem!r})"

    def first(self, key: jax.Array, n: int = 1) -> FirstPlans:
        """The first n safe plans of a few draws, in one compiled call: fewer, or none, where safe
        plans are rarer than about one in a hundred; `solve` looks on.

        key: its SEARCH stream is used. n: at most 16. Raises InputError.
        """
        if not 1 <= n <= MOST:
            raise InputError(f"first: expected 1 to {MOST} plans; got {n}. `solve` gives more.")
        safe, _ = first_safe(placed(self.scene), stream(key, Stage.SEARCH), n)
        safe = safe.fetched()
        return FirstPlans(safe.plans, safe.clearance, safe.judged)

    def solve(self, key: jax.Array, settings: Settings | None = None) -> Answer:
        """The answer that `Planner.solve` gives. Raises InputError."""
        settings = Settings.whole() if settings is None else settings
        if not isinstance(settings, Settings):
            raise InputError(expected("solve", "Settings", settings, "pj.Settings.fast()"))
        return self._solve(key, settings, time.perf_counter())

    def _solve(
        self, key: jax.Array, settings: Settings, begin: float, looks: Looks | None = None
    ) -> Answer:
        """begin: [s] of the clock, from which the times of the answer count. looks: an account that
        it shares, None for one of its own.
        """
        scene = self.scene
        search = stream(key, Stage.SEARCH)
        rng = generator(search)
        method = settings.method or Exact()
        found, no_plan = method.search(scene, search, rng, settings)
        covered = time.perf_counter()
        _log.info(
            "searched for %.1f s: %d safe points, %d corridors, %d polytopes",
            covered - begin,
            len(found.points.k),
            len(found.corridors),
            len(found.polytopes),
        )
        pick = rng.permutation(len(found.points.k))[: settings.samples]
        chosen = found.points.at(pick)
        samples = np.concatenate([chosen.p0, chosen.k], axis=1)

        def parts() -> list[dict]:
            return _certificates(scene, chosen)

        refused = 0
        if settings.proof:
            written = parts()
            accepted = prove(scene.problem, scene.model, written, found.corridors, found.polytopes)
            refused = sum(int((~kept).sum()) for kept in accepted)
            samples = samples[accepted[0]]
            written = _those(written, accepted[0])
            found = _without_refused(found, *accepted[1:])
            took = time.perf_counter() - covered
            _log.info("proved in exact arithmetic for %.1f s: %d refused", took, refused)
        timings = {
            "first_sample_s": found.first_sample_s,
            "first_polytope_s": found.first_polytope_s,
            "corridors_s": found.corridors_s,
            "cover_s": covered - begin,
            "proof_s": time.perf_counter() - covered,
        }
        return Answer(
            scene,
            found,
            samples,
            written if settings.proof else parts,
            settings.proof,
            refused,
            timings,
            None if no_plan is None else no_plan._replace(doubt=scene.asked.doubt),
            Looks() if looks is None else looks,
            solve=self._again,
        )


def _certificates(scene: Scene, chosen: Points) -> list[dict]:
    """Of all points."""
    each = (chosen.p0, chosen.k, chosen.path)
    return [
        sample_part(scene, scene.model.tube, *plan_and_path)
        for plan_and_path in zip(*each, strict=True)
    ]


def _those(parts, accepted) -> list:
    return [part for part, keep in zip(parts, accepted, strict=True) if keep]


def _without_refused(found: Cover, corridors: np.ndarray, polytopes: np.ndarray) -> Cover:
    """The accepted ones. Where any was refused, the looks judged more than is returned, and nothing
    is stated of it.
    """
    kept = found.kept if corridors.all() else found.kept._replace(at_least=0.0)
    coverage = found.coverage if polytopes.all() else found.coverage._replace(at_least=0.0)
    return found._replace(
        corridors=_those(found.corridors, corridors),
        polytopes=_those(found.polytopes, polytopes),
        kept=kept,
        coverage=coverage,
    )
