"""What a local claim says of the plan that is driven: sentence (D ii). [T23]"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from parc_jax.answer.looks import Look
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.drive.local.safe_box import SafeBox
from parc_jax.learning.bound.counts import NoStatement, Risk
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel

NARROWER = 1.05  # [1] a tube that is less than this much narrower is not called so


class Narrowing(NamedTuple):
    """Half widths over a box of k, the widest of the bins that it meets. whole, local: of the two
    tubes at the end, (n_c + n_q,) [m, .]. times: geometric mean factor by which the local one is
    narrower, at the end and during the run; infinite where the other has no claim.
    """

    whole: np.ndarray
    local: np.ndarray
    times_end: float
    times_path: float


def narrowing(whole: Tube, local: Tube, box: Box) -> Narrowing:
    """The tubes of a model of all of K and of one of a box in it."""
    corners = (whole.bin_box(number) for number in range(whole.n_bins))
    bins = [b for b, (lo, hi) in enumerate(corners) if ((lo <= box.hi) & (hi >= box.lo)).all()]
    path, end = whole.widest(np.array(bins))
    own_path, own_end = local.widest()
    return Narrowing(end, own_end, _factor(end, own_end), _factor(path, own_path))


def _factor(wide: np.ndarray, narrow: np.ndarray) -> float:
    if not np.isfinite(wide).all():
        return float("inf")
    if not np.isfinite(narrow).all():
        return 0.0
    return float(np.exp(np.mean(np.log(wide / narrow))))


@dataclass(frozen=True, eq=False)
class Near:
    """A claim about a box N around the plan alone, and everything proved again under it.

    model: of N alone. answer: the `Answer` solved again with it; None when its tube has no claim.
    share: exact, of K that N takes. proved: the largest box found in N of plans from the start, all
    proved safe under the local tube; None for none. widths: the tubes compared on N.
    """

    model: TrajectoryModel
    answer: Any
    share: Fraction
    proved: SafeBox | None
    widths: Narrowing
    look: Look

    @property
    def held(self) -> Fraction:
        """Exact share of N that the proved box takes; 0 for none."""
        return Fraction(0) if self.proved is None else self.proved.share

    def risk(self) -> Risk | NoStatement:
        """P(the run leaves the local tube) for k uniform on the proved box: eps over its share of
        N. On it every run inside the tube succeeds. [T5, T23]
        """
        if self.proved is None:
            return NoStatement("no box around the plan was proved safe under the local tube")
        return self.model.claim.risk(share=self.held)

    @property
    def is_narrower(self) -> bool:
        """Whether the local claim gives anything: at the end or on the way."""
        return max(self.widths.times_end, self.widths.times_path) >= NARROWER

    def statement(self) -> str:
        """The sentence (D ii)."""
        claim = self.model.claim
        domain = self.model.domain
        names = self.model.labels.k
        sides = " x ".join(
            f"{name} in [{lo:.6g}, {hi:.6g}]"
            for name, lo, hi in zip(names, domain.lo, domain.hi, strict=True)
        )
        where = f"k in N = {sides}, {100 * float(self.share):.2g} % of K"
        if not claim.tube.claimed.any():
            return f"Near it: {where}. {claim.statement()}"
        look = f" (look {self.look.number} of {self.look.planned})" if self.look.planned > 1 else ""
        lines = [
            f"Near it: {where}. With confidence {rounded_down(1 - claim.delta, 10)}{look} over "
            f"{claim.n:,} fresh runs made on N alone after N was chosen, a new run with k uniform "
            f"on N leaves the local tube with probability at most {rounded_up(claim.eps, 10)}.",
            self._about_width(),
        ]
        risk = self.risk()
        if isinstance(risk, NoStatement):
            lines.append(f"Of driving near this plan: no statement, since {risk.reason}.")
        else:
            held = "all" if self.held == 1 else f"{rounded_down(100 * self.held, 3)} %"
            lines.append(
                f"From this start every k of a box S that takes {held} of N is proved safe under "
                "the local tube. Driven with k uniform on S, the run fails with probability at "
                f"most {rounded_up(risk.bound)}."
            )
        return " ".join(lines)

    def _about_width(self) -> str:
        times = self.widths.times_end
        on_the_way = self.widths.times_path
        if not self.is_narrower:
            return (
                "The local tube is NOT narrower than the one over all of K "
                f"({_times(times)} at the end, {_times(on_the_way)} on the way): this claim gains "
                "nothing but a law of k near the plan."
            )
        return (
            f"The local tube is narrower than the one over all of K by a factor of {_times(times)} "
            f"at the end and {_times(on_the_way)} on the way."
        )


def _times(factor: float) -> str:
    return "infinity" if np.isinf(factor) else rounded_down(factor)
