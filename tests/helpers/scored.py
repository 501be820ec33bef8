"""Scores of fresh runs, never more than a few chunks of them held."""

from parc_jax.common.keys import Stage
from parc_jax.learning.bound.measure import Scores, scores_of
from parc_jax.learning.runs.collect import stream_rollouts


def score_system(
    net, system, key, profile, n: int, stage: Stage = Stage.BOUND, **options
) -> Scores:
    """Scores of n runs of a stage; options as of `collect`."""
    return scores_of(net, profile, stream_rollouts(system, key, n, stage, **options))


def score_batch(net, batch, profile) -> Scores:
    """Scores of runs held in memory."""
    return scores_of(net, profile, [batch])
