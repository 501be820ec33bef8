"""One claim per bin of K, with delta split over the bins. [T4]"""

import itertools
from fractions import Fraction

import numpy as np

from parc_jax.claim.calibrate import (
    Intersample,
    evidence_of,
    kept_maximum,
    ledger,
    pac_label,
    scaled,
)
from parc_jax.claim.claim import ErrorClaim, error_claim
from parc_jax.claim.counts import as_probability, most_discards, required_runs
from parc_jax.claim.fresh import check_fresh
from parc_jax.claim.intersample import DISCRETE_TIME
from parc_jax.claim.profile import runs_per_bin
from parc_jax.claim.score import Scores
from parc_jax.claim.tube import Tube
from parc_jax.errors import InputError
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.spelling import hex_text
from parc_jax.system import TimeGrid


def calibrate_bins(
    net: ReLUNetwork,
    scores: Scores,
    profile: Tube,
    eps=1e-2,
    delta=1e-3,
    *,
    time: TimeGrid,
    discard: int | str = 0,
    looks: int = 1,
    intersample: Intersample = DISCRETE_TIME,
    train: RolloutBatch | None = None,
) -> ErrorClaim:
    """With confidence 1 - delta, in every claimed bin at once: a new run with k in the bin leaves
    it with probability <= eps.

    Stronger than one claim over K (it may be read bin by bin, and the planner may choose the bin
    afterwards), and dearer:
    each bin needs its own runs, at delta / (bins x looks). A bin with too few runs gets no claim,
    never a small tube. Arguments as in `calibrate`; discard counts per bin, "most" = as many as
    each bin allows. Raises InputError.
    """
    check_fresh(scores, train)
    if scores.groups is not None:
        raise InputError(
            "calibrate_bins: expected independent runs; these come in groups, whose runs may lie "
            'in several bins. Make one claim over K: calibrate, or claims = ("one",).'
        )
    eps, delta = as_probability("eps", eps), as_probability("delta", delta)
    share_of_delta = float(delta / (profile.n_bins * looks))
    numbers = profile.bins_of(scores.k)
    counts = runs_per_bin(numbers, profile.n_bins)
    scale = np.full(profile.n_bins, np.inf)
    bin_eps: list[Fraction | None] = [None] * profile.n_bins
    discards = []
    for number in range(profile.n_bins):
        inside = scores.score[(numbers == number).any(axis=1)]
        allowed = most_discards(len(inside), float(eps), share_of_delta)
        wanted = max(allowed, 0) if discard == "most" else discard
        if wanted <= allowed:
            scale[number] = kept_maximum(inside, wanted)
            bin_eps[number], _ = pac_label(len(inside), eps, share_of_delta, discard)
            discards.append(wanted)
    if not discards:
        needed = required_runs(float(eps), share_of_delta, 0 if discard == "most" else discard)
        raise InputError(
            f"calibrate_bins: expected at least {needed:,} runs in a bin; the fullest of "
            f"{profile.n_bins} holds "
            f"{counts.max()}. Use fewer bins, a larger eps, or one claim over K (calibrate)."
        )
    term = intersample.term(time.dt_record, profile.n_p, profile.n_points)
    return error_claim(
        kind="pac",
        tube=scaled(profile, scale, term),
        quantifier=f"in each claimed bin of K, a new rollout drawn from {scores.law.describe()} "
        "with k in that bin",
        eps=max(e for e in bin_eps if e is not None),
        delta=delta,
        n=scores.n,
        discard=max(discards),
        looks=looks,
        law=scores.law,
        assumptions=ledger(intersample.assumption(time.dt_record)),
        evidence={
            "network": net.hash,
            "profile": profile.hash,
            **evidence_of(scores),
            "bin_runs": [int(c) for c in counts],
            "bin_scale": hex_text(scale),
            "bin_share": [str(s) for s in bin_shares(profile)]
            if scores.law.k_law == "uniform"
            else None,
        },
        bin_eps=tuple(e if s < np.inf else None for e, s in zip(bin_eps, scale, strict=True)),
        intersample=tuple(term),
    )


def bin_shares(profile: Tube) -> list[Fraction]:
    """Exact share of K in every bin, row-major: the probability of the bin when k is uniform on
    K.
    """
    shares = [Fraction(1)]
    for edge in profile.edges:
        exact = [Fraction(float(x)) for x in edge]
        width = exact[-1] - exact[0]
        parts = [(high - low) / width for low, high in itertools.pairwise(exact)]
        shares = [share * part for share in shares for part in parts]
    return shares
