"""One claim per bin of K, or per block of bins, with delta split over them. [T4]

Where the profile has fine bins, too few fresh runs fall into each: neighbouring bins joined into a
block have one claim, and one number, together.
"""

import itertools
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.spelling import hex_text
from parc_jax.learning.bound.asked import BoundSettings
from parc_jax.learning.bound.calibrate import kept_maximum, pac_label, shown_claim
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.counts import MOST, as_probability, most_discards, required_runs
from parc_jax.learning.bound.fresh import check_fresh
from parc_jax.learning.bound.profile import runs_per_bin
from parc_jax.learning.bound.score import Scores
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch


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
    afterwards), and dearer: each bin, or block of bins, needs its own runs, at delta / (bins x
    looks). A bin with too few runs gets no claim, never a small tube. Arguments as in `calibrate`,
    and `blocks`; discard counts per claim. Raises InputError.
    """
    asked = (asked or BoundSettings()).replace(**options)
    check_fresh(scores, train)
    if scores.groups is not None:
        raise InputError(
            "calibrate_bins: expected independent runs; these come in groups, whose runs may lie "
            'in several bins. Make one claim over K: calibrate, or claims = ("one",).'
        )
    eps, delta = as_probability("eps", asked.eps), as_probability("delta", asked.delta)
    block = block_of_bins(profile.grid, asked.blocks)
    n_blocks = int(block.max()) + 1
    share_of_delta = float(delta / (n_blocks * asked.looks))
    numbers = block[profile.bins_of(scores.k)]
    counts = runs_per_bin(numbers, n_blocks)
    inside = [scores.score[(numbers == number).any(axis=1)] for number in range(n_blocks)]
    shown = [_shown(score, eps, share_of_delta, asked.discard) for score in inside]
    known = [one for one in shown if one.eps is not None]
    if not known:
        discard = 0 if asked.discard == MOST else asked.discard
        needed = required_runs(float(eps), share_of_delta, discard)
        raise InputError(
            f"calibrate_bins: expected at least {needed:,} runs in a bin; the fullest of "
            f"{n_blocks} holds "
            f"{counts.max()}. Use fewer bins, a larger eps, or one claim over K (calibrate)."
        )
    scale = np.array([shown[b].scale for b in block])
    place = "bin" if n_blocks == profile.n_bins else "block of bins"
    uniform = scores.law.k_law == "uniform"
    return shown_claim(
        net,
        scores,
        profile,
        asked,
        scale,
        train=train,
        quantifier=f"in each claimed {place} of K, a new rollout drawn from "
        f"{scores.law.describe()} with k in that {place.split()[0]}",
        eps=max(one.eps for one in known),
        n=scores.n,
        discard=max(one.discard for one in known),
        evidence={
            "bin_runs": [int(c) for c in counts[block]],
            "bin_scale": hex_text(scale),
            "bin_share": [str(s) for s in block_shares(profile, block)] if uniform else None,
            "blocks": [one.spelled() for one in known],  # the checker does the sum again
            "blocks_asked": None if asked.blocks is None else list(asked.blocks),
        },
        bin_eps=tuple(shown[b].eps if shown[b].scale < np.inf else None for b in block),
    )


class _Shown(NamedTuple):
    """What the runs of a block of bins support: eps None, and no finite scale, where too few."""

    n: int
    scale: float
    eps: Fraction | None
    discard: int

    def spelled(self) -> dict:
        """What a file has of it, of all blocks with runs enough for a claim: numbers as text."""
        return {"n": self.n, "discard": self.discard, "eps": str(self.eps)}


def _shown(score: np.ndarray, eps: Fraction, delta: float, discard: int | str) -> _Shown:
    """Of runs with these scores (n,). discard: as of `BoundSettings`."""
    allowed = most_discards(len(score), float(eps), delta)
    wanted = max(allowed, 0) if discard == MOST else discard
    if wanted > allowed:
        return _Shown(len(score), np.inf, None, 0)
    supported, _ = pac_label(len(score), eps, delta, discard)
    return _Shown(len(score), float(kept_maximum(score, wanted)), supported, wanted)


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
    """(n_bins,) exact share of K of each bin's block: what its claim is worth for a set. [T5]"""
    whole = [Fraction(0)] * (int(block.max()) + 1)
    for number, share in zip(block, bin_shares(profile), strict=True):
        whole[number] += share
    return [whole[number] for number in block]


def bin_shares(profile: Tube) -> list[Fraction]:
    """Exact share of K in every bin, row-major: its probability when k is uniform on K."""
    shares = [Fraction(1)]
    for edge in profile.edges:
        exact = [Fraction(float(x)) for x in edge]
        width = exact[-1] - exact[0]
        parts = [(high - low) / width for low, high in itertools.pairwise(exact)]
        shares = [share * part for share in shares for part in parts]
    return shares
