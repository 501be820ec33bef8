"""How a query is searched by the exact engine. Others come in as `Settings(method=...)`: the
published one is `benchmarks.neuralparc.Published` of a clone.

A method has one call, `search`: (scene, key, settings) -> the cover, whose points become the
answer's samples, and the result of the proof of absence, if any. Proofs and sentences of plans are
the planner's, for every method.
"""

import time
from dataclasses import dataclass

import numpy as np

from parc_jax.common.keys import folded, generator
from parc_jax.common.probes import require_sound_arithmetic
from parc_jax.common.shapes import Key
from parc_jax.common.status import Ended
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.network.predict import moved_to, trajectories
from parc_jax.proof.absence.prove_no_plan import MAX_LEAVES, PROVED, NoPlan, prove_no_plan
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import sample_part, separating
from parc_jax.proof.regions.table import float_patterns
from parc_jax.safe_set.corridors.rare import where_around, where_safe
from parc_jax.safe_set.corridors.sampling import Points, no_points, points, proposed
from parc_jax.safe_set.corridors.search import (
    UNTIMED,
    Cover,
    corridors_around,
    cover,
    draw_safe_plans,
)
from parc_jax.safe_set.corridors.stopping import Limit, nothing_covered
from parc_jax.safe_set.settings import Settings, work_of
from parc_jax.safe_set.verdict.infeasible import why_none
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene, lowered

SURE_LEAVES = 256  # of a proof where floats already tell that no plan is safe


@dataclass(frozen=True)
class Exact:
    """Plans judged in float64 with a rounding margin, corridors grown around them. Where hardly a
    draw was safe, a local search looks for a place with safe plans, and where it finds none branch
    and bound decides; draws are made in that place then. [T14, T15, T24, T27, T30]

    around: p0 (n_p,), k (n_k,) of a plan that is safe or nearly so; draws are made around it from
    the beginning, in scenes too narrow for others.
    """

    around: tuple[np.ndarray, np.ndarray] | None = None

    def search(self, scene: Scene, key: Key, settings: Settings) -> tuple[Cover, NoPlan | None]:
        """Cover the safe set of a scene. Consumes `key`."""
        rng = generator(key)
        cover, no_plan = self._search(scene, key, rng, settings)
        return cover.pick(rng, settings.samples), no_plan

    def _search(
        self, scene: Scene, key: Key, rng: np.random.Generator, settings: Settings
    ) -> tuple[Cover, NoPlan | None]:
        begin = time.perf_counter()
        limit = Limit(settings.budget_s)
        work = work_of(settings.work)
        if self.around is not None:
            within = where_around(scene, rng, *self.around, limit)
            return self._drawn(scene, key, rng, settings, limit, within), None
        soon = settings.samples_only and scene.at is None  # where hardly anything is waited for
        why = None if soon else why_none(scene)
        if why is not None and why.sure:
            found = _nothing(scene, settings)
        else:
            found = self._drawn(scene, key, rng, settings, limit)
        if len(found.points.k) and not found.hopeless:
            return found, None
        why, no_plan = why_none(scene) if soon else why, None
        hopeless, decided = why is not None, why is not None and why.sure
        within = None if hopeless or limit.over() else where_safe(scene, rng, 1, limit)
        nothing = within is None and not len(found.points.k)
        if nothing and scene.at is None:  # a proof would be about any start
            leaves = min(work.leaves, SURE_LEAVES if decided else MAX_LEAVES)
            # of what is there alone: boxes look at all of it
            no_plan = prove_no_plan(lowered(scene.nominal), limit=limit, max_leaves=leaves)
            # around the safe plan that it came across, or, where it proved nothing, where larger
            # populations climb to, if an end fits the goal
            if no_plan.safe_plan is not None:
                within = where_around(scene, rng, *no_plan.safe_plan, limit)
            elif decided and no_plan.kind != PROVED:
                no_plan = None  # nothing remains undecided: its reason is told instead
            elif not (hopeless or no_plan.kind == PROVED or limit.over()):
                within = where_safe(scene, rng, work.population, limit)
        if decided or limit.cut:  # cut by the local search or the proof: draws report their own end
            found = found._replace(ended=None if decided else Ended.SECONDS)
        if within is None:
            return found, no_plan
        spent = time.perf_counter() - begin
        rare = self._drawn(scene, key, rng, settings, limit, within)
        if len(rare.points.k):
            return rare.later(spent), no_plan
        if no_plan is None or no_plan.safe_plan is None:
            return found, no_plan
        # corridors around the plan that branch and bound came across
        p0, k = (x[None] for x in no_plan.safe_plan)
        plan = points(p0, k, verdicts(scene, p0, k))
        corridors, first = corridors_around(scene, rng, plan), time.perf_counter() - begin
        since = {"first_sample_s": no_plan.seconds, "first_corridor_s": first}
        timings = {**found.timings, **since}
        return found._replace(points=plan, corridors=corridors, timings=timings), no_plan

    def _drawn(
        self, scene: Scene, key, rng, settings: Settings, limit: Limit, within=None
    ) -> Cover:
        """The cover by draws, from everywhere or a place. Without any claim nothing is safe."""
        if not scene.model.tube.claimed.any():
            return _nothing(scene, settings)
        confidence = settings.confidence
        if settings.samples_only:
            return draw_safe_plans(scene, key, rng, settings.samples, confidence, limit, within)
        target, work = settings.target, work_of(settings.work)
        return cover(
            scene, rng, target=target, confidence=confidence, work=work, limit=limit, within=within
        )


def _nothing(scene: Scene, settings: Settings) -> Cover:
    """Nothing was drawn, since nothing is safe."""
    none = nothing_covered(settings.confidence)
    return Cover(0, 0, 0, float("nan"), no_points(scene.model), none, ended=None)


ROUNDS, DRAWN = 8, 64  # of draws for a first plan, and plans in each
LOOKED_AT = 512  # pairs of a plan and an obstacle in a round: a quarter of a second


@dataclass(frozen=True)
class FirstProved:
    """One plan, found and proved without a compiled program: the first of some uniform draws that
    directions of the scene's table separate from everything, and that the exact checker accepts. No
    share is counted. Where there is none, as `Exact`. [T12a, T15]
    """

    def search(self, scene: Scene, key: Key, settings: Settings) -> tuple[Cover, NoPlan | None]:
        """A cover of one plan. Consumes `key`. Raises SoundnessError."""
        begin, rng = time.perf_counter(), generator(key)
        for _ in range(ROUNDS):
            plan = _first_proved(scene, rng)
            if plan is not None:
                timings = {**UNTIMED, "first_sample_s": time.perf_counter() - begin}
                found = {"points": plan, "timings": timings, "ended": Ended.TARGET, "proved": True}
                return _nothing(scene, settings)._replace(**found), None
        require_sound_arithmetic()
        return Exact().search(scene, folded(key, 1), settings)  # other draws


def _first_proved(scene: Scene, rng: np.random.Generator) -> Points | None:
    """The first plan of a round that is proved. What floats say here decides nothing."""
    model, tube = scene.model, scene.model.tube
    z, k, _ = proposed(scene, rng, DRAWN)
    if not len(k):  # no end fits into the goal, whatever bin k is in
        return None
    offsets, q = trajectories(model.net, model.layout, k)
    p0 = z - offsets[:, -1, : model.n_p] if scene.at is None else np.tile(scene.at, (len(k), 1))
    path, bins = moved_to(p0, offsets), tube.bin_of(k)
    lost = at(tube.final_errors, (bins, None)).support(scene.goal_A)
    ends = np.concatenate([path[:, -1], q], axis=1) @ scene.goal_A.T + lost
    starts = p0 @ scene.start_A.T
    reaches = (ends <= scene.goal_b).all(axis=1) & (starts <= scene.start_b).all(axis=1)
    for i in np.flatnonzero(reaches)[: 1 + LOOKED_AT // (1 + int(scene.count))]:
        pairs = zip(separating(scene, tube, k[i], path[i]), scene.obstacles.active, strict=False)
        if all((some.any(axis=0) | ~active).all() for some, active in pairs):
            part = sample_part(scene, tube, p0[i], k[i], path[i])
            if prove(scene.problem, model, [part])[0].all():
                patterns, _ = float_patterns(model.net, k)
                return Points(p0, k, path, bins, patterns).at(slice(i, i + 1))
    return None
