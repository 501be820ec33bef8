"""From a black box to models: rollouts, networks, for each the honest claims and the published."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.keys import Stage, stream
from parc_jax.common.options import part_of
from parc_jax.common.stopwatch import Stopwatch
from parc_jax.learning.bound.asked import BoundSettings
from parc_jax.learning.bound.claim import ErrorClaim, on_bins
from parc_jax.learning.bound.counts import as_probability
from parc_jax.learning.bound.declared import assumed_claim
from parc_jax.learning.bound.pipeline import (
    RecordedRuns,
    Runs,
    SystemRuns,
    advice,
    bound_errors,
    runs_ahead,
)
from parc_jax.learning.bound.start_gap import StartTrial, try_starts
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import fit
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch, concatenate
from parc_jax.learning.runs.chunks import Forecast
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.settings import Learning, name_of

FIRST_EPS = Fraction(1, 100)  # of the first claim: 688 runs at a delta of 1e-3


class NetworkModels(NamedTuple):
    """One network with its claims. name: "PARC" or its widths. claimed: by study.claims."""

    name: str
    assumed: TrajectoryModel
    claimed: list[TrajectoryModel]

    @property
    def honest(self) -> TrajectoryModel:
        """The model of the first claim."""
        return self.claimed[0]


class Learned(NamedTuple):
    """Everything learned: the main network first, then the others. start: what is known of the
    start's influence. prior: from what the networks were trained instead of the runs themselves,
    and how many runs were therefore discarded; None where there was none.
    """

    networks: list[NetworkModels]
    train: RolloutBatch
    start: StartTrial
    prior: str | None = None

    @property
    def main(self) -> TrajectoryModel:
        """The model whose answer is returned."""
        return self.networks[0].honest


def learn(
    system,
    study: Learning,
    key: jax.Array,
    watch: Stopwatch,
    work: Path,
    quiet: bool,
    first: Callable[[TrajectoryModel], None] | None = None,
) -> Learned:
    """Roll out, train every network, claim every tube. Finished chunks stay in `work`: whoever
    asked deletes them, once the result is on disk.

    The same fresh runs serve all networks and claims: delta is split over them, so all hold
    together. [T1] first: called with the main network under a claim of few runs, before the many.
    Raises InputError, also for a system whose start matters more than study.gap.
    """
    forecast = forecast_of(study, quiet, early=first is not None)
    with watch("other starts"):
        start = try_starts(system, key, study.gap)
    with watch("training rollouts"):
        path = work / "training"
        chunks = stream_rollouts(
            system, key, study.rollouts, Stage.TRAIN, path=path, quiet=quiet, forecast=forecast
        )
        train = concatenate(chunks, study.rollouts)
    runs = SystemRuns(system, key, train.n, work, quiet, forecast)
    return _learned(train, runs, start, study, key, watch, first)


def forecast_of(study: Learning, quiet: bool = False, early: bool = False) -> Forecast:
    """The cost of all runs before the replay, in words of the shell; early: a first claim's too."""
    n_nets = len(study.networks)
    ahead = study.rollouts + runs_ahead(study, n_nets)
    if early:
        ahead += runs_ahead(_first_asked(study), 1)
    return Forecast(ahead, advice(study, n_nets, "--eps "), quiet)


def learn_recorded(
    train: RolloutBatch, held: RolloutBatch, study: Learning, key: jax.Array
) -> Learned:
    """The same from recorded runs: `held` sizes the tubes, and nothing can be run again."""
    start = StartTrial(study.gap, None)
    return _learned(train, RecordedRuns(held), start, study, key, Stopwatch())


def _learned(
    train: RolloutBatch,
    runs: Runs,
    start: StartTrial,
    study: Learning,
    key,
    watch: Stopwatch,
    first: Callable[[TrajectoryModel], None] | None = None,
) -> Learned:
    """Networks from the training runs, claims from the others."""
    with watch("training"):
        nets = networks(train, study, key)
    if first is not None:
        with watch("first claim"):
            model = first_model(nets[0], runs, train, study, start)
        first(model)
        # the same bins, so that what this model's query compiled serves the next one's
        study = study.replace(bins=model.tube.edges)
    claims = bound_errors(nets, runs, train, study, start, watch=watch)
    with watch("claims"):
        found = models(nets, claims, train, study)
    return Learned(found, train, start)


def first_model(
    net: ReLUNetwork, runs: SystemRuns, train: RolloutBatch, study: Learning, start: StartTrial
) -> TrajectoryModel:
    """A network under a claim of few runs, of a stream of their own: the next one loses nothing."""
    few = _first_asked(study)
    own = None if runs.path is None else runs.path / "first"
    apart = replace(runs, key=stream(runs.key, Stage.FIRST), path=own)
    return trajectory_model(net, bound_errors([net], apart, train, few, start)[0][0])


def _first_asked(study: Learning) -> BoundSettings:
    """What a first claim is to say."""
    eps = max(as_probability("eps", study.eps), FIRST_EPS)
    asked = BoundSettings(**part_of(study, BoundSettings))
    asked = asked.replace(eps=eps, fresh=None, profile_runs=0, looks=1)
    return asked.replace(claims=("one",), blocks=None, even=False)


def models(
    nets: list[ReLUNetwork], claims: list[list[ErrorClaim]], train: RolloutBatch, study: Learning
) -> list[NetworkModels]:
    """Every network with each of its claims, and with the published one about its training runs."""
    edges = claims[0][0].tube.edges
    found = []
    for hidden, net, honest in zip(study.networks, nets, claims, strict=True):
        published = assumed_claim(net, train, edges if "bins" in study.claims else None)
        assumed, *claimed = (
            trajectory_model(net, claim) for claim in (on_bins(published, edges), *honest)
        )
        found.append(NetworkModels(name_of(hidden), assumed, claimed))
    return found


def networks(train: RolloutBatch, study: Learning, key: jax.Array) -> list[ReLUNetwork]:
    """Trained networks in the order of study.networks; PARC as published: affine least squares."""
    key = stream(key, Stage.FIT)
    asked = enumerate(study.replace(hidden=hidden) for hidden in study.networks)
    return [fit(train, own, jax.random.fold_in(key, number)) for number, own in asked]


def final_error(model: TrajectoryModel) -> np.ndarray:
    """(n_c + n_q,) median half widths at the end over bins with a claim; infinite for none."""
    final = model.tube.final[model.tube.claimed]
    return np.median(final, axis=0) if len(final) else np.full(model.n_c + model.n_q, np.inf)
