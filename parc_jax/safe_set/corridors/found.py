"""The result of a search for corridors, and its progress."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.common.status import Ended
from parc_jax.learning.bound.counts import clopper_pearson, least_probability
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.place import Place
from parc_jax.safe_set.corridors.sampling import Counts, Points
from parc_jax.safe_set.corridors.stopping import Coverage

SHARE_CONFIDENCE = 0.99  # of the interval of the safe share


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
    first_sample_s, first_corridor_s, corridors_s: [s] from the beginning to the first safe plan, to
        the first corridor, and until the corridors were certified to cover enough.
    within: the place that was drawn from, where safe plans are too rare for draws from all;
        coverage and volume are of the safe set in it then.
    ended: by target, work or seconds; None where a file does not say.
    total_volume: of all plans that the query is about, in units of p0 and k multiplied.
    proved: the checker accepted all samples and corridors; refused: how many it did not accept,
        which were left out. timings: [s] by stage.
    """

    drawn: int
    reaching: int
    safe: int
    volume: float
    points: Points
    coverage: Coverage
    corridors: Sequence[Corridor] = ()
    first_sample_s: float | None = None
    first_corridor_s: float | None = None
    corridors_s: float | None = None
    history: Sequence[Progress] = ()
    within: Place | None = None
    ended: Ended | None = Ended.TARGET
    total_volume: float = float("nan")
    proved: bool = False
    refused: int = 0
    timings: Mapping[str, float | None] = {}

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
        if volume is None:
            return None
        share, at_least, at_most = (v / self.total_volume for v in volume)
        reaching = self.volume * self.reaching / self.drawn / self.total_volume
        return Share(share, at_least, at_most, reaching, SHARE_CONFIDENCE, self.total_volume)

    def pick(self, rng: np.random.Generator, n: int) -> "Cover":
        """The cover with n of its points, drawn uniformly without replacement."""
        chosen = rng.permutation(len(self.points.k))[:n]
        return self._replace(points=self.points.at(chosen))

    def later(self, seconds: float) -> "Cover":
        """The cover with times that begin so many seconds earlier."""
        times = {name: getattr(self, name) for name in _TIMES}
        moved = {name: None if at is None else at + seconds for name, at in times.items()}
        history = [p._replace(seconds=p.seconds + seconds) for p in self.history]
        return self._replace(history=history, **moved)


_TIMES = ("first_sample_s", "first_corridor_s", "corridors_s")
