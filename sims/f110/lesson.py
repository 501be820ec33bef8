"""Models from few runs: as published, and honestly, where every run serves once."""

import math
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.counts import supported_eps
from parc_jax.learning.bound.declared import assumed_claim
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.profile import fitted_profile
from parc_jax.learning.bound.start_gap import StartTrial, allow_for_start
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import fit
from parc_jax.learning.network.predict import layout_of, trajectories
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from sims.f110.scenario import GOAL_SIZE
from sims.f110.study import STUDY
from sims.f110.system import F110

PUBLISHED, STEADY, STRICT = "published", "honest", "honest, strict"
EPS, DELTA = (
    0.05,
    0.05,
)  # one run in twenty may leave the tube; every row holds with 95 % confidence
FOLDS = 5
FOLD_SEEDS, FOLD_STEPS = (
    2,
    1000,
)  # the folds say how far off a network is, not how good the last one will be
KINDS = ("network", "affine")
RUNS_PER_BIN, MOST_BINS = 50, 3  # [runs] that teach a bin; [1] a side: more gain no more


class Model(NamedTuple):
    """A model with the name of its claim (PUBLISHED, STEADY, STRICT) and of what was fitted (one of
    KINDS).
    """

    claim: str
    fitted: str
    model: TrajectoryModel


def models(car: F110, runs: RolloutBatch, start: StartTrial, key: jax.Array) -> list[Model]:
    """The published model of n runs, and the honest one under two claims.

    Published: all runs train a network of the study's size; the largest error over the same runs is
        assumed to hold.
    Honest: the first half trains; cross-validation inside it picks network or affine fit, learns
    the faces of the tube's profile from errors on runs that a fit has not seen; the second half,
    unseen by all that, sizes the tube. STEADY asks for EPS and discards as many bad runs as
    the holdout affords; STRICT discards none and gets the smallest eps. Both use one holdout, so
    each has half of DELTA. [T1, T2, T26] start: how little the start matters.
    """
    half = runs.n // 2
    train, holdout = runs.select(slice(0, half)), runs.select(slice(half, runs.n))
    every = fitted("network", runs, key)
    tested = {kind: out_of_fold(kind, train, key) for kind in KINDS}
    kind = min(KINDS, key=lambda name: tail(tested[name]))
    net = fitted(kind, train, key)
    unseen = [as_if_of(net, fold) for fold in tested[kind]]
    strict = supported_eps(holdout.n, DELTA / 2)
    profile = fitted_profile(net, unseen, bins_for(half))
    options = {"delta": DELTA, "looks": 2, "train": train}
    claims = [(PUBLISHED, "network", every, assumed_claim(every, runs))]
    for name, eps, discard in ((STEADY, EPS, "most"), (STRICT, strict, 0)):
        claim = calibrate(net, holdout, profile, eps=eps, discard=discard, **options)
        claims.append((name, kind, net, allow_for_start(claim, start)))
    return [
        Model(
            c,
            f,
            trajectory_model(n, claim),
        )
        for c, f, n, claim in claims
    ]


def fitted(
    kind: str,
    data: RolloutBatch,
    key: jax.Array,
    seeds: int = STUDY.seeds,
    steps: int = STUDY.steps,
) -> ReLUNetwork:
    """A "network" of the study's size, or the "affine" map of PARC, fitted to the runs."""
    hidden = () if kind == "affine" else STUDY.hidden
    return fit(data, STUDY.replace(hidden=hidden, seeds=seeds, steps=steps), key)


class Fold(NamedTuple):
    """Finite runs beside a fit that has not seen them."""

    net: ReLUNetwork
    runs: RolloutBatch


def out_of_fold(kind: str, train: RolloutBatch, key: jax.Array) -> list[Fold]:
    """The finite training runs in FOLDS parts, each beside a fit to the others."""
    fold, parts = np.arange(train.n) % FOLDS, []
    for i in range(FOLDS):
        net = fitted(
            kind, train.select(fold != i), jax.random.fold_in(key, i), FOLD_SEEDS, FOLD_STEPS
        )
        parts.append(Fold(net, train.select((fold == i) & ~train.failed)))
    return parts


def as_if_of(net: ReLUNetwork, fold: Fold) -> RolloutBatch:
    """The runs of a fold, moved so that their errors of `net`, which has seen them, are those of
    the fit that has not. They teach a profile, and nothing else.
    """
    layout = layout_of(fold.runs)
    (here, q_here), (there, q_there) = (
        trajectories(fit, layout, fold.runs.k) for fit in (fold.net, net)
    )
    at = np.linspace(0, layout.n_steps, fold.runs.p.shape[1])  # records, in intervals
    left = np.minimum(at.astype(int), layout.n_steps - 1)
    part = (at - left)[:, None]
    moved = there - here
    shift = (1 - part) * moved[:, left] + part * moved[:, left + 1]
    return replace(fold.runs, p=fold.runs.p + shift, q=fold.runs.q + q_there - q_here)


def bins_for(n: int) -> tuple[int, int]:
    """Bins of K that n training runs can fill with RUNS_PER_BIN each, at most MOST_BINS a side; the
    number of runs alone decides.
    """
    return (min(MOST_BINS, max(1, math.isqrt(n // RUNS_PER_BIN))),) * 2


def tail(folds: list[Fold]) -> float:
    """The worst error of all runs at any time and point, in half sizes of the goal: it is the worst
    run that a tube pays for.
    """
    *half, turn = np.array(GOAL_SIZE) / 2
    worst = 0.0
    for fold in folds:
        errors = measure(fold.net, fold.runs)
        places = np.tile(half, errors.interval.shape[-1] // 2)
        at_end = np.append(places, turn)
        worst = max(worst, (errors.interval / places).max(), (errors.final / at_end).max())
    return float(worst)
