"""Models from few runs: as published, and honestly, where every run serves once."""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.claim.calibrate import calibrate
from parc_jax.claim.counts import supported_eps
from parc_jax.claim.declared import assumed_claim
from parc_jax.claim.measure import Errors
from parc_jax.claim.profile import profile_of, training_errors
from parc_jax.claim.start_gap import StartTrial, allow_for_start
from parc_jax.claim.tube import Tube
from parc_jax.labels import labels_of
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.parc import fit_affine
from parc_jax.network.relu import ReLUNetwork
from parc_jax.network.train import train_report, training_arrays
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.system import points_of
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


class Model(NamedTuple):
    """A model with the name of its claim (PUBLISHED, STEADY, STRICT) and of what was fitted (one of
    KINDS).
    """

    claim: str
    fitted: str
    model: TrajectoryModel


def models(car: F110, runs: RolloutBatch, start: StartTrial, key: jax.Array) -> list[Model]:
    """The published model of n runs, and the honest one under two claims on one profile.

    Published: all runs train a network of the study's size; the largest error over the same runs is
        assumed to hold.
    Honest: the first half trains; cross-validation inside it picks network or affine fit and learns
    the tube's profile from errors on runs that a fit has not seen; the second half, unseen by all
    that, sizes the tube. STEADY asks for EPS and discards as many bad runs as the holdout affords;
    STRICT discards none and gets the smallest eps. Both use one holdout, so each has half of DELTA.
    [T1, T2] start: how little the start matters.
    """
    half = runs.n // 2
    train, holdout = runs.select(slice(0, half)), runs.select(slice(half, runs.n))
    every = fitted("network", runs, key)
    tested = {kind: out_of_fold(kind, train, key) for kind in KINDS}
    kind = min(KINDS, key=lambda name: tail(tested[name][1]))
    net, profile = fitted(kind, train, key), _profile(*tested[kind], train)
    options = {"delta": DELTA, "looks": 2, "train": train}
    strict = supported_eps(holdout.n, DELTA / 2)
    claims = [
        (PUBLISHED, "network", every, assumed_claim(every, runs)),
        (
            STEADY,
            kind,
            net,
            allow_for_start(
                calibrate(net, holdout, profile, EPS, discard="most", **options), start
            ),
        ),
        (
            STRICT,
            kind,
            net,
            allow_for_start(calibrate(net, holdout, profile, strict, **options), start),
        ),
    ]
    return [
        Model(
            c,
            f,
            trajectory_model(
                n, claim, car.domain, car.time, car.name, labels_of(car), points_of(car)
            ),
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
    if kind == "affine":
        return fit_affine(*training_arrays(data))
    return train_report(data, STUDY.hidden, key=key, seeds=seeds, steps=steps)[0]


def out_of_fold(kind: str, train: RolloutBatch, key: jax.Array) -> tuple[np.ndarray, Errors]:
    """k (n, n_k) and errors of the finite runs, each measured against a fit that has not seen its
    fold.
    """
    fold, parts = np.arange(train.n) % FOLDS, []
    for i in range(FOLDS):
        net = fitted(
            kind, train.select(fold != i), jax.random.fold_in(key, i), FOLD_SEEDS, FOLD_STEPS
        )
        parts.append(training_errors(net, train.select(fold == i)))
    interval, final = (np.concatenate([np.asarray(e[j]) for _, e in parts]) for j in (0, 1))
    return np.concatenate([k for k, _ in parts]), Errors(interval, final)


def _profile(k: np.ndarray, errors: Errors, train: RolloutBatch) -> Tube:
    """The tube's profile, of all reference points."""
    return profile_of(k, errors, train.domain, n_points=len(train.points))


def tail(errors: Errors) -> float:
    """The worst error of all runs at any time and point, in half sizes of the goal: it is the worst
    run that a tube pays for.
    """
    *half, turn = np.array(GOAL_SIZE) / 2
    places = np.tile(half, errors.interval.shape[-1] // 2)
    at_end = np.append(places, turn)
    return float(max((errors.interval / places).max(), (errors.final / at_end).max()))
