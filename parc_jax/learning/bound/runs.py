"""Where the runs behind claims come from: a system that can be run again, or the past."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import jax

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.forecast import Forecast


class Runs:
    """Where the runs behind claims come from: by themselves none."""

    def further(self, n: int) -> Iterable[RolloutBatch]:
        """n runs for the profile."""
        return ()

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """n runs that nothing has seen."""
        return ()


@dataclass(frozen=True, eq=False)
class SystemRuns(Runs):
    """Runs of a black box from the streams of `key`. first_row: of the further runs, behind the
    training ones. path: keeps finished chunks. quiet: no bars. forecast: of the cost of all.
    """

    system: object
    key: jax.Array
    first_row: int
    path: Path | None
    quiet: bool
    forecast: Forecast | None = None

    def further(self, n: int) -> Iterable[RolloutBatch]:
        """The TRAIN stream behind the training runs."""
        return self._stream(n, Stage.TRAIN, "profile", self.first_row)

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """The BOUND stream."""
        return self._stream(n, Stage.BOUND, "fresh", 0)

    def _stream(self, n: int, stage: Stage, name: str, first_row: int):
        path = None if self.path is None else Path(self.path) / name
        options = {"path": path, "quiet": self.quiet, "forecast": self.forecast}
        return stream_rollouts(self.system, self.key, n, stage, first_row=first_row, **options)


@dataclass(frozen=True, eq=False)
class RecordedRuns(Runs):
    """Runs of the past, unseen by training: nothing can be run again."""

    held: RolloutBatch

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """All of them, whatever was asked for."""
        return (self.held,)


@dataclass(frozen=True, eq=False)
class HeldRuns(Runs):
    """Runs of a system that were simulated before: several claims that are to be compared, each on
    its own, use the same.
    """

    held: RolloutBatch
    unseen: RolloutBatch

    def further(self, n: int) -> Iterable[RolloutBatch]:
        """The first n that are held."""
        return (self.held.select(slice(0, n)),)

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """The first n that nothing has seen. Raises InputError for fewer."""
        if self.unseen.n < n:
            raise InputError(f"runs: expected at least {n:,} fresh ones; got {self.unseen.n:,}.")
        return (self.unseen.select(slice(0, n)),)
