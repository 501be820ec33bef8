"""Watching a claim at run time: bets against it that ring when they won too much to be luck."""

from dataclasses import dataclass, replace

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.premises import agree
from parc_jax.common.spelling import rounded_up
from parc_jax.learning.bound.claim import ErrorClaim, check_network
from parc_jax.learning.bound.measure import allowance, by_chunk
from parc_jax.learning.bound.risk import NoStatement
from parc_jax.learning.bound.score import sizes
from parc_jax.learning.labels import plain_k
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.groups import worst_by_group
from parc_jax.learning.runs.law import LOG

_BETS = 16  # alternatives, log-spaced from just above the claimed rate to one half


@dataclass(frozen=True, eq=False)
class Monitor:
    """An e-process against "runs leave the tube with probability <= rate". Make it with `monitor`.

    log_wealth: (bets,) logarithm of the wealth of each bet. seen, left: runs observed, runs outside
    the tube. peak: largest e-value so far. alpha: if the claim is true, the alarm ever rings with
    probability <= alpha, however long one watches.
    """

    claim: ErrorClaim
    net: ReLUNetwork
    rate: float
    alpha: float
    bets: np.ndarray
    log_wealth: np.ndarray
    seen: int = 0
    left: int = 0
    peak: float = 1.0

    @property
    def e_value(self) -> float:
        """Mean wealth of the bets; under a true claim its expectation never exceeds one. [T32]"""
        top = self.log_wealth.max()
        return float(np.exp(min(700.0, top)) * np.exp(self.log_wealth - top).mean())

    @property
    def alarm(self) -> bool:
        """True when the claim is refuted at level alpha, for good: the largest wealth counts."""
        return bool(self.peak >= 1.0 / self.alpha)

    def observe(self, batch: RolloutBatch) -> "Monitor":
        """The monitor after the runs of the batch, one by one in order. A failed run has left the
        tube; a group of runs counts as one, which has left when one of them has.
        """
        state = self
        left = ~inside_tube(self.claim, self.net, batch)
        for outside in worst_by_group(left, batch.groups):
            state = state.bet(bool(outside))
        return state

    def bet(self, outside: bool) -> "Monitor":
        """The monitor after one run that stayed inside or left the tube."""
        if outside:
            gain = np.log(self.bets / self.rate)
        else:
            gain = np.log1p(-self.bets) - np.log1p(-self.rate)
        wealth = self.log_wealth + gain
        after = replace(self, log_wealth=wealth, seen=self.seen + 1, left=self.left + int(outside))
        return replace(after, peak=max(self.peak, after.e_value))


def monitor(claim: ErrorClaim, net: ReLUNetwork, alpha: float = 1e-3, **law) -> Monitor:
    """A fresh monitor of a claim. law: how the k that are driven are drawn, as in
    `ErrorClaim.risk`; by default as those of the claim's own runs.

    Each bet is a likelihood ratio of a fixed larger rate against the claimed one: its wealth is a
    supermartingale whenever every run, given the past, leaves the tube with probability <= rate.
    Raises InputError when the claim has no rate.
    """
    risk = claim.risk(**law or {"share": 1.0})
    if isinstance(risk, NoStatement):
        raise InputError(f"monitor: expected a claim with a probability; {risk.reason}.")
    rate = max(float(risk.bound), 1e-9)
    if rate >= 0.5:
        raise InputError(
            f"monitor: expected a claimed rate below 1/2; got {rounded_up(rate, 3)}. There is "
            "nothing to refute."
        )
    bets = np.geomspace(1.5 * rate, 0.75, _BETS)
    return Monitor(claim, net, rate, float(alpha), bets, np.zeros(_BETS))


def inside_tube(claim: ErrorClaim, net: ReLUNetwork, batch: RolloutBatch) -> np.ndarray:
    """(n,) bool: runs that the tube holds at all records, in every bin they touch, as calibration
    counts.
    """
    check_network(claim, net)
    _require_same_robot(claim, batch)
    tube = claim.tube
    slack = allowance(net, batch.domain, tube.layout)
    between, _ = tube.halves_around(claim.intersample or 0.0, 0.0)
    held = (tube.halves[0] - between, tube.halves[1])

    def inside(rows: np.ndarray):
        runs = batch.k[rows], batch.p[rows], batch.q[rows]
        fits = np.ones(len(rows), bool)
        for bins in tube.bins_of(batch.k[rows]).T:
            needed = sizes(net, slack, tube, bins, *runs)
            for size, half in zip(needed, held, strict=True):
                fits &= (size <= half[bins]).reshape(len(rows), -1).all(axis=1)
        return fits

    return by_chunk(batch.n, inside)


def _require_same_robot(claim: ErrorClaim, batch: RolloutBatch) -> None:
    """Refuse runs that the claim says nothing of. A log states neither the name of its robot nor
    what it declares, and may not name its parameters. Raises InputError.
    """
    about, runs = claim.subject, batch.subject
    free = {"K"}  # of another box, but the same in every run:
    if any(one.system.startswith(LOG) for one in (about, runs)):
        free |= {"system", "rotation", "given"}
    if any(plain_k(one.labels) for one in (about, runs)):
        free.add("parameters")
    agree(
        f"{batch.name}: runs of the claim about {about.system}",
        about.premises,
        runs.premises,
        free=free,
    )
    outside = ~about.domain.contains(batch.k)
    if outside.any():
        raise InputError(
            f"{batch.name}: expected k within the K of the claim; {int(outside.sum())} of "
            f"{batch.n} runs are outside, the first is row {batch.rows[np.argmax(outside)]}. The "
            "claim says nothing of them: leave them out."
        )
