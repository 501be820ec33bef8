"""Tubes without a proof here: the published maximum, bounds from elsewhere, guides of a search."""

from collections.abc import Mapping, Sequence

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.bins import Bins
from parc_jax.learning.bound.calibrate import about_left_out, begins
from parc_jax.learning.bound.claim import ErrorClaim, derived, error_claim
from parc_jax.learning.bound.edges import edges_of
from parc_jax.learning.bound.fresh import SEEN, SHAPE, TRAINING, entry_of, left_out, names_of
from parc_jax.learning.bound.profile import largest_errors
from parc_jax.learning.bound.settings import DISCRETE_TIME
from parc_jax.learning.bound.start_gap import invariances
from parc_jax.learning.bound.tube import Tube, tube
from parc_jax.learning.labels import Labels
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.law import law_spec, subject
from parc_jax.learning.system import TimeGrid

_HOLDS = "THE TUBE HOLDS"
_NOT_SHOWN: dict = {"eps": None, "delta": None, "looks": 1}


def assumed_claim(net: ReLUNetwork, train: RolloutBatch, bins: Bins | None = None) -> ErrorClaim:
    """The published bound: the largest error over the training data, per bin. Nothing is shown, as
    its sentence says. [paper Sec. III-C]

    bins: per axis of K, None = one bin. A bin without finite runs has no claim. Raises InputError.
    """
    edges = edges_of(train.domain, (1,) * train.n_k if bins is None else bins)
    frame, (interval, final), counts = largest_errors(net, train, edges)
    failed, gone = int(train.failed.sum()), left_out(train, None)
    interval[counts == 0] = np.inf
    final[counts == 0] = np.inf
    between = DISCRETE_TIME.assumption(train.time.dt_record)
    told = *about_left_out(gone), *invariances(train.rotation), *begins(train.subject)
    made = [entry_of(TRAINING, train), [SHAPE, "", None, None, []]]  # of the same runs
    evidence = {"failed": failed, "training": names_of(train), SEEN: made}
    return error_claim(
        kind="assumed",
        tube=tube(frame.edges, interval, final, len(train.points)),
        subject=train.subject,
        network=net.hash,
        quantifier="assumed for every run",
        n=train.n - failed,
        discard=failed,
        **_NOT_SHOWN,
        law=train.law.of(train.k),
        assumptions=(_HOLDS, *told, between),
        evidence=evidence | ({"left_out": gone} if gone else {}),
    )


def declared_claim(
    tube: Tube,
    why: str,
    net: ReLUNetwork,
    time: TimeGrid,
    *,
    system: str = "",
    points: Sequence[str] | None = None,
    rotation: Sequence[str] | None = None,
    labels: Labels | Mapping[str, Sequence[str]] | None = None,
    given: Sequence[str | int] = (),
) -> ErrorClaim:
    """A bound from elsewhere, such as a data sheet. Nothing is shown, as every sentence says.

    tube: half widths [m, .] for runs from every start and for all times; its outer edges are K.
    why: the reason, one clause: "... no run leaves the tube, because {why}".
    net, time: network and grid of the bound. system: name of the robot. points: names of its
        reference points, None for a single one.
    rotation, given: as of a system. labels: of p, q, k, as of `subject`. Raises InputError.
    """
    if not isinstance(tube, Tube) or not isinstance(why, str) or not why.strip():
        raise InputError(
            f"declared_claim: expected a Tube and a reason; got {type(tube).__name__} and {why!r}."
        )
    domain = box([e[0] for e in tube.edges], [e[-1] for e in tube.edges])
    return error_claim(
        kind="declared",
        tube=tube,
        subject=subject(system, domain, time, tube.n_p, tube.n_q, points, rotation, labels, given),
        network=net.hash,
        quantifier=why.strip().rstrip("."),
        n=0,
        discard=0,
        **_NOT_SHOWN,
        law=law_spec("declared", domain, "given"),
        assumptions=(_HOLDS, *invariances(rotation)[1:]),
    )


def stand_in(claim: ErrorClaim, tube: Tube) -> ErrorClaim:
    """A guide for a search in place of a claim, with any tube; nothing is claimed."""
    why = "assumed for a search alone"
    return derived(
        claim, kind="assumed", tube=tube, quantifier=why, eps=None, delta=None, bin_eps=None
    )
