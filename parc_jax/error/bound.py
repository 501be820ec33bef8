"""One call from a trained network and a system to a claim; and the published, merely assumed, bound beside it."""

import jax
import numpy as np

from parc_jax.error.calibrate import Intersample, calibrate, ledger
from parc_jax.error.claim import ErrorClaim
from parc_jax.error.counts import as_probability, required_runs
from parc_jax.error.intersample import DISCRETE_TIME
from parc_jax.error.score import score_system
from parc_jax.error.search import enlarge, search_worst
from parc_jax.error.shape import bin_maxima, choose_bins, training_errors, training_shape
from parc_jax.error.tube import Tube, tube
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import collect

_SHAPE_RUNS = 2000  # runs for the shape when no training data is handed over


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
    bins: bins per axis of K over which the tube varies; None = chosen on the training data (`choose_bins`).
    shape: a shape instead of the one from training data.
    train: the runs the network was trained on; None = fresh ones of stage TRAIN.
    n: holdout runs, None = as many as (eps, delta, discard, looks) need.
    discard, looks, intersample: as in `calibrate`.
    search: runs spent looking for bad ones on purpose, which only widens the tube where it finds some; 0 = none.
    path: a folder that keeps finished chunks of the holdout, so a killed run continues.
    Raises InputError.
    """
    if isinstance(system, RolloutBatch):
        return _bound_from_files(net, system, eps, delta, bins, shape, train, discard, looks, intersample)
    if train is None:
        train = collect(system, key, _SHAPE_RUNS, Stage.TRAIN, quiet=quiet)
    if shape is None:
        shape = training_shape(net, train, choose_bins(net, train) if bins is None else bins)
    if n is None:
        eps, delta = as_probability("eps", eps), as_probability("delta", delta)
        n = required_runs(float(eps), float(delta / looks), 0 if discard == "most" else discard)
    scores = score_system(net, system, key, shape, n, Stage.BOUND, path=path, quiet=quiet)
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


def _bound_from_files(net, holdout, eps, delta, bins, shape, train, discard, looks, intersample) -> ErrorClaim:
    if train is None:
        raise InputError("bound_error: expected train (the training runs) beside a holdout of recorded runs.")
    if shape is None:
        shape = training_shape(net, train, choose_bins(net, train) if bins is None else bins)
    return calibrate(
        net, holdout, shape, eps, delta, discard=discard, looks=looks, intersample=intersample, train=train
    )


def assumed_claim(net: ReLUNetwork, train: RolloutBatch, bins=None) -> ErrorClaim:
    """The published bound: the largest error over the training data, per bin. Shows nothing and says so. [paper Sec.
    III-C]

    bins: per axis of K, None = one bin. A bin without finite runs has no claim. Raises InputError.
    """
    k, errors = training_errors(net, train)
    frame, (interval, final), counts = bin_maxima(k, errors, train.domain, (1,) * train.n_k if bins is None else bins)
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
