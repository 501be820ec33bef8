"""Testing the final choice itself: fresh runs, one environment, no profile. [T6]"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import jax
import numpy as np

from parc_jax.claim.counts import as_probability, check_count, clopper_pearson
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import stream_rollouts
from parc_jax.rollout.user_code import blamed
from parc_jax.spelling import rounded_down, rounded_up


@dataclass(frozen=True)
class Validation:
    """What n fresh runs of a frozen choice show. P(failure) <= eps with confidence 1 - delta, for
    this environment.
    """

    n: int
    failures: int
    eps: Fraction
    delta: Fraction
    looks: int
    law: str

    def statement(self) -> str:
        """The result as a sentence."""
        return (
            f"{self.failures} of {self.n:,} fresh runs of the frozen choice failed: with "
            f"confidence {rounded_down(1 - self.delta, 10)}, it fails in this environment with "
            f"probability at most {rounded_up(self.eps, 4)}, for runs from {self.law}."
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

    k: the choice: one k (n_k,), rows (n, n_k) drawn from a certified set, or a function key -> k.
    It must be frozen before
    this is called. failed: batch -> (n,) bool, True where the run missed the goal or touched
    something; a run with NaN counts as failed whatever it says. looks: times a choice is tested in
    all; each look gets delta / looks. Uses the VALIDATE stream of `key`. Raises InputError.
    """
    delta = as_probability("delta", delta)
    check_count("looks", looks, 1, "1 for a choice that is tested once")
    failures, law = 0, ""
    for batch in stream_rollouts(system, key, n, Stage.VALIDATE, k=k, quiet=quiet):
        with blamed("validate_choice: expected failed(batch) to run"):
            verdicts = np.asarray(failed(batch))
        if verdicts.shape != (batch.n,) or verdicts.dtype != bool:
            raise InputError(
                f"validate_choice: expected failed(batch) to say True or False for each of "
                f"{batch.n} runs; got {verdicts.dtype} of shape {verdicts.shape}."
            )
        failures += int((verdicts | batch.failed).sum())
        law = batch.law.describe()
    return Validation(
        n, failures, clopper_pearson(failures, n, float(delta / looks)), delta, looks, law
    )
