"""From trained networks and runs to claims: the pipeline behind `bound_error` and `learn`.

error shape (training runs and further ones) -> scores of fresh runs -> claims -> allowance for the
start. Every step after the scores only widens a tube, so every label stays true. After deployment
the same makes a new claim from new data.
"""

import itertools
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import jax
import numpy as np

from parc_jax.common.errors import InputError, check_kind
from parc_jax.common.keys import Stage, as_key
from parc_jax.common.options import refuse_unused
from parc_jax.learning.bound.bins import Bins, block_shares
from parc_jax.learning.bound.calibrate import OF_RUNS, block_of_bins, calibrate, calibrate_bins
from parc_jax.learning.bound.claim import ErrorClaim, check_network, derived
from parc_jax.learning.bound.counts import MOST, as_probability, required_runs
from parc_jax.learning.bound.edges import choose_edges
from parc_jax.learning.bound.fresh import SEEN, SHAPE, not_named, noted, remembered
from parc_jax.learning.bound.measure import Errors, check_profile, measure, scores_of
from parc_jax.learning.bound.monitor import require_new, require_unit
from parc_jax.learning.bound.profile import SHAPES, shape_of
from parc_jax.learning.bound.settings import GAP, BoundSettings, intersample_of
from parc_jax.learning.bound.start_gap import (
    ALIKE,
    StartTrial,
    allow_for_start,
    declared_gap,
    try_starts,
)
from parc_jax.learning.bound.statement import VALIDATED
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.predict import layout_of
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch, refitted
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.law import STATED
from parc_jax.learning.system import System, check_system

STORED = np.float32  # positions of many runs: half the memory, 2^-24 of them in every error
NEW_RUNS = ("profile_runs", "fresh")  # options that ask for runs of a system
RECORDED = "with recorded runs, all of which are used"


@dataclass(frozen=True, eq=False)
class SystemRuns:
    """Runs of a black box from the streams of `key`.

    first_row: of the further runs, behind the training runs in the TRAIN stream. path: folder for
    finished chunks. quiet: no progress bars.
    """

    system: System
    key: jax.Array
    first_row: int
    path: Path | None
    quiet: bool

    def further(self, n: int) -> Iterable[RolloutBatch]:
        """n for the error shape: the TRAIN stream behind the training runs."""
        return self._stream(n, Stage.TRAIN, "profile", self.first_row)

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """n for calibration, unseen by network and error shape: the BOUND stream."""
        return self._stream(n, Stage.BOUND, "fresh", 0)

    def _stream(self, n: int, stage: Stage, name: str, first_row: int):
        path = None if self.path is None else Path(self.path) / name
        options = {"path": path, "quiet": self.quiet, "first_row": first_row, "dtype": STORED}
        return stream_rollouts(self.system, self.key, n, stage, **options)


@dataclass(frozen=True, eq=False)
class HeldRuns:
    """Recorded runs. unseen: calibration set, used up completely, however few runs are needed."""

    unseen: RolloutBatch

    def further(self, n: int) -> Iterable[RolloutBatch]:
        """None: a log cannot be continued."""
        return ()

    def fresh(self, n: int) -> Iterable[RolloutBatch]:
        """The calibration set."""
        return (self.unseen,)


# [standard deviations] by which the expected runs of the smallest bin exceed the need of its claim
SPARE = 4.0
_PROFILE_RUNS = 2000  # for an error shape without training runs


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

    system: a black box; or a RolloutBatch of recorded runs, unseen by network and profile: then key
        is unused, train is needed, and the claim carries the eps that they support.
    asked: settings, all but `claims`; or fields of it by name, such as eps=1e-2, bins=(2, 2).
    train: training runs of the network, for the error shape.
    profile: an error shape instead, whose outer edges are K.
    path: folder for finished chunks, from which a killed run continues with the same numbers.
    quiet: no progress bars. Raises InputError.
    """
    places = (net, ReLUNetwork), (asked, BoundSettings | None), (train, RolloutBatch | None)
    if not all(isinstance(given, kind) for given, kind in places):
        kinds = ", ".join(type(given).__name__ for given, _ in places)
        raise InputError(
            "bound_error: expected bound_error(net, system, key, eps=..., train=runs), where runs "
            f"are a RolloutBatch; as net, asked and train got {kinds}."
        )
    settings = (asked or BoundSettings()).replace(**options)
    recorded = isinstance(system, RolloutBatch)
    if recorded:
        refuse_unused(settings, NEW_RUNS, RECORDED, options)
    else:
        check_system(system)
        as_key(key)
    if train is not None and train.time.n_steps != system.time.n_steps:
        raise InputError(f"bound_error train: expected runs on {system.time}; got {train.time}.")
    if profile is not None:
        check_profile(net, profile, layout_of(system), system.domain)
        refuse_unused(settings, ("bins", "shape", "profile_runs"), "with a given profile", options)
    if recorded:
        if train is None:
            raise InputError(
                "bound_error: expected train (the training runs) beside a holdout of recorded runs."
            )
        train, held = refitted(train, system)
        runs, start = HeldRuns(held), StartTrial(settings.gap, None)
    else:
        first_row = 0 if train is None else int(train.rows.max()) + 1
        runs = SystemRuns(system, key, first_row, path, quiet)
        start = try_starts(system, key, settings.gap)
    return bound_errors(net, runs, train, settings, start, profile=profile)[0]


def bound_errors(
    net: ReLUNetwork,
    runs: SystemRuns | HeldRuns,
    train: RolloutBatch | None,
    settings: BoundSettings,
    start: StartTrial,
    *,
    profile: Tube | None = None,
    seen: Sequence[list] = (),
    watch: Callable[[str], AbstractContextManager] = nullcontext,
) -> list[ErrorClaim]:
    """The claims in the order of settings.claims, from the same fresh runs: delta is split over
    them, so all hold together. [T1]

    train: the training runs. start: result of trials from other starts.
    profile: the error shape; None to learn it. seen: entries of further runs that network or shape
        were made from, as of `entry_of`.
    watch: entered for each stage, by its name.
    """
    if settings.blocks is not None and "bins" not in settings.claims:
        raise InputError('blocks: expected claims=("bins",), which they are of, or none.')
    looks, ledger = settings.looks * len(settings.claims), [*seen]
    if profile is None:
        ledger.append([SHAPE, "", None, None, []])  # of training runs, and of those that follow
        with watch("profile"):
            n = _profile_runs(settings, train is not None, looks)
            further = noted(ledger, SHAPE, runs.further(n) if n else ())
            profile = learn_profile(net, train, further, settings.bins, shape=settings.shape)
    with watch("fresh rollouts"):
        scores = scores_of(net, profile, runs.fresh(fresh_runs(settings, profile, looks)))
    used = {name: x for name, x in vars(settings).items() if name not in (*OF_RUNS, "blocks")}
    used |= {"looks": looks, "train": train}
    make = {"one": calibrate, "bins": partial(calibrate_bins, blocks=settings.blocks)}
    with watch("claims"):
        claims = [make[kind](net, scores, profile, **used) for kind in settings.claims]
    whole = {SEEN: claims[0].evidence.get(SEEN, []) + ledger}
    return [allow_for_start(derived(claim, evidence=whole), start) for claim in claims]


def learn_profile(
    net: ReLUNetwork,
    train: RolloutBatch | None,
    further: Iterable[RolloutBatch],
    bins: Bins | None = None,
    *,
    shape: str = "box",
) -> Tube:
    """An error shape from the training runs and further ones.

    bins, shape: as in `BoundSettings`; bins are cut by training runs alone. A fitted shape holds
    all runs in memory. Raises InputError, also when no run is finite.
    """
    if shape not in SHAPES:
        raise InputError(f"shape: expected one of {', '.join(SHAPES)}; got {shape!r}.")
    batches = itertools.chain([] if train is None else [train], further)
    batches = (batch for batch in (batch.finite for batch in batches) if batch.n)
    if (first := next(batches, None)) is None:
        raise InputError("profile: expected at least one finite training run; got none.")
    if bins is None:
        runs = [first]
        if train is None or not train.finite.n:
            batches = list(batches)  # all of them are looked at twice
            runs += batches
        errors = zip(*(measure(net, batch) for batch in runs), strict=True)
        k = np.concatenate([batch.k for batch in runs])
        bins = choose_edges(k, Errors(*map(np.concatenate, errors)), first.domain)
    return SHAPES[shape](net, itertools.chain([first], batches), bins)


def runs_ahead(settings: BoundSettings) -> int:
    """Number of runs behind the claims of one network, training apart; by bin at least so many."""
    looks = settings.looks * len(settings.claims)
    return _profile_runs(settings, True, looks) + (settings.fresh or _required(settings, looks))


def fresh_runs(settings: BoundSettings, profile: Tube, looks: int) -> int:
    """Size of the calibration set; by bin, large enough for the smallest bin or block."""
    n = settings.fresh or _required(settings, looks)
    if settings.fresh or "bins" not in settings.claims:
        return n
    block = block_of_bins(profile.grid, settings.blocks)
    each = _required(settings, looks * (int(block.max()) + 1))
    smallest = float(min(block_shares(profile.edges, block)))
    return max(n, int(np.ceil((each + SPARE * np.sqrt(each)) / smallest)))


def _profile_runs(settings: BoundSettings, has_train: bool, looks: int) -> int:
    n = settings.profile_runs
    if n is None:
        n = settings.fresh or _required(settings, looks)
    return n if n or has_train else _PROFILE_RUNS


def _required(settings: BoundSettings, looks: int) -> int:
    """Runs for one claim at delta / looks. [T1, T2]"""
    eps, delta = as_probability("eps", settings.eps), as_probability("delta", settings.delta)
    discard = 0 if settings.discard == MOST else settings.discard
    return required_runs(float(eps), float(delta / looks), discard)


def update(
    claim: ErrorClaim,
    net: ReLUNetwork,
    seen: RolloutBatch,
    fresh: RolloutBatch,
    tune: Callable[[ReLUNetwork, RolloutBatch], ReLUNetwork] | None = None,
    **options,
) -> tuple[ReLUNetwork, ErrorClaim]:
    """The network and a new claim after new data, with the eps and delta of the old one.

    seen:  all runs used before deciding to update: for training, and by a monitor until its alarm.
    fresh: runs of the law to be deployed, made after that decision, unseen by network and profile.
    tune:  (net, seen) -> net; None = the same network.
    options: of `bound_error`; eps, delta, shape, gap, intersample, bins, claims and blocks are the
        old claim's where not given, and as many fresh runs are left outside as these allow.
    Raises InputError, also when a fresh run was seen before, by training or by the old claim.
    """
    check_network(claim, net)
    for name, runs in (("seen", seen), ("fresh", fresh)):
        check_kind(f"update {name}", runs, RolloutBatch)
    about = claim.subject
    if fresh.seed is None and not fresh.given and fresh.n_k == about.domain.n:
        fresh = fresh.replace(given=about.given)  # a log need not say what was measured
    free = ("K", *(STATED[:-1] if about.given else STATED))
    about.agree("update: runs of the robot of the claim", fresh.subject, free)
    if claim.kind == VALIDATED:
        raise InputError(
            "update: expected a claim about runs everywhere; this one is about one set in one "
            "scene. Update the claim that it was made with, then validate again."
        )
    if claim.eps is None and "eps" not in options:
        raise InputError("update: expected eps and delta, since the old claim has none.")
    if fresh.seed is None and fresh.groups is None:  # parts of a recording are not independent
        require_unit(claim, fresh)
    require_new(claim, fresh)  # others decided that there would be more
    net = net if tune is None else tune(net, seen)
    old = {
        "eps": claim.eps,
        "delta": claim.delta,
        "shape": shape_of(claim.tube),
        "gap": declared_gap(claim, GAP),
        "intersample": intersample_of(claim.assumptions),
        "claims": ("one",) if claim.bin_eps is None else ("bins",),
    }
    if "bins" in options.get("claims", old["claims"]):
        old["blocks"] = claim.evidence.get("blocks_asked")
    # else the old bins do not span the new K
    if fresh.subject.identity["domain"] == about.identity["domain"]:
        old["bins"] = claim.tube.edges
    new = bound_error(net, fresh, None, train=seen, **old | options)
    source = {"network": claim.network, "n": claim.n, "law": claim.law.hash}
    told = [x[len("FRESH(") : -1] for x in new.assumptions if x.startswith("FRESH(")]
    before = not_named(claim, fresh.seed is None)
    told += [x.replace("the claim", "the claim before") for x in before]
    said = tuple(x for x in new.assumptions if not x.startswith("FRESH("))
    said += (f"FRESH({'; '.join(told)})",) if told else ()
    # of runs alone it cannot be tried again; recorded ones show what disturbs
    if fresh.seed is not None and fresh.law.source == claim.law.source:
        tried = "; tried before an update)"
        alike = [x for x in claim.assumptions if x.startswith(ALIKE)]
        said += tuple(x.removesuffix(tried).removesuffix(")") + tried for x in alike)
    order = about.given and about.unordered(fresh.subject)
    said += ("ORDER_OF_K(that of the claim before; not all have names)",) if order else ()
    known = {"updated_from": source} | remembered(claim, new)
    return net, derived(new, evidence=known, assumptions=said)
