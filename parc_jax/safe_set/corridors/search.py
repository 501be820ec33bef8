"""Cover the safe set: draw plans, build corridors and cut polytopes around those outside, until a
fresh draw finds almost none.

A search is a record, `Search`. `look` shows it a fresh draw, `extend` builds and cuts around what
the draw found outside, `cover` does both in turn until a stopping rule is satisfied or the work is
done. No clock decides what is found, but for the limit in seconds above the work. [T31]
"""

import time
from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.shapes import Which
from parc_jax.common.status import Ended
from parc_jax.safe_set.corridors.build import Building, admit, build, nothing_built
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.first import MOST, first_draw
from parc_jax.safe_set.corridors.found import Cover, Progress
from parc_jax.safe_set.corridors.place import Place
from parc_jax.safe_set.corridors.polytope import SafePolytope
from parc_jax.safe_set.corridors.polytopes import Polytopes, cut_around
from parc_jax.safe_set.corridors.sampling import (
    ENOUGH,
    EXPLORING,
    FEW,
    FIRST_DRAW,
    LARGEST_DRAW,
    RARE_DRAW,
    Counts,
    Points,
    Sampler,
    draw,
    joined,
    near,
    no_points,
)
from parc_jax.safe_set.corridors.stopping import Limit, StoppingRule, nothing_covered, stopping_rule
from parc_jax.safe_set.settings import Work
from parc_jax.safe_set.verdict.scene import Scene

NEAR = 32  # points drawn close to each that a look found outside, MOST_NEAR in all
MOST_NEAR = 16384
SLIVERS = 0.1  # while more than this share is outside, plain draws say enough of where
# [target] share of a look that may stay without a corridor: those points cost most and hold least
LEAVE = 0.1
LEAVE_NEAR = 0.5  # the same for points drawn close by, as a share of those outside


class Query(NamedTuple):
    """What stays the same during a search. rng: of building; draws have their own. cut: polytopes
    are wanted. begin: [s] of the clock.
    """

    scene: Scene
    rng: np.random.Generator
    target: float
    work: Work
    limit: Limit
    cut: bool
    begin: float

    def spent(self) -> float:
        """[s] since the search began."""
        return time.perf_counter() - self.begin


class Search(NamedTuple):
    """What changes during a search.

    by_corridors, by_polytopes: when they cover enough. outside: plans of the last fresh draw that
    are not covered. looks: so far. leave: so many may stay without a corridor. slivers: what
    uniform draws still leave out lies in slivers. enough: number of corridors that were certified
    to cover enough. Times as in Cover.
    """

    building: Building
    polytopes: Polytopes
    by_corridors: StoppingRule
    by_polytopes: StoppingRule
    outside: Points
    looks: int = 0
    leave: int = 0
    slivers: bool = False
    enough: int | None = None
    first_sample_s: float | None = None
    first_polytope_s: float | None = None
    corridors_s: float | None = None
    history: tuple[Progress, ...] = ()

    @property
    def announced(self) -> bool:
        """May the next look satisfy a rule?"""
        rules = self.by_corridors, self.by_polytopes
        return any(rule.announced and not rule.satisfied for rule in rules)


def cover(
    scene: Scene,
    rng: np.random.Generator,
    *,
    target: float,
    confidence: float,
    work: Work,
    limit: Limit,
    polytopes: bool = True,
    within: Place | None = None,
) -> Cover:
    """Build and cut until the polytopes leave out at most `target` of the safe set, with
    `confidence`, or the work is done.

    polytopes: False asks that of the corridors, and cuts no polytopes. limit: counts from the end
    of the first pass, which mostly compiles. The draw that is under way at the end decides.
    within: draw from this place only.
    """
    begin = time.perf_counter()
    for_draws, rng = rng.spawn(2)
    query = Query(scene, rng, target, work, limit, polytopes, begin)
    points, rule = no_points(scene.model), stopping_rule(target, confidence)
    building = nothing_built(scene.model.tube, points)
    search = Search(building, Polytopes(), by_corridors=rule, by_polytopes=rule, outside=points)
    with Sampler(scene, for_draws, within) as sampler:
        while True:
            search = look(query, search, sampler.take())
            ended = _ended(query, search, sampler.tally)
            if ended is not None:
                break
            if len(search.building.corridors):  # the first one should come soon, with all cores
                sampler.start(ENOUGH if search.announced else EXPLORING)
            search = extend(query, search)
    return _found(query, search, sampler)._replace(within=within, ended=ended)


def look(query: Query, search: Search, fresh: Points) -> Search:
    """The search after a look at a fresh draw of safe plans."""
    building, others = search.building, fresh
    n = len(fresh.k)
    inside = np.zeros(n, bool)
    if query.cut:
        found = search.polytopes.first(fresh, building)
        building = building.counting(found)
        inside = found >= 0
        others = fresh.at(~inside)
    kept = inside.copy()  # whoever is inside keeps to a corridor
    building, kept[~inside] = admit(building, others)
    covered = inside if query.cut else kept
    search = search._replace(
        building=building,
        outside=fresh.at(~covered),
        looks=search.looks + 1,
        leave=int(LEAVE * query.target * n),
        slivers=covered.sum() > (1 - SLIVERS) * n,
    )
    return _noted(query, search, kept, inside, covered) if n else search


def _noted(query: Query, search: Search, kept: Which, inside: Which, covered: Which) -> Search:
    """With what the stopping rules and the history say of the look."""
    seconds = query.spent()
    n_corridors = len(search.building.corridors)
    by_corridors = search.by_corridors.after(kept)
    if by_corridors.satisfied and not search.by_corridors.satisfied:
        search = search._replace(corridors_s=seconds, enough=n_corridors)
    shares = float(kept.mean()), len(search.polytopes), float(inside.mean())
    return search._replace(
        by_corridors=by_corridors,
        by_polytopes=search.by_polytopes.after(covered),
        first_sample_s=search.first_sample_s or seconds,
        history=(*search.history, Progress(seconds, n_corridors, *shares)),
    )


def extend(query: Query, search: Search) -> Search:
    """The search after corridors were built and polytopes cut around the plans outside."""
    outside, leave = search.outside, search.leave
    if search.slivers and len(outside.k):
        search, around = _draw_close_by(query, search)
        leave = max(leave, int(LEAVE_NEAR * len(outside.k)))
        outside = joined([outside, around])
    few = len(search.building.corridors) == 0  # the first one should come soon
    while len(search.building.waiting.k) > leave:
        if search.building.tried >= query.work.corridors or query.limit.over():
            break
        building = build(query.scene, search.building, query.rng, few)
        few = False
        since = search.first_polytope_s or query.spent()
        search = search._replace(building=building, first_polytope_s=since)
    if query.cut:
        cuts = cut_around(search.building, outside, query.spent())
        search = search._replace(polytopes=search.polytopes.with_more(cuts))
    if search.history:
        query.limit.start()
    return search


def _draw_close_by(query: Query, search: Search) -> tuple[Search, Points]:
    """Safe plans close to those outside. Slivers are hit by one uniform draw in a hundred; close to
    a hit plans are dense, and say which corridor and which polytope holds most.
    """
    n = min(NEAR * len(search.outside.k), MOST_NEAR)
    around = near(query.scene, query.rng, search.outside, n)
    building = search.building
    if query.cut:
        found = search.polytopes.first(around, building)
        building = building.counting(found)
        around = around.at(found < 0)
    building, _ = admit(building, around)
    return search._replace(building=building), around


def cover_around(
    scene: Scene, rng: np.random.Generator, plans: Points
) -> tuple[Sequence[Corridor], Sequence[SafePolytope]]:
    """Corridors and polytopes around given safe plans, for a query whose draws found none."""
    begin = time.perf_counter()
    building = nothing_built(scene.model.tube, plans)
    few = True
    while len(building.waiting.k):
        building = build(scene, building, rng, few)
        few = False
    polytopes = Polytopes(cut_around(building, plans, time.perf_counter() - begin))
    return building.corridors.all, polytopes.spelled_out(scene, building)


def draw_safe_plans(
    scene: Scene,
    key: jax.Array,
    rng: np.random.Generator,
    n: int,
    confidence: float,
    limit: Limit,
    within: Place | None = None,
) -> Cover:
    """Safe plans alone: draw until n are safe, or until it is hopeless. Nothing is built, nothing
    is covered. A few are drawn from `key` in one call, the others from `rng`. limit: counts from
    the first of these on; where none were drawn yet, some are.
    """
    begin = time.perf_counter()
    first = None
    tally = Counts()
    seen = []
    if within is None and n <= MOST:
        one = first_draw(scene, key, n)
        seen.append(one.safe)
        tally = tally.plus(one)
        first = time.perf_counter() - begin if tally.safe else None
    size = FIRST_DRAW
    while tally.safe < n and not tally.hopeless:
        if tally.drawn and limit.over():
            break
        one = draw(scene, rng, size, within)
        limit.start()
        seen.append(one.safe)
        tally = tally.plus(one)
        if tally.safe and first is None:
            first = time.perf_counter() - begin
        most = LARGEST_DRAW if tally.safe >= FEW else RARE_DRAW
        size = int(np.clip(1.2 * n * tally.drawn / max(tally.safe, 1), FIRST_DRAW, most))
    none = nothing_covered(confidence)
    short = Ended.SECONDS if limit.cut else Ended.WORK
    ended = Ended.TARGET if tally.safe >= n else short
    return Cover(*tally, joined(seen), none, none, first_sample_s=first, within=within, ended=ended)


def _ended(query: Query, search: Search, tally: Counts) -> Ended | None:
    """What ends the search after a look; None where it goes on. Seconds come last: they say so only
    where they leave something undone.
    """
    work = query.work
    if query.limit.cut:
        return Ended.SECONDS
    if search.by_polytopes.satisfied:
        return Ended.TARGET
    if search.looks >= work.looks or search.building.tried >= work.corridors or tally.hopeless:
        return Ended.WORK
    return Ended.SECONDS if query.limit.over() else None


def _found(query: Query, search: Search, sampler: Sampler) -> Cover:
    """The end of a search."""
    building = search.building
    nothing = nothing_covered(search.by_polytopes.coverage.confidence)
    return Cover(
        *sampler.tally,
        points=sampler.seen,
        kept=search.by_corridors.coverage,
        coverage=search.by_polytopes.coverage if query.cut else nothing,
        corridors=building.corridors.all[: search.enough],
        polytopes=search.polytopes.spelled_out(query.scene, building),
        first_sample_s=search.first_sample_s,
        first_polytope_s=search.first_polytope_s,
        corridors_s=search.corridors_s,
        history=search.history,
    )
