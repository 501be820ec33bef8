"""What a search for corridors and polytopes found, and what each of its looks showed."""

from collections.abc import Sequence
from typing import NamedTuple

from parc_jax.common.status import Ended
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.place import Place
from parc_jax.safe_set.corridors.polytope import SafePolytope
from parc_jax.safe_set.corridors.sampling import Counts, Points
from parc_jax.safe_set.corridors.stopping import Coverage


class Progress(NamedTuple):
    """What one fresh draw from the safe set shows, `seconds` after the beginning of the search:
    corridors and polytopes so far, and the shares of its plans that keep to some corridor and that
    are inside some polytope.
    """

    seconds: float
    corridors: int
    kept: float
    polytopes: int
    inside: float


class Cover(NamedTuple):
    """What a search found. drawn, reaching, safe: counts over all draws, which are uniform over a
    set of that volume.

    points: safe ones among them. kept, coverage: what the corridors and what the polytopes cover.
    within: the place that was drawn from, where safe plans are too rare for draws from all; what is
        covered, and the volume, are of the safe set in it then.
    corridors: those that were certified to cover enough, corridors_s [s] after the beginning, or
    all where none were; polytopes are cut from later ones too. first_polytope_s: [s] until the
    first corridor, which in its seed's cell is a safe polytope. ended: by what, None if not known.
    """

    drawn: int
    reaching: int
    safe: int
    volume: float
    points: Points
    kept: Coverage
    coverage: Coverage
    corridors: Sequence[Corridor] = ()
    polytopes: Sequence[SafePolytope] = ()
    first_sample_s: float | None = None
    first_polytope_s: float | None = None
    corridors_s: float | None = None
    history: Sequence[Progress] = ()
    within: Place | None = None
    ended: Ended | None = Ended.TARGET

    @property
    def hopeless(self) -> bool:
        """So many drawn, and hardly any was safe: a search elsewhere may find more."""
        return Counts(self.drawn, self.reaching, self.safe).hopeless

    def later(self, seconds: float) -> "Cover":
        """The same, found so many seconds later."""
        times = {name: getattr(self, name) for name in _TIMES}
        moved = {name: None if at is None else at + seconds for name, at in times.items()}
        history = [p._replace(seconds=p.seconds + seconds) for p in self.history]
        return self._replace(history=history, **moved)


_TIMES = ("first_sample_s", "first_polytope_s", "corridors_s")
