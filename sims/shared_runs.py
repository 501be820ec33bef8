"""Runs simulated once and shared by claims that are compared."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from parc_jax.common.errors import InputError
from parc_jax.learning.bound.pipeline import HeldRuns
from parc_jax.learning.runs.batch import RolloutBatch


@dataclass(frozen=True, eq=False)
class SharedRuns(HeldRuns):
    """A calibration set, of which each claim takes as many as it needs. held: further runs of the
    same system, for error shapes.
    """

    held: RolloutBatch

    def further(self, n: int) -> Iterable[RolloutBatch]:
        """The first n of `held`."""
        return (self.held.select(slice(0, n)),)

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """The first n of the calibration set. Raises InputError for fewer."""
        if self.unseen.n < n:
            raise InputError(f"runs: expected at least {n:,} fresh ones; got {self.unseen.n:,}.")
        # so many as the claim needs, and no other was looked at: they are all
        return (replace(self.unseen.select(slice(0, n)), source=None),)
