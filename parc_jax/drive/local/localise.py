"""A model of a small box of K, and a problem proved again under its claim. [T1, T23]

Fresh runs on the box, a small network, and an error bound about the box alone.
"""

import contextlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from threading import Thread
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import Look, Looks, fresh_key
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, stream
from parc_jax.common.options import part_of
from parc_jax.common.sets.box import Box
from parc_jax.drive.local.search import rank_plans
from parc_jax.learning.bound.asked import SHAPES, BoundSettings, Sizing
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
from parc_jax.method import Exact
from parc_jax.planner.planner import Planner, answer_to
from parc_jax.problem.problem import ReachAvoid
from parc_jax.problem.robust.question import Question
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.scene import scene_of

BINS = 1  # per axis: the error hardly ever changes within so small a box
NEAREST = 60  # training runs around a plan: enough for an affine map, and for a narrow tube
_TRIAL = 2**32 - 1  # number within the DRIVEN stream, behind those of looks and pilot samples


@dataclass(frozen=True)
class Local(Sizing, Training):
    """Sizes of a local claim: training, by default of an affine map, and error bound."""

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


class LocalAnswer(NamedTuple):
    """A local claim, and the problem proved again under it.

    answer: None where the tube has no claim, or no plan was left to look for. look: the one that
    was spent. margin: [m, .] least margin of the best plan, where one was searched for.
    """

    model: TrajectoryModel
    answer: Answer | None
    look: Look
    margin: float


def localise(
    question: Question,
    system: System,
    start: StartTrial,
    box: Box,
    key: jax.Array,
    looks: Looks,
    local: Local,
    settings: Settings | None = None,
    plan: np.ndarray | None = None,
    quiet: bool = True,
) -> LocalAnswer:
    """Bound the error on a box of K by fresh runs there and answer a question again under it.

    start: result of `start_trial`. key: only its DRIVEN stream is used. looks: the account, of
    which one look is spent, also where its runs fail. settings: of the query.
    plan (n_p + n_k,): the plan in the box that was chosen before. None: there is none yet; network
    and shape of the tube are selected for this problem, and the query searches around the plan with
    the largest margin under the claim. Raises InputError.
    """
    look = looks.take()
    about = (box.lo, box.hi) if plan is None else (plan, box.lo, box.hi)
    fresh = fresh_key(key, look, *about)
    selected_for = question.problem if plan is None else None
    model = local_model(system, start, box, fresh, look.delta, local, selected_for, quiet)
    query, margin = question.of(model), -np.inf
    if not model.tube.claimed.any():
        return LocalAnswer(model, None, look, margin)
    if plan is None:
        best = rank_plans(scene_of(query.problem, model), np.random.default_rng(0))
        margin = best.score
        # not a proof that no plan is safe, but reason enough to try the next box
        if not margin > 0:
            return LocalAnswer(model, None, look, margin)
        settings = settings or Settings.whole()
        if settings.method is None:
            settings = settings.replace(method=Exact((best.p0[0], best.k[0])))
    # the same account of looks: tests of plans of the new answer are counted with those before
    return LocalAnswer(model, answer_to(query, fresh, settings, looks), look, margin)


def start_trial(system: System, key: jax.Array, local: Local) -> StartTrial:
    """Compare runs from a few starts, before a look is spent or a run made for it. Uses a part of
    the DRIVEN stream of `key` that no look uses. Raises InputError where the start matters more
    than local.gap.
    """
    return try_starts(system, jax.random.fold_in(stream(key, Stage.DRIVEN), _TRIAL), local.gap)


def local_model(
    system: System,
    start: StartTrial,
    box: Box,
    key: jax.Array,
    delta: Fraction,
    local: Local,
    problem: ReachAvoid | None = None,
    quiet: bool = True,
) -> TrajectoryModel:
    """Learn the system on a box and bound its error there with confidence 1 - delta. [T1, T23]

    start: result of `start_trial`. key: of this look alone, see `fresh_key`.
    problem: network and shape of the tube are those that leave it the largest margin; None for an
    affine map or `local.hidden`, and `local.shape`. Raises InputError.
    """
    runs = LocalRuns(system, key, box, local.rollouts, quiet)
    train = runs.train()
    net, profile = fit(train, local, key), None
    if problem is not None:
        net, profile = _select(runs, train, net, local, problem)
    return claimed_model(runs, train, net, delta, local, start, profile)


def _select(
    runs: "LocalRuns", train: RolloutBatch, net: ReLUNetwork, local: Local, problem: ReachAvoid
) -> tuple[ReLUNetwork, Tube]:
    """The network and the error shape with the largest margin in a problem.

    They are compared by training and shape runs; the calibration set sees the selected pair alone,
    so that the claim is one look. [T1]
    """
    further = list(runs.further(local.profile_runs))
    nets = [net] if local.hidden else [net, fit_tail(net, train)]
    rng = np.random.default_rng(0)
    tried = []
    for net in nets:
        for shape in SHAPES:
            bins = (BINS,) * runs.box.n
            profile = learn_profiles([net], train, further, bins, shape=shape)[0]
            guess = trajectory_model(net, guessed_claim(net, train, profile))
            tried.append((rank_plans(scene_of(problem, guess), rng).score, net, profile))
    return max(tried, key=lambda one: one[0])[1:]


def claimed_model(
    runs: "LocalRuns",
    train: RolloutBatch,
    net: ReLUNetwork,
    delta: Fraction,
    local: Local,
    start: StartTrial,
    profile: Tube | None = None,
) -> TrajectoryModel:
    """The model on the box of its runs, with the claim that fresh ones support.

    profile: error shape; None to learn it from shape runs.
    """
    bins = (BINS,) * runs.box.n
    bound = BoundSettings(**part_of(local, Sizing), delta=delta, bins=bins)
    profiles = None if profile is None else [profile]
    claim = bound_errors([net], runs, train, bound, start, profiles=profiles)[0][0]
    return trajectory_model(net, claim)


def guessed_claim(net: ReLUNetwork, train: RolloutBatch, profile: Tube) -> ErrorClaim:
    """A stand-in with the error shape as its tube, to compare shapes; nothing is claimed."""
    return stand_in(assumed_claim(net, train.finite), profile)


@dataclass(frozen=True, eq=False)
class LocalRuns(Runs):
    """Runs of a system on a box N inside K, from the streams of a fresh key: TRAIN for the network,
    then, behind `trained` rows, for the error shape; BOUND for the claim. K of the system stays,
    so nothing is compiled again.
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
        """Runs for the error shape, behind the training ones."""
        return self._stream(n, Stage.TRAIN, self.trained)

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """Calibration runs, which nothing was chosen by."""
        return self._stream(n, Stage.BOUND, 0)

    def _stream(self, n: int, stage: Stage, first_row: int) -> Iterator[RolloutBatch]:
        def near(key: jax.Array):
            # converted in here, where float64 is on: in float32 a small box has few values
            lo = jnp.asarray(self.box.lo, jnp.float64)
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
    """Runs with k uniform on a box N inside K, and a law that says so. whole: the law on K."""
    law = law_spec(whole.generator, box, "uniform", {**dict(whole.parameters), BOX: "N"})
    return replace(runs, domain=box, law=law)


def compile_near(problem: ReachAvoid, train: RolloutBatch, k: np.ndarray) -> Thread:
    """Begin to compile the query of `Choice.localise` near k (n_k,); join the thread before it.

    Programs depend on shapes alone: a model guessed from the training runs nearest to k has those
    of the local model, and its answer is dropped.
    """

    def work() -> None:
        # a failure here is one of the query too, and is reported there
        with contextlib.suppress(Exception):
            Planner(guessed_near(train, k)).warm_up(problem)

    thread = Thread(target=work)
    thread.start()
    return thread


def guessed_near(train: RolloutBatch, k: np.ndarray) -> TrajectoryModel:
    """A model with the shapes of a local one around k (n_k,), from the training runs nearest."""
    side = train.domain.hi - train.domain.lo
    away = np.abs((train.k - k) / side).max(axis=1)
    near = train.select(np.argsort(np.where(train.failed, np.inf, away))[:NEAREST])
    near = on_box(near, train.law, Box(near.k.min(axis=0), near.k.max(axis=0)))
    net = fit(near, Local(), jax.random.PRNGKey(0))
    profile = learn_profiles([net], near, (), (BINS,) * train.n_k)[0]
    return trajectory_model(net, guessed_claim(net, near, profile))
