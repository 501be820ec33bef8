"""A problem laid out for one model: what a loop that replans keeps from one query to the next."""

import logging
import time
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer, volume_of_plans
from parc_jax.answer.looks import Looks
from parc_jax.common.errors import InputError, expected
from parc_jax.common.keys import Stage, stream
from parc_jax.common.status import Ended
from parc_jax.method import Exact
from parc_jax.proof.absence.prove_no_plan import NoPlan
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

    def __init__(self, scene: Scene):
        self.scene = scene

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
        the answer shares; None for a new one.
        """
        scene = self.scene
        method = settings.method or Exact()
        cover, no_plan = method.search(scene, stream(key, Stage.SEARCH), settings)
        covered = time.perf_counter()
        _log.info(
            "searched for %.1f s: %d safe points, %d corridors",
            covered - begin,
            cover.safe,
            len(cover.corridors),
        )
        chosen = cover.points
        samples = np.concatenate([chosen.p0, chosen.k], axis=1)

        def certificates() -> list[dict]:
            return _certificates(scene, chosen)

        written = certificates
        if settings.proof:
            parts = certificates()
            accepted, held, _ = prove(scene.problem, scene.model, parts, cover.corridors)
            refused = int((~accepted).sum() + (~held).sum())
            samples, written = samples[accepted], _those(parts, accepted)
            # where a corridor is refused the looks judged more than is returned: nothing is stated
            coverage = cover.coverage if held.all() else cover.coverage._replace(at_least=0.0)
            cover = cover._replace(
                corridors=_those(cover.corridors, held),
                coverage=coverage,
                proved=True,
                refused=refused,
            )
            took = time.perf_counter() - covered
            _log.info("proved in exact arithmetic for %.1f s: %d refused", took, refused)
        timings = {
            "first_sample_s": cover.first_sample_s,
            "first_corridor_s": cover.first_corridor_s,
            "corridors_s": cover.corridors_s,
            "cover_s": covered - begin,
            "proof_s": time.perf_counter() - covered,
        }
        found = len(samples) + len(cover.corridors) > 0
        cover = cover._replace(
            ended=_ended(cover, no_plan, found),
            total_volume=volume_of_plans(scene),
            timings=timings,
        )
        if no_plan is not None:
            no_plan = no_plan._replace(doubt=scene.asked.doubt)
        return Answer(scene, cover, samples, written, no_plan, Looks() if looks is None else looks)


def _ended(cover: Cover, no_plan: NoPlan | None, found: bool) -> Ended | None:
    """The end of the search: the limit in seconds wherever it cut something off, else that of the
    proof where no plan was found.
    """
    proof = None if no_plan is None else no_plan.ended
    if Ended.SECONDS in (cover.ended, proof):
        return Ended.SECONDS
    return cover.ended if found or proof is None else proof


def _certificates(scene: Scene, chosen: Points) -> list[dict]:
    """The certificates of plans, one each."""
    each = (chosen.p0, chosen.k, chosen.path)
    return [
        sample_part(scene, scene.model.tube, *plan_and_path)
        for plan_and_path in zip(*each, strict=True)
    ]


def _those(parts, accepted) -> list:
    return [part for part, keep in zip(parts, accepted, strict=True) if keep]
