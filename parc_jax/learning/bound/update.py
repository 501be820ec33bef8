"""New data, new claim: refitting and re-certifying in one call."""

from collections.abc import Callable

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.bound.asked import GAP
from parc_jax.learning.bound.claim import ErrorClaim, derived
from parc_jax.learning.bound.fresh import calibration_runs
from parc_jax.learning.bound.intersample import intersample_of
from parc_jax.learning.bound.pipeline import bound_error
from parc_jax.learning.network.predict import features
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.runs.batch import RolloutBatch


def update(
    claim: ErrorClaim,
    net: ReLUNetwork,
    seen: RolloutBatch,
    fresh: RolloutBatch,
    tune: Callable[[ReLUNetwork, RolloutBatch], ReLUNetwork] | None = None,
    **options,
) -> tuple[ReLUNetwork, ErrorClaim]:
    """The network and a new claim after new data, with the eps and delta of the old one.

    seen:  everything looked at before the decision to update: training runs, and those a monitor
        watched until it rang.
    fresh: runs of the law to be deployed, made after that decision. Neither network nor profile may
        see them.
    tune:  (net, seen) -> net, for example `refit`; None = keep the network.
    options: of `bound_error`; eps, delta, shape, gap, intersample, bins, claims and blocks are
        those of the old claim where not given, and as many fresh runs are left outside as these
        allow.
    Raises InputError, also when a fresh run was seen before, by training or by the old claim.
    """
    if claim.eps is None and "eps" not in options:
        raise InputError("update: expected eps and delta, since the old claim has none.")
    again = calibration_runs(claim, fresh)
    if again.any():
        raise InputError(
            f"update: expected fresh runs; {int(again.sum())} of {fresh.n} are calibration runs of "
            f"the old claim, the first is row {fresh.rows[np.argmax(again)]}. Runs that one claim "
            "was made from decided that there would be another: draw new ones, from another key or "
            "recorded since."
        )
    net = net if tune is None else tune(net, seen)
    start = claim.evidence.get("start")
    kept = {
        "eps": claim.eps,
        "delta": claim.delta,
        "shape": "box" if claim.tube.templates is None else "fitted",
        "gap": GAP if start is None else float.fromhex(start["gap"]),
        "intersample": intersample_of(claim.assumptions),
        "claims": ("one",) if claim.bin_eps is None else ("bins",),
        "blocks": claim.evidence.get("blocks_asked"),
    }
    if subject_K(fresh) == subject_K(claim):  # else the old bins do not span the new K
        kept["bins"] = claim.tube.edges
    new = bound_error(net, fresh, None, train=seen, **kept | options)
    old = {"network": claim.network, "n": claim.n, "law": claim.law.hash}
    return net, derived(new, evidence={"updated_from": old})


def subject_K(about: RolloutBatch | ErrorClaim) -> list[bytes]:
    """The corners of K, bit by bit."""
    return [corner.tobytes() for corner in (about.domain.lo, about.domain.hi)]


def refit(net: ReLUNetwork, data: RolloutBatch) -> ReLUNetwork:
    """The network with its last layer solved anew by least squares on the data; hidden layers, and
    so regions, stay. Raises InputError when fewer than ten runs are finite.
    """
    from parc_jax.learning.network.train import training_arrays

    k, y = training_arrays(data)
    hidden = features(net.weights[:-1], net.biases[:-1], k)
    centre = hidden.mean(axis=0)
    solution = np.linalg.lstsq(hidden - centre, y - y.mean(axis=0), rcond=1e-10)[0].T
    return relu_network(
        [*net.weights[:-1], solution], [*net.biases[:-1], y.mean(axis=0) - solution @ centre]
    )
