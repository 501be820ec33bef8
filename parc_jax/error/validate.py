"""Testing the final choice itself: fresh runs, one environment, no shape. [T6]"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import jax
import numpy as np

from parc_jax.error.counts import as_probability
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import stream_rollouts

_OUTWARD = 1 + 1e-9  # rounding of the beta quantile


@dataclass(frozen=True)
class Validation:
    """What n fresh runs of a frozen choice show. P(failure) <= eps with confidence 1 - delta, for this environment."""

    n: int
    failures: int
    eps: Fraction
    delta: Fraction
    looks: int
    law: str

    def statement(self) -> str:
        """The result as a sentence."""
        return (
            f"{self.failures} of {self.n:,} fresh runs of the frozen choice failed: with confidence "
            f"{float(1 - self.delta):.10g}, it fails in this environment with probability at most "
            f"{float(self.eps):.4g}, for runs from {self.law}."
        )


def validate_choice(
    system,
    key: jax.Array,
    k,
    failed: Callable[[RolloutBatch], np.ndarray],
    n: int = 300,
    delta=1e-3,
    looks=1,
    quiet=True,
) -> Validation:
    """Run the final choice n times and bound its probability of failure (Clopper-Pearson). [T6]

    k: the choice: one k (n_k,), rows (n, n_k) drawn from a certified set, or a function key -> k. It must be frozen
    before
    this is called. failed: batch -> (n,) bool, True where the run missed the goal or touched something; a run with NaN
    counts as failed whatever it says. looks: times a choice is tested in all; each look gets delta / looks.
    Uses the VALIDATE stream of `key`. For a system without disturbance and one k, one run decides. Raises InputError.
    """
    delta = as_probability("delta", delta)
    if looks < 1:
        raise InputError(f"validate_choice: expected looks >= 1; got {looks}.")
    failures, law = 0, ""
    for batch in stream_rollouts(system, key, n, Stage.VALIDATE, k=k, quiet=quiet):
        failures += int((np.asarray(failed(batch), bool) | batch.failed).sum())
        law = batch.law.describe()
    return Validation(n, failures, clopper_pearson(failures, n, float(delta / looks)), delta, looks, law)


def clopper_pearson(failures: int, n: int, delta: float) -> Fraction:
    """Upper confidence bound, rounded up, on a probability: `failures` in n trials. 1 - delta^(1/n) for none. [T6]"""
    from scipy.stats import beta

    if not 0 <= failures <= n or n < 1:
        raise InputError(f"clopper_pearson: expected 0 <= failures <= n, n >= 1; got {failures} of {n}.")
    if failures == n:
        return Fraction(1)
    return min(Fraction(1), Fraction(float(beta.isf(delta, failures + 1, n - failures)) * _OUTWARD))
