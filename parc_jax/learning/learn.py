"""From a black box, or from recorded runs, to a model: runs, a network, a bound of its error."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, as_key, folded, key_data, stream
from parc_jax.common.options import part_of, refuse_unused
from parc_jax.common.spelling import counted
from parc_jax.learning.bound.counts import (
    MOST,
    advised_discards,
    as_probability,
    required_runs,
    width_needed,
)
from parc_jax.learning.bound.fresh import SHAPE
from parc_jax.learning.bound.pipeline import (
    NEW_RUNS,
    RECORDED,
    STORED,
    HeldRuns,
    SystemRuns,
    bound_errors,
    learn_profile,
    runs_ahead,
)
from parc_jax.learning.bound.settings import BoundSettings, ModelBound
from parc_jax.learning.bound.start_gap import StartTrial, try_starts
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import Training, fit
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.prior.teach import taught
from parc_jax.learning.runs.batch import RolloutBatch, refitted
from parc_jax.learning.runs.collect import seed_of, stream_rollouts
from parc_jax.learning.runs.groups import worst_by_group
from parc_jax.learning.runs.joined import concatenate
from parc_jax.learning.system import System, check_system

FIRST_EPS = Fraction(1, 100)  # of the first bound: 688 runs at a delta of 1e-3
HOLDOUT, HOLDOUT_WITH_PRIOR = 0.4, 0.5  # of recorded runs: a prior needs fewer to learn from
LONG_S = 10.0  # [s] runs that take longer are announced
PACED_S = 2.0  # [s] of runs that tell their pace
Watch = Callable[[str], AbstractContextManager]  # entered for each stage, by its name
OVER_K = ModelBound()


@dataclass(frozen=True)
class Learning(Training):
    """Settings of `learn`: the network, and the bound of its error."""

    bound: ModelBound = OVER_K
    """The bound of the model's error."""
    plant: str | None = None
    """Plant of the simulator for training and bound, e.g. mjx or ode; the replay of a study is of
    the system's own, unless the shell names one. Default: the system's own."""
    body: str | None = None
    """Body of the robot, which decides the reference points, e.g. rectangle or disc. Default: the
    system's own."""

    @property
    def claims(self) -> BoundSettings:
        """The settings for `bound_error`: one claim over K, or one in every block."""
        claims = ("one",) if self.bound.blocks is None else ("bins",)
        return BoundSettings(**part_of(self.bound, ModelBound), claims=claims)


# a prior runs without noise, at no cost
WITH_PRIOR = Learning(rollouts=8000, hidden=(24, 24), seeds=2)


class Learned(NamedTuple):
    """A model and its making.

    train: training runs. prior: a sentence on the prior and discards it advised; None without one.
    """

    model: TrajectoryModel
    train: RolloutBatch
    prior: str | None = None


def learn(
    source: System | RolloutBatch,
    key: jax.Array,
    prior: str | System | None = None,
    settings: Learning | None = None,
    *,
    holdout: float | RolloutBatch | None = None,
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
    settings: a record `Learning`, or `options` of it and of its bound by name, such as eps=1e-2 or
        hidden=(16, 16). With a prior 8,000 rollouts of it, 2 x 24 neurons, 2 seeds by default; and
        where held-out runs are too few for eps, discard="most" is the number advised by the
        training runs, fixed before a held-out one is scored [T2].
    holdout: share of the recorded runs, or of their groups, that sizes the tube; 0.4 by default,
        0.5 with a prior. Or the runs that do, as `split` set them aside.
    path: a folder for finished chunks of rollouts, from which a killed call continues. quiet: no
    bars. Returns the model. Raises InputError, also for a start that matters more than `gap`.
    """
    settings = (settings or (Learning() if prior is None else WITH_PRIOR)).replace(**options)
    if isinstance(source, RolloutBatch):
        refuse_unused(settings.bound, NEW_RUNS, RECORDED, options)
        refuse_unused(settings, ("rollouts",) * (prior is None), RECORDED, options)
    for name, asked in (("plant", settings.plant), ("body", settings.body)):
        if asked not in (None, getattr(source, name, None)):
            raise InputError(
                f"learn: expected {name}=None, or the one that the source itself names; got "
                f"{asked!r:.40}. Build the system with it: pj.learn(system({name}=...), key)."
            )
    return learn_report(source, key, settings, prior, holdout=holdout, path=path, quiet=quiet).model


def learn_report(
    source: System | RolloutBatch,
    key: jax.Array,
    settings: Learning,
    prior: str | System | None = None,
    *,
    holdout: float | RolloutBatch | None = None,
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
        return _from_system(source, key, settings, path and Path(path), quiet, watch, first)
    default = HOLDOUT if prior is None else HOLDOUT_WITH_PRIOR
    if isinstance(holdout, RolloutBatch):
        train, held = refitted(source, holdout)
    else:
        # the last word of a key is the shell's seed: one split for both doors
        seed = int(key_data(key).ravel()[-1])
        train, held = source.split(default if holdout is None else holdout, seed)
    # recorded runs cannot be started elsewhere
    start = StartTrial(settings.bound.gap, None)
    lesson, said, profile, seen = train, None, None, []
    if prior is not None:
        lesson, said, usual, discard, seen = _lesson(prior, train, held, settings, key)
    with watch("training"):
        net = fit_network(lesson, settings, key)
    if prior is not None:
        # one bin: few runs cannot choose where to cut K
        bins = (1,) * train.n_k if settings.bound.bins is None else settings.bound.bins
        profile = learn_profile(net, usual, (), bins, shape=settings.bound.shape)
        settings = settings.replace(discard=discard)
    about: dict[str, Any] = {"profile": profile, "seen": seen, "watch": watch}
    claim = bound_errors(net, HeldRuns(held), train, settings.claims, start, **about)[0]
    model = trajectory_model(net, claim)
    kept = held if held.seed is None else None  # runs of a seed can be made anew
    return Learned(model.replace(held=kept), train, said)


def fit_network(train: RolloutBatch, settings: Learning, key: jax.Array) -> ReLUNetwork:
    """The network of training runs, from the FIT stream of `key`."""
    return fit(train, settings, folded(stream(key, Stage.FIT), 0))


def _from_system(
    system: System,
    key: jax.Array,
    settings: Learning,
    path: Path | None,
    quiet: bool,
    watch: Watch,
    first: Callable[[TrajectoryModel], None] | None,
) -> Learned:
    with watch("other starts"):
        start = try_starts(system, key, settings.bound.gap)
    with watch("training rollouts"):
        options = {"path": path and path / "training", "quiet": quiet, "dtype": STORED}
        chunks = stream_rollouts(system, key, settings.rollouts, Stage.TRAIN, **options)
        bounds = [settings.claims, _first_bound(settings)] if first else [settings.claims]
        ahead = settings.rollouts + sum(map(runs_ahead, bounds))
        paced = chunks if quiet else _announced(chunks, system.name, ahead)
        train = concatenate(paced, settings.rollouts)
    with watch("training"):
        net = fit_network(train, settings, key)
    if first is not None:
        # a separate stream and folder: the next bound loses none of its fresh runs
        few = stream(key, Stage.FIRST), train.n, path and path / "first"
        with watch("first claim"):
            runs = SystemRuns(system, *few, quiet)
            claim = bound_errors(net, runs, train, _first_bound(settings), start)[0]
            model = trajectory_model(net, claim)
        first(model)
        # the same bins: the query of this model has then compiled that of the next one
        settings = settings.replace(bins=model.tube.edges)
    runs = SystemRuns(system, key, train.n, path, quiet)
    claim = bound_errors(net, runs, train, settings.claims, start, watch=watch)[0]
    return Learned(trajectory_model(net, claim), train)


def _announced(chunks: Iterator[RolloutBatch], name: str, ahead: int) -> Iterator[RolloutBatch]:
    """The chunks of the first of so many runs ahead. How long the rest of these takes, if that is
    long, is printed as soon as there is a pace.
    """
    began, timed, waits = time.monotonic(), 0, True
    for i, chunk in enumerate(chunks):
        ahead, timed = ahead - chunk.n, timed + chunk.n
        seconds = time.monotonic() - began
        if waits and i and seconds > PACED_S:
            _announce(name, ahead, seconds / timed)
            waits = False
        elif i == 0:
            whole = seconds / timed
            began, timed = time.monotonic(), 0  # what is compiled for the first chunk is no pace
        yield chunk
    if waits:
        _announce(name, ahead, (time.monotonic() - began) / timed if timed else whole)


def _announce(name: str, runs: int, seconds_per_run: float) -> None:
    if runs * seconds_per_run > LONG_S:
        from tqdm import tqdm

        spelled = tqdm.format_interval(runs * seconds_per_run)
        tqdm.write(f"{name}: {runs:,} more runs, {spelled} at this pace", file=sys.stderr)


def _first_bound(settings: Learning) -> BoundSettings:
    eps = max(as_probability("eps", settings.bound.eps), FIRST_EPS)
    bound = settings.claims.replace(eps=eps, fresh=None, profile_runs=0)
    return bound.replace(claims=("one",), blocks=None)


def _lesson(
    prior: str | System, train: RolloutBatch, held: RolloutBatch, settings: Learning, key: jax.Array
) -> tuple[RolloutBatch, str, RolloutBatch, int | str, list]:
    """Runs of a corrected prior, a sentence about it, the training runs that give the error shape,
    the number of held-out ones to discard, and the ledger of the simulator's runs. [T2]

    A discarded run should not widen the shape, so the training runs of that size leave it.
    """
    lesson, seen = taught(prior, train, settings.rollouts, key), [[SHAPE, "", None, None, []]]
    if lesson.ran:
        source = [prior.name, list(seed_of(key)), int(Stage.PRIOR)]
        seen.append(["prior", *source, [[0, lesson.ran - 1]]])
    n, bound, delta = held.recordings, settings.bound, float(settings.bound.delta)
    enough = n >= required_runs(float(bound.eps), delta)
    if bound.discard != MOST or bound.blocks is not None or enough:
        return lesson.runs, lesson.said, lesson.unseen, bound.discard, seen
    # from the training runs alone: the number is fixed before a held-out run is scored [T2]
    sizes = worst_by_group(lesson.size, train.groups)
    discard = advised_discards(sizes, n, delta)
    near = lesson.size[np.isfinite(lesson.size)] <= width_needed(sizes, n, discard)
    left = counted(discard, f"held-out {'run' if held.groups is None else 'recording'}")
    said = f"{lesson.said}; {left} left outside, a number chosen before one was seen"
    return lesson.runs, said, lesson.unseen.select(near), discard, seen
