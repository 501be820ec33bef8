"""From trained networks and runs to claims: the one pipeline behind `bound_error`, `parc-jax learn`
and `parc-jax run`.

error shape (training runs and further ones) -> scores of fresh runs -> claims -> allowance for the
start. Every step after the scores only widens a tube, so every label stays true.
"""

import itertools
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, as_key
from parc_jax.common.sets.box import Box
from parc_jax.learning.bound.asked import BoundSettings
from parc_jax.learning.bound.bins import Bins, Edges
from parc_jax.learning.bound.calibrate import block_of_bins, block_shares, calibrate, calibrate_bins
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.counts import MOST, as_probability, cheaper, required_runs
from parc_jax.learning.bound.edges import choose_edges
from parc_jax.learning.bound.measure import Errors, check_profile, measure, scores_of
from parc_jax.learning.bound.profile import evened, fitted_profile, learnt_from, profile_of
from parc_jax.learning.bound.start_gap import StartTrial, allow_for_start, try_starts
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.predict import layout_of
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch, refitted
from parc_jax.learning.runs.chunks import Forecast
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.system import System, check_system


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


# [standard deviations] by which the expected runs of the smallest bin exceed what its claim needs
SPARE = 4.0
_PROFILE_RUNS = 2000  # when there is nothing else to learn a profile from


def bound_error(
    net: ReLUNetwork,
    system: System | RolloutBatch,
    key: jax.Array | None,
    asked: BoundSettings | None = None,
    *,
    profile: Tube | None = None,
    train: RolloutBatch | None = None,
    path: str | Path | None = None,
    quiet: bool = False,
    **options,
) -> ErrorClaim:
    """Bound the network's error by fresh runs of the system: stage BOUND of `key`, not consumed.

    system: a black box; or a RolloutBatch of recorded runs that neither network nor profile has
        seen: then key is unused, train is needed, and the claim carries the eps they support.
    asked: the claim, `claims` aside; or its `options` by name, such as eps=1e-2, bins=(2, 2):
        fields of `BoundSettings`.
    train: the runs the network was trained on, for the profile. profile: one of your own instead of
        all that, whose outer edges are K.
    path: a folder that keeps finished chunks, so a killed run continues with the same numbers.
    quiet: no progress bars, and no word about the cost when it is more than half a minute.
    Raises InputError.
    """
    places = (net, ReLUNetwork), (asked, BoundSettings | None), (train, RolloutBatch | None)
    if not all(isinstance(given, kind) for given, kind in places):
        kinds = ", ".join(type(given).__name__ for given, _ in places)
        raise InputError(
            "bound_error: expected bound_error(net, system, key, eps=..., train=runs), where runs "
            f"are a RolloutBatch; as net, asked and train got {kinds}."
        )
    asked = (asked or BoundSettings()).replace(**options)
    if not isinstance(system, RolloutBatch):
        check_system(system)
        as_key(key)
    if profile is not None:
        check_profile(net, profile, layout_of(system), system.domain)
    if isinstance(system, RolloutBatch):
        if train is None:
            raise InputError(
                "bound_error: expected train (the training runs) beside a holdout of recorded runs."
            )
        train, held = refitted(train, system)
        runs = RecordedRuns(held)
        start = StartTrial(asked.gap, None)
    else:
        first_row = 0 if train is None else int(train.rows.max()) + 1
        ahead = runs_ahead(asked, 1, has_train=train is not None, has_profile=profile is not None)
        forecast = Forecast(ahead, advice(asked), quiet)
        runs = SystemRuns(system, key, first_row, path, quiet, forecast)
        start = try_starts(system, key, asked.gap)
    own = None if profile is None else [profile]
    return bound_errors([net], runs, train, asked, start, profiles=own)[0][0]


def bound_errors(
    nets: list[ReLUNetwork],
    runs: Runs,
    train: RolloutBatch | None,
    asked: BoundSettings,
    start: StartTrial,
    *,
    profiles: list[Tube] | None = None,
    watch: Callable[[str], AbstractContextManager] = nullcontext,
) -> list[list[ErrorClaim]]:
    """The claims of every network, in the order of asked.claims, all of them about the same fresh
    runs: delta is split over them, so all hold together. [T1]

    train: the training runs. start: what is known of the influence of the start.
    profiles: own ones, one per network on the same bins. watch: names the stage that runs.
    """
    looks = asked.looks * len(nets) * len(asked.claims)
    if profiles is None:
        with watch("profile"):
            n = _profile_runs(asked, train is not None, looks)
            further = iter(runs.further(n) if n else ())
            early = learnt_from(further, n) if asked.even else further
            profiles = learn_profiles(nets, train, early, asked.bins, shape=asked.shape)
            if asked.even:
                profiles = evened(nets, profiles, further)
    with watch("fresh rollouts"):
        fresh = runs.fresh(fresh_runs(asked, profiles[0], looks))
        seen = scores_of(nets, profiles, fresh)
    each = asked.replace(looks=looks)
    make = {"one": calibrate, "bins": calibrate_bins}
    out = []
    for net, profile, scores in zip(nets, profiles, seen, strict=True):
        with watch("claims"):
            claims = [make[kind](net, scores, profile, each, train=train) for kind in asked.claims]
        out.append([allow_for_start(claim, start) for claim in claims])
    return out


def learn_profiles(
    nets: list[ReLUNetwork],
    train: RolloutBatch | None,
    further: Iterable[RolloutBatch],
    bins: Bins | None = None,
    *,
    shape: str = "box",
) -> list[Tube]:
    """A profile per network from the training runs and further ones, on the bins cut for the first
    network: by training runs alone, so that they are known before the others are made. bins, shape
    as in `BoundSettings`. A fitted shape holds all of these runs in memory.
    Raises InputError, also when no run is finite.
    """
    batches = itertools.chain([] if train is None else [train], further)
    usable = (batch.finite for batch in batches)
    if shape == "fitted":
        held = [batch for batch in usable if batch.n]
        if bins is None:
            bins = _cut(_measured(nets[:1], held if train is None else held[:1])[0])
        return [fitted_profile(net, held, bins) for net in nets]
    first = 0 if train is None else train.finite.n
    found = _measured(nets, usable, n_exact=0 if train is None else 1)
    if bins is None:  # all networks share the first one's, and so its compiled code
        bins = _cut(found[0], first or None)
    return [profile_of(k, errors, domain, bins, n) for k, errors, domain, n in found]


def _cut(measured: tuple[np.ndarray, Errors, Box, int], first: int | None = None) -> Edges:
    """Edges of bins by the first so many runs, None for all."""
    k, errors, domain, _ = measured
    return choose_edges(k[:first], Errors(*(part[:first] for part in errors)), domain)


def _measured(
    nets: list[ReLUNetwork], batches: Iterable[RolloutBatch], n_exact: int = 0
) -> list[tuple[np.ndarray, Errors, Box, int]]:
    """Parameters, errors, domain and number of points of finite runs for every network. Beyond the
    first batches in single precision: a profile needs no rigour, and there may be many runs.
    """
    drawn: list[np.ndarray] = []
    measured: list[list[Errors]] = [[] for _ in nets]
    for number, batch in enumerate(batches):
        if not batch.n:
            continue
        domain, n_points = batch.domain, len(batch.points)
        dtype = np.float64 if number < n_exact else np.float32
        drawn.append(batch.k)
        for net, errors in zip(nets, measured, strict=True):
            errors.append(Errors(*(np.asarray(e, dtype) for e in measure(net, batch))))
    if not drawn:
        raise InputError("profile: expected at least one finite training run; got none.")
    k = np.concatenate(drawn)
    joined = (zip(*errors, strict=True) for errors in measured)
    return [(k, Errors(*map(np.concatenate, parts)), domain, n_points) for parts in joined]


def runs_ahead(
    asked: BoundSettings, n_nets: int, *, has_train: bool = True, has_profile: bool = False
) -> int:
    """All runs that the claims will take: exact, but for claims by bin on bins that are still to be
    cut, where it is the least.
    """
    looks = asked.looks * n_nets * len(asked.claims)
    further = 0 if has_profile else _profile_runs(asked, has_train, looks)
    return further + _holdout(asked, looks)


def advice(asked: BoundSettings, n_nets: int = 1, spelled: str = "eps = ") -> str:
    """What would be cheaper, in words, or "" where no eps decides."""
    if asked.fresh is not None or "bins" in asked.claims or asked.discard not in (0, MOST):
        return ""
    return cheaper(asked.eps, asked.delta / (asked.looks * n_nets * len(asked.claims)), spelled)


def _profile_runs(asked: BoundSettings, has_train: bool, looks: int) -> int:
    n = _holdout(asked, looks) if asked.profile_runs is None else asked.profile_runs
    return n if n or has_train else _PROFILE_RUNS


def fresh_runs(asked: BoundSettings, profile: Tube, looks: int) -> int:
    """How many fresh runs the claims need; by bin, so that the smallest bin or block has enough."""
    needed = _holdout(asked, looks)
    if asked.fresh is not None or "bins" not in asked.claims:
        return needed
    block = block_of_bins(profile.grid, asked.blocks)
    each = _needed(asked, looks * (int(block.max()) + 1))
    smallest = float(min(block_shares(profile, block)))
    return max(needed, int(np.ceil((each + SPARE * np.sqrt(each)) / smallest)))


def _holdout(asked: BoundSettings, looks: int) -> int:
    return _needed(asked, looks) if asked.fresh is None else asked.fresh


def _needed(asked: BoundSettings, looks: int) -> int:
    eps, delta = as_probability("eps", asked.eps), as_probability("delta", asked.delta)
    discard = 0 if asked.discard == MOST else asked.discard
    return required_runs(float(eps), float(delta / looks), discard)
