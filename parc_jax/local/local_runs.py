"""Runs with k uniform on a box N inside K: training, shape and holdout of a claim about N alone."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

from parc_jax.base.keys import Stage
from parc_jax.claim.runs import Runs
from parc_jax.rollout.batch import RolloutBatch, concatenate
from parc_jax.rollout.collect import stream_rollouts
from parc_jax.rollout.law import BOX, LawSpec, law_of, law_spec
from parc_jax.sets.box import Box


@dataclass(frozen=True, eq=False)
class LocalRuns(Runs):
    """Runs of a system on a box, from the streams of a key of their own: the TRAIN stream first for
    the network, then for the shape; the BOUND stream for the claim. No search: it could only widen
    the tube.

    The system itself keeps its K, so nothing is compiled again. trained: training rows, behind
    which the runs for the shape begin.
    """

    system: object
    key: jax.Array
    box: Box
    trained: int
    quiet: bool = True

    def train(self) -> RolloutBatch:
        """The training runs."""
        return concatenate(self._stream(self.trained, Stage.TRAIN, 0), self.trained)

    def further(self, n: int) -> Iterable[RolloutBatch]:
        """Runs for the shape of the tube, behind the training ones."""
        return self._stream(n, Stage.TRAIN, self.trained)

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """Runs that nothing has seen."""
        return self._stream(n, Stage.BOUND, 0)

    def _stream(self, n: int, stage: Stage, first_row: int) -> Iterator[RolloutBatch]:
        def near(key: jax.Array):
            lo = jnp.asarray(self.box.lo, jnp.float64)  # in here, where float64 is on
            hi = jnp.asarray(self.box.hi, jnp.float64)
            u = jax.random.uniform(key, lo.shape, lo.dtype)
            return jnp.clip(lo + u * (hi - lo), lo, hi)

        whole = law_of(self.system)
        runs = stream_rollouts(
            self.system, self.key, n, stage, k=near, first_row=first_row, quiet=self.quiet
        )
        for batch in runs:
            yield on_box(batch, whole, self.box)


def on_box(runs: RolloutBatch, whole: LawSpec, box: Box) -> RolloutBatch:
    """Runs with k uniform on a box N inside K, told so. whole: the law on K."""
    law = law_spec(whole.generator, box, "uniform", {**dict(whole.parameters), BOX: "N"})
    return replace(runs, domain=box, law=law)
