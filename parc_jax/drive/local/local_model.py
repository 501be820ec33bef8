"""A model of a small box of K: fresh runs on it, a small network, a claim about it alone. [T23]"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, stream
from parc_jax.common.options import part_of
from parc_jax.common.sets.box import Box
from parc_jax.drive.local.almost import nearly_safe
from parc_jax.learning.bound.asked import BoundSettings, Sizing
from parc_jax.learning.bound.claim import ErrorClaim, stand_in
from parc_jax.learning.bound.declared import assumed_claim
from parc_jax.learning.bound.pipeline import Runs, bound_errors, learn_profiles
from parc_jax.learning.bound.start_gap import StartTrial, try_starts
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import Training, fit, fit_tail
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch, concatenate
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.law import BOX, LawSpec, law_of, law_spec
from parc_jax.learning.system import System
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.verdict.scene import scene_of

BINS = 1  # per axis of so small a box: the error hardly ever changes in it
_TRIAL = 2**32 - 1  # number within the DRIVEN stream, behind those of looks and probes


@dataclass(frozen=True)
class Local(Sizing, Training):
    """What a local model is made of: its training, by default an affine map, and its tube."""

    rollouts: int = 4000
    profile_runs: int | None = 6000
    hidden: tuple[int, ...] = ()
    seeds: int = 4
    steps: int = 1500
    share: float = 2e-4
    """Share of K that the box takes."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.share <= 1:
            raise InputError(
                f"local claim: expected a share of K between 0 and 1; got {self.share}."
            )


@dataclass(frozen=True, eq=False)
class LocalRuns(Runs):
    """Runs of a system on a box N inside K, from the streams of a key of their own: TRAIN for the
    network, then, behind `trained` rows, for the shape; BOUND for the claim. The system itself
    keeps its K, so nothing is compiled again.
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


def tried_first(system: System, key: jax.Array, asked: Local) -> StartTrial:
    """What other starts show, before a look is spent or a run made for it. Uses a part of the
    DRIVEN stream of `key` that no look uses. Raises InputError where it is more than asked.gap.
    """
    return try_starts(system, jax.random.fold_in(stream(key, Stage.DRIVEN), _TRIAL), asked.gap)


def local_model(
    system: System,
    start: StartTrial,
    box: Box,
    key: jax.Array,
    delta: Fraction,
    asked: Local,
    quiet: bool,
) -> TrajectoryModel:
    """Learn the system on a box and claim its error there, with confidence 1 - delta. [T1, T23]

    start: of `tried_first`. key: of this look alone, see `fresh_key`. Raises InputError.
    """
    runs = LocalRuns(system, key, box, asked.rollouts, quiet)
    train = runs.train()
    return claimed(runs, train, fit(train, asked, key), delta, asked, start)


def best_claimed(
    system: System,
    start: StartTrial,
    box: Box,
    key: jax.Array,
    delta: Fraction,
    asked: Local,
    shapes: tuple[str, ...],
    problem: Problem,
) -> TrajectoryModel:
    """As `local_model`, with the network and the shape of the tube that leave a problem most room
    by training and shape runs; the holdout sees the chosen one alone, so it is one look. [T1]
    """
    runs = LocalRuns(system, key, box, asked.rollouts)
    train = runs.train()
    further = list(runs.further(asked.profile_runs))
    nets = [fit(train, asked, key)]
    if not asked.hidden:
        nets.append(fit_tail(nets[0], train))
    rng = np.random.default_rng(0)
    tried = []
    for net in nets:
        for shape in shapes:
            profile = learn_profiles([net], train, further, (BINS,) * box.n, shape=shape)[0]
            guess = trajectory_model(net, guessed_claim(net, train, profile))
            score = nearly_safe(scene_of(problem, guess), rng).score
            tried.append((score, net, profile))
    _, net, profile = max(tried, key=lambda one: one[0])
    return claimed(runs, train, net, delta, asked, start, profile)


def guessed_claim(net: ReLUNetwork, train: RolloutBatch, profile: Tube) -> ErrorClaim:
    """A stand-in for a claim, the profile as it is, to compare shapes by; nothing is claimed."""
    return stand_in(assumed_claim(net, train.finite), profile)


def claimed(
    runs: LocalRuns,
    train: RolloutBatch,
    net: ReLUNetwork,
    delta: Fraction,
    asked: Local,
    start: StartTrial,
    profile: Tube | None = None,
) -> TrajectoryModel:
    """The model on the box of its runs, with what fresh ones support. profile: one in hand."""
    bins = (BINS,) * runs.box.n
    bound = BoundSettings(**part_of(asked, Sizing), delta=delta, bins=bins)
    own = None if profile is None else [profile]
    claim = bound_errors([net], runs, train, bound, start, profiles=own)[0][0]
    return trajectory_model(net, claim)
