"""One claim per bin of K, with delta split over the bins. [T4]"""

import itertools
from fractions import Fraction

import numpy as np

from parc_jax.error.calibrate import Intersample, check_fresh, evidence_of, kept_maximum, ledger, scaled
from parc_jax.error.claim import ErrorClaim
from parc_jax.error.counts import as_probability, most_discards, required_runs
from parc_jax.error.intersample import DISCRETE_TIME
from parc_jax.error.score import Scores, bins_of
from parc_jax.error.shape import runs_per_bin
from parc_jax.error.tube import Tube
from parc_jax.errors import InputError
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.system import TimeGrid


def calibrate_bins(
    net: ReLUNetwork,
    scores: Scores,
    shape: Tube,
    eps=1e-2,
    delta=1e-3,
    *,
    time: TimeGrid,
    discard: int | str = 0,
    looks: int = 1,
    intersample: Intersample = DISCRETE_TIME,
    train: RolloutBatch | None = None,
) -> ErrorClaim:
    """With confidence 1 - delta, in every claimed bin at once: a new run with k in the bin leaves it with probability
    <= eps.

    Stronger than one claim over K (it may be read bin by bin, and the planner may choose the bin afterwards), and
    dearer:
    each bin needs its own runs, at delta / (bins x looks). A bin with too few runs gets no claim, never a small tube.
    Arguments as in `calibrate`; discard counts per bin, "most" = as many as each bin allows. Raises InputError.
    """
    check_fresh(scores, train)
    eps, delta = as_probability("eps", eps), as_probability("delta", delta)
    share_of_delta = float(delta / (shape.n_bins * looks))
    numbers = bins_of(shape, scores.k)
    counts = runs_per_bin(numbers, shape.n_bins)
    scale, discards = np.full(shape.n_bins, np.inf), []
    for number in range(shape.n_bins):
        inside = scores.score[(numbers == number).any(axis=1)]
        allowed = most_discards(len(inside), float(eps), share_of_delta)
        wanted = max(allowed, 0) if discard == "most" else discard
        if wanted <= allowed:
            scale[number] = kept_maximum(inside, wanted)
            discards.append(wanted)
    if not discards:
        needed = required_runs(float(eps), share_of_delta, 0 if discard == "most" else discard)
        raise InputError(
            f"calibrate_bins: expected at least {needed:,} runs in a bin; the fullest of {shape.n_bins} holds "
            f"{counts.max()}. Use fewer bins, a larger eps, or one claim over K (calibrate)."
        )
    term = intersample.term(time.dt_record, shape.interval.shape[2])
    claimed = np.isfinite(scale)
    return ErrorClaim(
        kind="pac",
        tube=scaled(shape, scale, term),
        quantifier=f"in each claimed bin of K, a new rollout drawn from {scores.law.describe()} with k in that bin",
        eps=eps,
        delta=delta,
        n=scores.n,
        discard=max(discards),
        looks=looks,
        law=scores.law,
        assumptions=ledger(intersample.assumption(time.dt_record)),
        evidence={
            "network": net.hash,
            "shape": shape.hash,
            **evidence_of(scores),
            "bin_runs": [int(c) for c in counts],
            "bin_scale": [float(s).hex() for s in scale],
            "bin_share": [str(s) for s in bin_shares(shape)] if scores.law.k_law == "uniform" else None,
        },
        bin_eps=tuple(eps if ok else None for ok in claimed),
        intersample=tuple(term),
    )


def bin_shares(shape: Tube) -> list[Fraction]:
    """Exact share of K in every bin, row-major: the probability of the bin when k is uniform on K."""
    shares = [Fraction(1)]
    for edge in shape.edges:
        exact = [Fraction(float(x)) for x in edge]
        width = exact[-1] - exact[0]
        parts = [(high - low) / width for low, high in itertools.pairwise(exact)]
        shares = [share * part for share in shares for part in parts]
    return shares
