"""From a black box, or from recorded runs, to a model: training runs, a network, a bound of its
error.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, as_key, key_data, stream
from parc_jax.common.options import part_of
from parc_jax.common.spelling import counted
from parc_jax.learning.bound.asked import BoundSettings, ModelBound
from parc_jax.learning.bound.counts import (
    MOST,
    advised_discards,
    as_probability,
    required_runs,
    width_needed,
)
from parc_jax.learning.bound.pipeline import (
    RecordedRuns,
    Runs,
    SystemRuns,
    advice,
    bound_errors,
    learn_profiles,
    runs_ahead,
)
from parc_jax.learning.bound.start_gap import StartTrial, try_starts
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import Training, fit
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.prior.teach import Taught, taught
from parc_jax.learning.runs.batch import RolloutBatch, concatenate, worst_by_group
from parc_jax.learning.runs.chunks import Forecast
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.system import System, check_system

FIRST_EPS = Fraction(1, 100)  # of the first bound: 688 runs at a delta of 1e-3
HOLDOUT, HOLDOUT_WITH_PRIOR = 0.4, 0.5  # of recorded runs: a prior needs fewer to learn from
Watch = Callable[[str], AbstractContextManager]  # entered for each stage, by its name


@dataclass(frozen=True)
class Learning(ModelBound, Training):
    """Settings of `learn`: the network, and the bound of its error."""

    profile_runs: int | None = 0
    plant: str | None = None
    """Plant of the simulator for training and bound, e.g. mjx or ode; the replay of a study is of
    the system's own, unless the shell names one. Default: the system's own."""
    body: str | None = None
    """Body of the robot, which says what points of it are learned, e.g. rectangle or disc. Default:
    the system's own."""

    @property
    def bound(self) -> BoundSettings:
        """The settings for `bound_error`: one claim over K, or one in every block."""
        claims = ("one",) if self.blocks is None else ("bins",)
        return BoundSettings(**part_of(self, ModelBound), claims=claims)


# runs of a prior are without noise, and as many as one likes
WITH_PRIOR = Learning(rollouts=8000, hidden=(24, 24), seeds=2)


class Learned(NamedTuple):
    """A model and its making.

    train: the training runs. start: the tried influence of the start. prior: a sentence about the
    prior and the discards it advised; None without a prior.
    """

    model: TrajectoryModel
    train: RolloutBatch
    start: StartTrial
    prior: str | None = None


def learn(
    source: System | RolloutBatch,
    key: jax.Array,
    prior: str | System | None = None,
    settings: Learning | None = None,
    *,
    holdout: float | None = None,
    path: str | Path | None = None,
    quiet: bool = False,
    **options,
) -> TrajectoryModel:
    """Learn a model of a black box, or of recorded runs: `collect`, `train`, `bound_error` and
    `trajectory_model` in one call.

    source: a system, which is run anew; or recorded runs, of which a random share sizes the tube.
    prior: for few recorded runs, the shape of the network's trajectories: "twist" for a rigid body
        in the plane, or a system, such as a simulator, with the time grid, points and goal states
        of the runs and a domain that contains theirs. No bound rests on it: the held-out runs of
        the robot size the tube, however bad it is.
    settings: a record `Learning`, or its `options` by name, such as eps=1e-2 or hidden=(16, 16):
        those of a `Study` without its query. With a prior 8,000 rollouts of it, 2 x 24 neurons and
        2 seeds by default; and where the held-out runs are too few for eps, discard="most" is the
        number advised by the training runs, fixed before a held-out one is scored [T2].
    holdout: share of the recorded runs, or of their groups, that sizes the tube; 0.4 by default,
        0.5 with a prior.
    path: a folder for finished chunks of rollouts, from which a killed call continues.
    quiet: no progress bars.
    Returns the model. Raises InputError, also for a system whose start matters more than `gap`.
    """
    default = Learning() if prior is None else WITH_PRIOR
    settings = (settings or default).replace(**options)
    return learn_report(source, key, settings, prior, holdout=holdout, path=path, quiet=quiet).model


def learn_report(
    source: System | RolloutBatch,
    key: jax.Array,
    settings: Learning,
    prior: str | System | None = None,
    *,
    holdout: float | None = None,
    path: str | Path | None = None,
    quiet: bool = False,
    watch: Watch = nullcontext,
    first: Callable[[TrajectoryModel], None] | None = None,
) -> Learned:
    """`learn`, with the training runs and two sentences about them.

    watch: entered for each stage, by its name.
    first: called with the network under a bound of few runs, before the many; systems only.
    """
    as_key(key)
    if not isinstance(source, RolloutBatch):
        check_system(source)
        if prior is not None or holdout is not None:
            raise InputError(
                "learn: expected prior and holdout with recorded runs only; got a system, which "
                "can be run as often as needed. Leave them out."
            )
        return _of_system(source, key, settings, path, quiet, watch, first)
    default = HOLDOUT if prior is None else HOLDOUT_WITH_PRIOR
    # the last word of a key is the shell's seed: one split for both doors
    seed = int(key_data(key).ravel()[-1])
    train, held = source.split(default if holdout is None else holdout, seed)
    if prior is None:
        net = _trained(train, settings, key, watch)
        return _bounded(net, RecordedRuns(held), train, settings, watch=watch)
    return _with_prior(prior, train, held, settings, key, watch)


def fit_network(train: RolloutBatch, settings: Learning, key: jax.Array) -> ReLUNetwork:
    """The network of training runs, from the FIT stream of `key`."""
    return fit(train, settings, jax.random.fold_in(stream(key, Stage.FIT), 0))


def forecast_of(settings: Learning, quiet: bool = False, early: bool = False) -> Forecast:
    """The cost of all runs that `learn` makes. early: including those of a first bound."""
    bound = settings.bound
    ahead = settings.rollouts + runs_ahead(bound, 1)
    if early:
        ahead += runs_ahead(_first_bound(settings), 1)
    return Forecast(ahead, advice(bound, 1, "--eps "), quiet)


def _of_system(
    system: System,
    key: jax.Array,
    settings: Learning,
    path: str | Path | None,
    quiet: bool,
    watch: Watch,
    first: Callable[[TrajectoryModel], None] | None,
) -> Learned:
    forecast = forecast_of(settings, quiet, early=first is not None)
    path = None if path is None else Path(path)
    with watch("other starts"):
        start = try_starts(system, key, settings.gap)
    with watch("training rollouts"):
        chunks = stream_rollouts(
            system,
            key,
            settings.rollouts,
            Stage.TRAIN,
            path=path and path / "training",
            quiet=quiet,
            forecast=forecast,
        )
        train = concatenate(chunks, settings.rollouts)
    runs = SystemRuns(system, key, train.n, path, quiet, forecast)
    net = _trained(train, settings, key, watch)
    if first is not None:
        with watch("first claim"):
            model = _first_model(net, runs, train, settings, start)
        first(model)
        # the same bins: the query of this model has then compiled that of the next one
        settings = settings.replace(bins=model.tube.edges)
    return _bounded(net, runs, train, settings, start, watch=watch)


def _trained(train: RolloutBatch, settings: Learning, key: jax.Array, watch: Watch) -> ReLUNetwork:
    with watch("training"):
        return fit_network(train, settings, key)


def _bounded(
    net: ReLUNetwork,
    runs: Runs,
    train: RolloutBatch,
    settings: Learning,
    start: StartTrial | None = None,
    profile: Tube | None = None,
    watch: Watch = nullcontext,
) -> Learned:
    """The network under its bound. start: None for recorded runs, whose start cannot be tried."""
    start = StartTrial(settings.gap, None) if start is None else start
    profiles = None if profile is None else [profile]
    claim = bound_errors([net], runs, train, settings.bound, start, profiles=profiles, watch=watch)[
        0
    ][0]
    return Learned(trajectory_model(net, claim), train, start)


def _first_model(
    net: ReLUNetwork, runs: SystemRuns, train: RolloutBatch, settings: Learning, start: StartTrial
) -> TrajectoryModel:
    """The network under a bound of few runs."""
    # a separate stream and folder: the next bound loses none of its fresh runs
    path = None if runs.path is None else runs.path / "first"
    few = replace(runs, key=stream(runs.key, Stage.FIRST), path=path)
    claim = bound_errors([net], few, train, _first_bound(settings), start)[0][0]
    return trajectory_model(net, claim)


def _first_bound(settings: Learning) -> BoundSettings:
    eps = max(as_probability("eps", settings.eps), FIRST_EPS)
    bound = settings.bound.replace(eps=eps, fresh=None, profile_runs=0)
    return bound.replace(claims=("one",), blocks=None, even=False)


def _with_prior(
    prior: str | System,
    train: RolloutBatch,
    held: RolloutBatch,
    settings: Learning,
    key: jax.Array,
    watch: Watch,
) -> Learned:
    """A network trained on a corrected prior, bounded by held-out runs of the robot. [T2]"""
    lesson = taught(prior, train, settings.rollouts, key)
    net = _trained(lesson.runs, settings, key, watch)
    usual, discard = _usual(lesson, train, held, settings)
    # one bin: few runs cannot choose where to cut K
    bins = (1,) * train.n_k if settings.bins is None else settings.bins
    profile = learn_profiles([net], usual, (), bins, shape=settings.shape)[0]
    sentence = lesson.said
    if discard != settings.discard:
        unit = "run" if held.groups is None else "recording"
        left = counted(discard, f"held-out {unit}")
        sentence = f"{sentence}; {left} left outside, a number chosen before one was seen"
    settings = settings.replace(discard=discard)
    made = _bounded(net, RecordedRuns(held), train, settings, profile=profile, watch=watch)
    return made._replace(prior=sentence)


def _usual(
    lesson: Taught, train: RolloutBatch, held: RolloutBatch, settings: Learning
) -> tuple[RolloutBatch, int | str]:
    """The training runs that give the profile, and the number of held-out ones to discard.

    A discarded run should not widen the profile, so the training runs of that size leave it.
    """
    n = held.n if held.groups is None else len(np.unique(held.groups))
    delta = float(settings.delta)
    enough = n >= required_runs(float(settings.eps), delta)
    if settings.discard != MOST or settings.blocks is not None or enough:
        return lesson.unseen, settings.discard
    # from the training runs alone: the number is fixed before a held-out run is scored [T2]
    sizes = worst_by_group(lesson.size, train.groups)
    discard = advised_discards(sizes, n, delta)
    near = lesson.size[np.isfinite(lesson.size)] <= width_needed(sizes, n, discard)
    return lesson.unseen.select(near), discard
