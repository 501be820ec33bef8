"""The runs behind the claims: every run is simulated once, judged against all networks, and never held."""

from collections.abc import Iterable
from dataclasses import replace

import jax
import numpy as np

from parc_jax.error.bound import assumed_claim
from parc_jax.error.by_bin import bin_shares, calibrate_bins
from parc_jax.error.calibrate import calibrate
from parc_jax.error.claim import ErrorClaim
from parc_jax.error.counts import required_runs
from parc_jax.error.edges import choose_edges
from parc_jax.error.measure import Errors, measure
from parc_jax.error.scale import scale_shape
from parc_jax.error.score import Scores, score_errors
from parc_jax.error.shape import shape_of, training_errors
from parc_jax.error.tube import Tube, refined
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.study.settings import Study

SPARE = 4.0  # [standard deviations] by which the expected runs of the smallest bin exceed what its claim needs


def shapes(
    nets: list[ReLUNetwork], train: RolloutBatch, further: Iterable[RolloutBatch], study: Study, key: jax.Array
) -> list[Tube]:
    """A shape per network from the training runs and further ones, on the bins cut for the first network."""
    k, errors = [train.k[~train.failed]], [[training_errors(net, train)[1]] for net in nets]
    for batch in further:
        usable = batch.select(~batch.failed)
        k.append(usable.k)
        for net, seen in zip(nets, errors, strict=True):
            # a shape needs no rigour, and in float32 ten times the runs fit
            seen.append(Errors(*(np.asarray(e, np.float32) for e in measure(net, usable))))
    drawn, out, bins = np.concatenate(k), [], study.bins
    for seen in errors:
        joined = Errors(*(np.concatenate(e) for e in zip(*seen, strict=True)))
        if study.head is None:
            out.append(shape_of(drawn, joined, train.domain, bins))
        else:
            cut = bins or choose_edges(drawn, joined, train.domain)
            out.append(scale_shape(drawn, joined, train.domain, cut, study.head, key))
        bins = bins or out[0].edges  # all networks share the main one's bins, and so its compiled code
    return out


def fresh_runs(study: Study, shape: Tube, looks: int) -> int:
    """How many fresh runs the claims of a study need; for claims by bin, so many that the smallest bin has enough."""
    if study.fresh is not None:
        return study.fresh
    needed = required_runs(study.eps, study.delta / looks, 0)
    if "bins" in study.claims:
        each = required_runs(study.eps, study.delta / (looks * shape.n_bins), 0)
        needed = max(needed, int(np.ceil((each + SPARE * np.sqrt(each)) / float(min(bin_shares(shape))))))
    return needed


def scores(nets: list[ReLUNetwork], shapes: list[Tube], fresh: Iterable[RolloutBatch]) -> list[Scores]:
    """Scores of the same fresh runs against every network's shape."""
    parts = []
    for batch in fresh:
        judged = [score_errors(measure(net, batch), one, batch.k) for net, one in zip(nets, shapes, strict=True)]
        parts.append((batch.rows, batch.k, batch.hashes(), judged))
    rows, k, ids = (np.concatenate([part[i] for part in parts]) for i in range(3))
    out = []
    for number in range(len(nets)):
        score, worst = (np.concatenate([part[3][number][i] for part in parts]) for i in range(2))
        out.append(Scores(rows, k, score, worst, ids, batch.law, batch.seed, batch.stage))
    return out


def claims(net: ReLUNetwork, shape: Tube, seen: Scores, train: RolloutBatch, study: Study, looks: int):
    """The assumed claim of the published kind, and the honest ones in the order of study.claims.

    The worst runs are discarded, as many as the number of fresh runs allows: fixed before they are seen. [T2]
    """
    options = {"time": train.time, "discard": "most", "looks": looks, "train": train}
    make = {"one": calibrate, "bins": calibrate_bins}
    honest = [make[kind](net, seen, shape, study.eps, study.delta, **options) for kind in study.claims]
    published = assumed_claim(net, train, shape.edges if "bins" in study.claims else None)
    return _told_on(published, shape.edges), honest


def _told_on(claim: ErrorClaim, edges) -> ErrorClaim:
    """The claim on finer bins: models of equal shapes share compiled code."""
    return replace(claim, tube=refined(claim.tube, edges))
