"""Cover the safe set: draw plans and build corridors around those outside, until a fresh draw finds
almost none.

A search is a record, `Search`. `look` evaluates it on a fresh draw, `extend` builds corridors
around the uncovered plans of the draw, `cover` alternates both until the stopping rule is satisfied
or the work is done. No clock decides the result, except the limit in seconds above the work. [T31]
"""

import logging
import time
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.common.shapes import Key
from parc_jax.common.status import Ended
from parc_jax.learning.bound.counts import clopper_pearson, least_probability
from parc_jax.safe_set.corridors.build import Building, admit, build, nothing_built
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.first import MOST, first_draw
from parc_jax.safe_set.corridors.sampling import (
    ENOUGH,
    EXPLORING,
    FEW,
    FIRST_DRAW,
    LARGEST_DRAW,
    RARE_DRAW,
    Counts,
    Place,
    Points,
    Sampler,
    draw,
    joined,
    near,
    no_points,
)
from parc_jax.safe_set.corridors.stopping import (
    Coverage,
    Limit,
    StoppingRule,
    nothing_covered,
    stopping_rule,
)
from parc_jax.safe_set.settings import Work
from parc_jax.safe_set.verdict.scene import Scene

NEAR = 32  # points drawn close to each that a look found outside, MOST_NEAR in all
MOST_NEAR = 16384
SLIVERS = 0.1  # while more than this share is outside, plain draws say enough of where
# [target] share of a look that may stay without a corridor: those points cost most and hold least
LEAVE = 0.1
LEAVE_NEAR = 0.5  # the same for points drawn close by, as a share of those outside
SHARE_CONFIDENCE = 0.99  # of the interval of the safe share
_log = logging.getLogger(__name__)
UNTIMED = dict.fromkeys(("first_sample_s", "first_corridor_s", "corridors_s"))


class Share(NamedTuple):
    """Share of all plans that a query is about that is safe in the model with its tube: of all
    (p0, k) whose first point ends in the goal's box (missing the other goal states is not safe), or
    of all k in K where there is one start.

    share: estimate; at_least, at_most: Clopper-Pearson interval with `confidence`. reaching:
    estimate of the share that ends in the goal for every error of the tube, from a start that is
    allowed: obstacles leave share / reaching of it. total_volume: of all these plans, in
    units of p0 and k multiplied.
    """

    share: float
    at_least: float
    at_most: float
    reaching: float
    confidence: float
    total_volume: float

    @property
    def volume(self) -> tuple[float, float, float]:
        """Volume of the safe set: estimate and interval."""
        total = self.total_volume
        return self.share * total, self.at_least * total, self.at_most * total


class Progress(NamedTuple):
    """One look at a fresh draw, `seconds` after the search began: the number of corridors and the
    share of the draw's safe plans that satisfy one of them.
    """

    seconds: float
    corridors: int
    covered: float


class Cover(NamedTuple):
    """The result of a search.

    drawn, reaching, safe: counts over all draws, which are uniform over a set of that volume.
    points: safe plans among them; of a method, those that become the answer's samples.
    coverage: share of the model's safe set that the corridors hold.
    within: the place that was drawn from, where safe plans are too rare for draws from all;
        coverage and volume are of the safe set in it then.
    ended: by target, work or seconds; None where a file does not say.
    total_volume: of all plans that the query is about, in units of p0 and k multiplied.
    proved: the checker accepted all samples and corridors; refused: how many it did not accept,
        which were left out. timings: [s] from the beginning to the first safe plan, to the first
        corridor, and until the corridors were certified to cover enough; of an answer also of the
        whole search and of the proof.
    """

    drawn: int
    reaching: int
    safe: int
    volume: float
    points: Points
    coverage: Coverage
    corridors: Sequence[Corridor] = ()
    history: Sequence[Progress] = ()
    within: Place | None = None
    ended: Ended | None = Ended.TARGET
    total_volume: float = float("nan")
    proved: bool = False
    refused: int = 0
    timings: Mapping[str, float | None] = UNTIMED

    @property
    def hopeless(self) -> bool:
        """So many drawn, and hardly any was safe: draws elsewhere may find more."""
        return Counts(self.drawn, self.reaching, self.safe).hopeless

    def safe_volume(self, confidence: float) -> tuple[float, float, float] | None:
        """Volume of the model's safe set, in the place of the draws: estimate and Clopper-Pearson
        interval, for a fixed number of draws. None when nothing was drawn uniformly.
        """
        if not self.drawn or not np.isfinite(self.volume):
            return None
        tail = (1 - confidence) / 2
        low = least_probability(self.safe, self.drawn, tail)
        high = float(clopper_pearson(self.safe, self.drawn, tail))
        return self.volume * self.safe / self.drawn, self.volume * low, self.volume * high

    @property
    def share(self) -> Share | None:
        """As of `Answer.share`. Draws are uniform over a set of known volume, so one count of safe
        draws gives volume and share.
        """
        volume = self.safe_volume(SHARE_CONFIDENCE)
        if volume is None or not self.total_volume:
            return None
        share, at_least, at_most = (v / self.total_volume for v in volume)
        reaching = self.volume * self.reaching / self.drawn / self.total_volume
        return Share(share, at_least, at_most, reaching, SHARE_CONFIDENCE, self.total_volume)

    def pick(self, rng: np.random.Generator, n: int) -> "Cover":
        """The cover with n of its points, drawn uniformly without replacement."""
        return self._replace(points=self.points.at(rng.permutation(len(self.points.k))[:n]))

    def later(self, seconds: float) -> "Cover":
        """The cover with times that begin so many seconds earlier."""
        times = {name: None if at is None else at + seconds for name, at in self.timings.items()}
        history = [p._replace(seconds=p.seconds + seconds) for p in self.history]
        return self._replace(history=history, timings=times)


class Search(NamedTuple):
    """The state of a search, after its constants.

    rng: of building; draws have another. begin: [s] of the clock.
    rule: when the corridors cover enough. outside: plans of the last fresh draw that are not
    covered. looks: so far. leave: so many may stay without a corridor. slivers: the uncovered
    remainder lies in slivers, which uniform draws rarely hit. timings: as of Cover, so far.
    """

    scene: Scene
    rng: np.random.Generator
    target: float
    work: Work
    limit: Limit
    begin: float
    building: Building
    rule: StoppingRule
    outside: Points
    looks: int = 0
    leave: int = 0
    slivers: bool = False
    timings: Mapping[str, float] = {}
    history: tuple[Progress, ...] = ()

    def spent(self) -> float:
        """[s] since the search began."""
        return time.perf_counter() - self.begin


def cover(
    scene: Scene,
    rng: np.random.Generator,
    *,
    target: float,
    confidence: float,
    work: Work,
    limit: Limit,
    within: Place | None = None,
) -> Cover:
    """Build corridors until they leave out at most `target` of the safe set, with `confidence`, or
    the work is done.

    limit: counts from the end of the first pass, which mostly compiles. The draw that is under way
    at the end decides. within: draw from this place only.
    """
    begin = time.perf_counter()
    for_draws, rng = rng.spawn(2)
    none = no_points(scene.model)
    start = nothing_built(scene.model.tube, none), stopping_rule(target, confidence), none
    search = Search(scene, rng, target, work, limit, begin, *start)
    with Sampler(scene, for_draws, within) as sampler:
        while True:
            search = look(search, sampler.take())
            if (ended := _ended(search, sampler.tally)) is not None:
                break
            if len(search.building.corridors):  # the first one should come soon, with all cores
                sampler.start(ENOUGH if search.rule.announced else EXPLORING)
            search = extend(search)
    return Cover(
        *sampler.tally,
        points=sampler.seen,
        coverage=search.rule.coverage,
        corridors=search.building.corridors.all,
        timings={**UNTIMED, **search.timings},
        history=search.history,
        within=within,
        ended=ended,
    )


def look(search: Search, fresh: Points) -> Search:
    """The search after a look at a fresh draw of safe plans."""
    n = len(fresh.k)
    building, covered = admit(search.building, fresh)
    search = search._replace(
        building=building,
        outside=fresh.at(~covered),
        looks=search.looks + 1,
        leave=int(LEAVE * search.target * n),
        slivers=covered.sum() > (1 - SLIVERS) * n,
    )
    if not n:
        return search
    seconds = search.spent()
    rule = search.rule.after(covered)
    since = {"corridors_s": seconds} if rule.satisfied else {}
    progress = Progress(seconds, len(building.corridors), float(covered.mean()))
    _log.info("%d corridors hold %.1f %% of safe plans", progress.corridors, 100 * covered.mean())
    return search._replace(
        rule=rule,
        timings={"first_sample_s": seconds, **search.timings, **since},
        history=(*search.history, progress),
    )


def extend(search: Search) -> Search:
    """The search after corridors were built around the plans outside."""
    leave = search.leave
    if search.slivers and len(search.outside.k):
        # one uniform draw in a hundred hits a sliver; close to a hit plans are dense and show which
        # corridor holds most
        n = min(NEAR * len(search.outside.k), MOST_NEAR)
        around = near(search.scene, search.rng, search.outside, n)
        search = search._replace(building=admit(search.building, around)[0])
        leave = max(leave, int(LEAVE_NEAR * len(search.outside.k)))
    while len(search.building.waiting.k) > leave:
        if search.building.tried >= search.work.corridors or search.limit.over():
            break
        _log.info("building corridors: %d plans wait for one", len(search.building.waiting.k))
        building = build(search.scene, search.building, search.rng)
        timings = {"first_corridor_s": search.spent(), **search.timings}
        search = search._replace(building=building, timings=timings)
    if search.history:
        search.limit.start()
    return search


def corridors_around(scene: Scene, rng: np.random.Generator, plans: Points) -> Sequence[Corridor]:
    """Corridors around given safe plans, for a query whose draws found none."""
    building = nothing_built(scene.model.tube, plans)
    while len(building.waiting.k):
        building = build(scene, building, rng)
    return building.corridors.all


def draw_safe_plans(
    scene: Scene,
    key: Key,
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
    timings = {**UNTIMED, "first_sample_s": first}
    return Cover(*tally, joined(seen), none, within=within, ended=ended, timings=timings)


def _ended(search: Search, tally: Counts) -> Ended | None:
    """What ends the search after a look, if anything; seconds only where they leave work undone."""
    work = search.work
    if search.limit.cut:
        return Ended.SECONDS
    if search.rule.satisfied:
        return Ended.TARGET
    if search.looks >= work.looks or search.building.tried >= work.corridors or tally.hopeless:
        return Ended.WORK
    return Ended.SECONDS if search.limit.over() else None
