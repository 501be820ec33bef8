"""One claim per bin of K, or per block of bins, with delta split over them. [T4]

Where the profile has fine bins, too few fresh runs fall into each: neighbouring bins joined into a
block have one claim, and one number, together.
"""

import itertools
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from parc_jax.claim.asked import BoundSettings
from parc_jax.claim.calibrate import evidence_of, kept_maximum, ledger, pac_label, scaled
from parc_jax.claim.claim import ErrorClaim, error_claim
from parc_jax.claim.counts import MOST, as_probability, most_discards, required_runs
from parc_jax.claim.fresh import check_fresh
from parc_jax.claim.profile import runs_per_bin
from parc_jax.claim.score import Scores
from parc_jax.claim.tube import Tube
from parc_jax.errors import InputError
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.spelling import hex_text


def calibrate_bins(
    net: ReLUNetwork,
    scores: Scores,
    profile: Tube,
    asked: BoundSettings | None = None,
    *,
    train: RolloutBatch | None = None,
    **options,
) -> ErrorClaim:
    """With confidence 1 - delta, in every claimed bin at once: a new run with k in the bin leaves
    it with probability <= eps.

    Stronger than one claim over K (it may be read bin by bin, and the planner may choose the bin
    afterwards), and dearer:
    each bin, or block of bins, needs its own runs, at delta / (bins x looks). A bin with too few
    runs gets no claim, never a small tube. Arguments as in `calibrate`, and `blocks`; discard
    counts per claim. Raises InputError.
    """
    asked = (asked or BoundSettings()).replace(**options)
    discard, looks, intersample = asked.discard, asked.looks, asked.intersample
    check_fresh(scores, train)
    if scores.groups is not None:
        raise InputError(
            "calibrate_bins: expected independent runs; these come in groups, whose runs may lie "
            'in several bins. Make one claim over K: calibrate, or claims = ("one",).'
        )
    eps, delta = as_probability("eps", asked.eps), as_probability("delta", asked.delta)
    block = block_of_bins(profile.grid, asked.blocks)
    n_blocks = int(block.max()) + 1
    share_of_delta = float(delta / (n_blocks * looks))
    numbers = block[profile.bins_of(scores.k)]
    counts = runs_per_bin(numbers, n_blocks)
    scale = np.full(n_blocks, np.inf)
    block_eps: list[Fraction | None] = [None] * n_blocks
    discards = []
    for number in range(n_blocks):
        inside = scores.score[(numbers == number).any(axis=1)]
        allowed = most_discards(len(inside), float(eps), share_of_delta)
        wanted = max(allowed, 0) if discard == MOST else discard
        if wanted <= allowed:
            scale[number] = kept_maximum(inside, wanted)
            block_eps[number], _ = pac_label(len(inside), eps, share_of_delta, discard)
            discards.append(wanted)
    if not discards:
        needed = required_runs(float(eps), share_of_delta, 0 if discard == MOST else discard)
        raise InputError(
            f"calibrate_bins: expected at least {needed:,} runs in a bin; the fullest of "
            f"{n_blocks} holds "
            f"{counts.max()}. Use fewer bins, a larger eps, or one claim over K (calibrate)."
        )
    step = scores.subject.time.dt_record
    term = intersample.term(step, profile.n_p, profile.n_points)
    scale = scale[block]
    place = "bin" if n_blocks == profile.n_bins else "block of bins"
    return error_claim(
        kind="pac",
        tube=scaled(profile, scale, term),
        subject=scores.subject,
        network=net.hash,
        quantifier=f"in each claimed {place} of K, a new rollout drawn from "
        f"{scores.law.describe()} with k in that {place.split()[0]}",
        eps=max(e for e in block_eps if e is not None),
        delta=delta,
        n=scores.n,
        discard=max(discards),
        looks=looks,
        law=scores.law,
        assumptions=ledger(intersample.assumption(step), scores.subject.rotation),
        evidence={
            "profile": profile.hash,
            **evidence_of(scores),
            "bin_runs": [int(c) for c in counts[block]],
            "bin_scale": hex_text(scale),
            "bin_share": [str(s) for s in block_shares(profile, block)]
            if scores.law.k_law == "uniform"
            else None,
        },
        bin_eps=tuple(
            block_eps[b] if s < np.inf else None for b, s in zip(block, scale, strict=True)
        ),
        intersample=tuple(term),
    )


def block_of_bins(grid: tuple[int, ...], blocks: Sequence[int] | None) -> np.ndarray:
    """(n_bins,) block of every bin of the grid, row-major; as evenly many bins in each as can be,
    and every bin its own block where blocks is None or finer. Raises InputError.
    """
    blocks = grid if blocks is None else tuple(blocks)
    if len(blocks) != len(grid) or min(blocks) < 1:
        raise InputError(
            f"blocks: expected {len(grid)} numbers >= 1, one per axis of K; got {blocks}."
        )
    number = np.zeros((), int)
    for n, along in zip(grid, blocks, strict=True):
        along = min(n, along)
        number = np.add.outer(number * along, np.arange(n) * along // n)
    return number.reshape(-1)


def block_shares(profile: Tube, block: np.ndarray) -> list[Fraction]:
    """For every bin the exact share of K in its block (n_bins,): what a claim about the block is
    worth for a set inside the bin. [T5]
    """
    whole = [Fraction(0)] * (int(block.max()) + 1)
    for number, share in zip(block, bin_shares(profile), strict=True):
        whole[number] += share
    return [whole[number] for number in block]


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
