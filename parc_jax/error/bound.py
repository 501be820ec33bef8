"""One call from a trained network and a system to a claim; and the published, merely assumed, bound beside it."""

from pathlib import Path

import jax
import numpy as np

from parc_jax.error.calibrate import Intersample, calibrate, ledger
from parc_jax.error.claim import ErrorClaim
from parc_jax.error.counts import as_probability, required_runs
from parc_jax.error.intersample import DISCRETE_TIME
from parc_jax.error.measure import Errors, measure_system
from parc_jax.error.score import score_system
from parc_jax.error.search import enlarge, search_worst
from parc_jax.error.shape import bin_maxima, edges_of, shape_of, training_errors, training_shape
from parc_jax.error.tube import Tube, tube
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch

_SHAPE_RUNS = 2000  # runs for the shape when there is nothing else to learn it from


def bound_error(
    net: ReLUNetwork,
    system,
    key: jax.Array | None,
    eps=1e-3,
    delta=1e-3,
    bins=None,
    *,
    shape: Tube | None = None,
    train: RolloutBatch | None = None,
    n: int | None = None,
    shape_runs: int | None = None,
    discard: int | str = 0,
    looks: int = 1,
    intersample: Intersample = DISCRETE_TIME,
    search: int = 1024,
    path=None,
    quiet: bool = False,
) -> ErrorClaim:
    """Bound the error of the network by fresh runs of the system, the stage BOUND of `key` (which is not consumed).

    system: a black box; or a RolloutBatch of recorded runs that neither network nor shape has seen: then key is unused,
    train is needed, and the claim carries the eps that those runs support.
    eps, delta: with confidence 1 - delta a new run leaves the tube with probability at most eps.
    bins: how the tube varies over K: numbers of bins per axis, edges per axis, or None = cut where the error changes.
    train: the runs the network was trained on, for the shape. shape_runs: further runs for the shape, which is where
    tightness comes from (the network need not see them); None = as many as the holdout. shape: one of your own instead.
    n: holdout runs, None = as many as (eps, delta, discard, looks) need.
    discard, looks, intersample: as in `calibrate`.
    search: runs spent looking for bad ones on purpose, which only widens the tube where it finds some; 0 = none.
    path: a folder that keeps finished chunks, so a killed run continues with the same numbers.
    Raises InputError.
    """
    if isinstance(system, RolloutBatch):
        return _bound_from_files(net, system, eps, delta, bins, shape, train, discard, looks, intersample)
    eps, delta = as_probability("eps", eps), as_probability("delta", delta)
    if n is None:
        n = required_runs(float(eps), float(delta / looks), 0 if discard == "most" else discard)
    if shape is None:
        shape = _shape(net, system, key, train, n if shape_runs is None else shape_runs, bins, path, quiet)
    scores = score_system(net, system, key, shape, n, Stage.BOUND, path=_inside(path, "holdout"), quiet=quiet)
    claim = calibrate(
        net,
        scores,
        shape,
        eps,
        delta,
        time=system.time,
        discard=discard,
        looks=looks,
        intersample=intersample,
        train=train,
    )
    return claim if search == 0 else enlarge(claim, shape, search_worst(net, system, key, shape, search))


def _shape(net, system, key, train, runs: int, bins, path, quiet) -> Tube:
    """From the training runs and fresh ones that follow them in the TRAIN stream."""
    parts = [] if train is None else [training_errors(net, train)]
    if runs or not parts:
        first_row = 0 if train is None else int(train.rows.max()) + 1
        k, errors = measure_system(
            net,
            system,
            key,
            runs or _SHAPE_RUNS,
            Stage.TRAIN,
            first_row=first_row,
            path=_inside(path, "shape"),
            quiet=quiet,
        )
        finite = np.isfinite(errors.interval).all(axis=(1, 2)) & np.isfinite(errors.final).all(axis=1)
        parts.append((k[finite], Errors(errors.interval[finite], errors.final[finite])))
    k = np.concatenate([part[0] for part in parts])
    return shape_of(
        k, Errors(*(np.concatenate(e) for e in zip(*(part[1] for part in parts), strict=True))), system.domain, bins
    )


def _inside(path, name: str) -> Path | None:
    return None if path is None else Path(path) / name


def _bound_from_files(net, holdout, eps, delta, bins, shape, train, discard, looks, intersample) -> ErrorClaim:
    if train is None:
        raise InputError("bound_error: expected train (the training runs) beside a holdout of recorded runs.")
    if shape is None:
        shape = training_shape(net, train, bins)
    return calibrate(
        net, holdout, shape, eps, delta, discard=discard, looks=looks, intersample=intersample, train=train
    )


def assumed_claim(net: ReLUNetwork, train: RolloutBatch, bins=None) -> ErrorClaim:
    """The published bound: the largest error over the training data, per bin. Shows nothing and says so. [paper Sec.
    III-C]

    bins: per axis of K, None = one bin. A bin without finite runs has no claim. Raises InputError.
    """
    k, errors = training_errors(net, train)
    edges = edges_of(train.domain, (1,) * train.n_k if bins is None else bins)
    frame, (interval, final), counts = bin_maxima(k, errors, edges)
    interval[counts == 0], final[counts == 0] = np.inf, np.inf
    return ErrorClaim(
        kind="assumed",
        tube=tube(frame.edges, interval, final),
        quantifier="assumed for every run",
        eps=None,
        delta=None,
        n=len(k),
        discard=train.n - len(k),
        looks=1,
        law=train.law,
        assumptions=("THE TUBE HOLDS", *ledger(DISCRETE_TIME.assumption(train.time.dt_record))[1:3]),
        evidence={"network": net.hash, "failed": int(train.failed.sum())},
    )
