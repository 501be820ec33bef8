"""A fresh calibration set and an error shape -> tube and claim, over K or per bin. [T1, T2, T4]"""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError, check_count
from parc_jax.common.options import refuse_unused
from parc_jax.common.spelling import counted, hex_text, rounded_up
from parc_jax.learning.bound.bins import block_shares
from parc_jax.learning.bound.claim import ErrorClaim, error_claim
from parc_jax.learning.bound.counts import (
    MOST,
    RECORDED_ROWS,
    RUNS,
    Unit,
    as_probability,
    most_discards,
    required_runs,
    supported_eps,
)
from parc_jax.learning.bound.fresh import check_fresh, freshness, left_out, named_runs, trained_on
from parc_jax.learning.bound.measure import Scores, scores_of
from parc_jax.learning.bound.profile import runs_per_bin
from parc_jax.learning.bound.settings import BoundSettings, check_between
from parc_jax.learning.bound.start_gap import invariances
from parc_jax.learning.bound.tube import Tube, tube_to_json
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.law import LOG, Subject

# the division that made the score and the product that undoes it, rounded up
_OUTWARD = 1 + 2.0**-48
_SHOWN = 32  # largest scores kept as evidence
OF_RUNS = ("shape", "fresh", "profile_runs", "gap", "bins", "claims")  # not of a calibration
CALIBRATED = "with runs and a profile, about which one claim is made"
BEGINS = "BEGINS_WITH_HEADING_0"


def calibrate(
    net: ReLUNetwork,
    holdout: RolloutBatch | Scores,
    profile: Tube,
    *,
    train: RolloutBatch | None = None,
    **options,
) -> ErrorClaim:
    """The claim that a calibration set supports about tube = (largest score) x profile. [T1, T2]

    holdout: calibration set, unseen by network and profile, i.i.d. from one law; or its `Scores`.
    options: `eps`, `delta`, `discard`, `looks` and `intersample` of `BoundSettings`. With too few
        runs the claim carries the larger eps that they support; of more than needed as many are
        discarded as eps and delta allow, or with a number of discards the eps is smaller. Each of
        the looks (nets compared, retries) gets delta / looks.
    train: the training runs, to refuse any of them in the calibration set.
    A failed run has an infinite score. Runs that come in groups (parts of one recording) count as
    one: n is the number of groups, and the score of a group is its worst. Raises InputError, also
    for repeated runs and near copies.
    """
    settings = BoundSettings().replace(**options)
    refuse_unused(settings, (*OF_RUNS, "blocks"), CALIBRATED, options)
    scores = _scored(net, profile, holdout)
    check_fresh(scores, train)
    eps, delta = as_probability("eps", settings.eps), as_probability("delta", settings.delta)
    unit, independent = scores.unit, scores.by_group()
    n = len(independent)
    supported, discard = pac_label(n, eps, delta / settings.looks, settings.discard, unit)
    scale = float(kept_maximum(independent, discard))
    evidence = {}
    if supported > eps:
        needed = required_runs(float(eps), float(delta / settings.looks), discard)
        evidence["eps_asked"] = f"eps = {rounded_up(eps, 10)} (needs {needed:,} {unit.many})"
    evidence["scale"] = scale.hex()
    where = " whose k lies in K," if scores.law.fitted else ""
    said = f"{unit.each}{where} drawn from {scores.law.describe()}"
    shown = {"quantifier": said, "eps": supported, "n": n, "discard": discard}
    about = net, scores, profile, settings, train
    return _pac_claim(*about, np.full(profile.n_bins, scale), evidence, **shown)


def _scored(net: ReLUNetwork, profile: Tube, holdout: RolloutBatch | Scores) -> Scores:
    """Scores of a calibration set. Raises InputError for those of another network or profile."""
    scores = holdout if isinstance(holdout, Scores) else scores_of(net, profile, [holdout])
    if scores.of != (net.hash, profile.hash):
        raise InputError("holdout: expected scores of this network and profile; got other ones.")
    return scores


def _pac_claim(
    net: ReLUNetwork,
    scores: Scores,
    profile: Tube,
    settings: BoundSettings,
    train: RolloutBatch | None,
    scale: np.ndarray,
    evidence: dict,
    **fields,
) -> ErrorClaim:
    """The claim about the profile times scale (n_bins,). evidence: beside that of the runs."""
    check_between(settings.intersample, scores, scores.moves)
    more = trained_on(train, scores)
    if scores.seed is None:  # tests by recordings scale this shape, and are none of these runs
        more |= {"shape": tube_to_json(profile)}
    about, step = scores.subject, scores.subject.time.dt_record
    term = settings.intersample.term(step, profile.n_p, profile.n_points)
    between = settings.intersample.assumption(step)
    return error_claim(
        kind="pac",
        tube=scaled(profile, scale, term),
        subject=about,
        network=net.hash,
        delta=as_probability("delta", settings.delta),
        looks=settings.looks,
        law=scores.law,
        assumptions=(
            *ledger(between, about, scores.lost, left_out(scores, train)),
            f"UNSEEN({counted(settings.looks, 'look')}; network, profile, eps and discards were "
            "settled before these runs; each further claim from them adds its own delta)",
            *freshness(scores, train),
        ),
        evidence={"profile": profile.hash} | evidence_of(scores, train) | more | evidence,
        intersample=tuple(term),
        **fields,
    )


def kept_maximum(score: np.ndarray, discard: int) -> np.ndarray:
    """The (discard + 1)-th largest score along the last axis: all but `discard` runs fit. [T2]"""
    return np.sort(score, axis=-1)[..., score.shape[-1] - 1 - discard]


def pac_label(
    n: int, eps: Fraction, delta: Fraction, discard: int | str, unit: Unit = RUNS
) -> tuple[Fraction, int]:
    """(eps that n runs, or recordings, support, discards): the given eps where "most" of the runs
    beyond its need are discarded; else the supported eps, which falls with n. All of it is fixed
    before a run is scored. Raises InputError if they support none.
    """
    spent = discard == MOST
    if spent:
        discard = max(0, most_discards(n, float(eps), float(delta)))
    needed = required_runs(float(eps), float(delta), discard)
    if n == needed or (n > needed and spent):
        return eps, discard
    if (supported := supported_eps(n, float(delta), discard)) is None:
        raise InputError(
            f"calibrate: {n} {unit.many} with {discard} discards support no eps at delta = "
            f"{rounded_up(delta, 10)}; collect more."
        )
    return supported, discard


def scaled(profile: Tube, scale: np.ndarray, term: np.ndarray) -> Tube:
    """Tube scale_b x shape_b + term (n_c,), rounded up; no claim in bins of infinite scale."""
    grown = [
        np.nextafter((scale.reshape(-1, *[1] * (half.ndim - 1)) * half + more) * _OUTWARD, np.inf)
        for half, more in zip(profile.halves, profile.halves_around(term, 0.0), strict=True)
    ]
    return profile.with_halves(*grown)


def evidence_of(scores: Scores, train: RolloutBatch | None) -> dict:
    """Identity of the calibration runs, number of those left out before, and the worst ones."""
    worst = [
        {
            "row": int(scores.rows[i]),
            "score": hex_text(scores.score[i]),
            "k": hex_text(scores.k[i]),
            "coordinate": int(scores.worst[i]),
        }
        for i in np.argsort(-scores.score, kind="stable")[:_SHOWN]
    ]
    source: dict = {}
    if scores.groups is not None:
        recordings = content_hash(np.unique(scores.groups))
        source = {RECORDED_ROWS: scores.n, "recordings": recordings}
    if gaps := left_out(scores, train):
        source["left_out"] = gaps
    return {
        **source,
        **named_runs(scores),
        **lost_among(scores.lost),
        "holdout": content_hash(scores.k, scores.score),
        "holdout_rows": [int(scores.rows.min()), int(scores.rows.max())],
        "seed": None if scores.seed is None else list(scores.seed),
        "stage": scores.stage,
        "failed": int(np.isinf(scores.by_group()).sum()),
        "worst": worst,
    }


def lost_among(lost: np.ndarray | None) -> dict:
    """Evidence of runs that were made again: how many, or that nobody counted. [T33]"""
    if lost is None or not lost.any():
        return {}
    return {"lost": "uncounted" if (lost < 0).any() else int((lost > 0).sum())}


def about_left_out(gone: int, how: str = "") -> list[str]:
    """The assumption about so many rows that were left out, how; none about none."""
    return [f"LEFT_OUT({gone:,} of their log{how})"] * bool(gone)


def begins(about: Subject) -> list[str]:
    """The assumption about the frames of logged runs that turn; none about others."""
    return [BEGINS] * (about.rotation is not None and about.system.startswith(LOG))


def ledger(between: str, about: Subject, lost: np.ndarray | None, gone: int = 0) -> tuple[str, ...]:
    """Assumptions of every sentence about runs. lost: (n,) as of `Scores`. gone: rows left out."""
    return (
        "IID",
        *(f"WORKERS_LOST({n}, independent of the run)" for n in lost_among(lost).values()),
        *about_left_out(gone, ", with k outside of K, or independent of k and run"),
        *invariances(about.rotation),
        *begins(about),
        *about.hidden,
        between,
        "DEPLOYMENT_LAW = CALIBRATION_LAW",
        "UNCHANGED_SYSTEM",
    )


def calibrate_bins(
    net: ReLUNetwork,
    holdout: RolloutBatch | Scores,
    profile: Tube,
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
    settings = BoundSettings().replace(**options)
    refuse_unused(settings, OF_RUNS, CALIBRATED, options)
    scores = _scored(net, profile, holdout)
    check_fresh(scores, train)
    if scores.groups is not None:
        raise InputError(
            "calibrate_bins: expected independent runs; these come in groups, whose runs may lie "
            'in several bins. Make one claim over K: calibrate, or claims = ("one",).'
        )
    eps, delta = as_probability("eps", settings.eps), as_probability("delta", settings.delta)
    block = block_of_bins(profile.grid, settings.blocks)
    n_blocks = int(block.max()) + 1
    share_of_delta = float(delta / (n_blocks * settings.looks))
    numbers = block[profile.bins_of(scores.k)]
    uniform = scores.law.k_law == "uniform"
    if not (uniform and scores.seed is not None) and (numbers != numbers[:, :1]).any():
        raise InputError(
            "calibrate_bins: expected no k on an edge between bins, where its run counts in both: "
            'move the edge (bins=), or make one claim over K: calibrate, or claims = ("one",).'
        )
    counts = runs_per_bin(numbers, n_blocks)
    # a run on a border between blocks counts in each of them
    inside = [scores.score[(numbers == number).any(axis=1)] for number in range(n_blocks)]
    scales, supported, blocks = np.full(n_blocks, np.inf), [None] * n_blocks, []
    fewest = 0 if settings.discard == MOST else settings.discard
    for number, score in enumerate(inside):
        n = len(score)
        if fewest <= most_discards(n, float(eps), share_of_delta):  # else no claim, infinite scale
            supported[number], discard = pac_label(n, eps, share_of_delta, settings.discard)
            scales[number] = kept_maximum(score, discard)
            blocks.append((n, discard, supported[number]))
    if not blocks:
        needed = required_runs(float(eps), share_of_delta, fewest)
        raise InputError(
            f"calibrate_bins: expected at least {needed:,} runs in a bin; the fullest of "
            f"{n_blocks} holds {counts.max()}. Use fewer bins, a larger eps, or calibrate over K."
        )
    scale = scales[block]
    place = "bin" if n_blocks == profile.n_bins else "block of bins"
    evidence = {
        "bin_runs": [int(c) for c in counts[block]],
        "bin_scale": hex_text(scale),
        "bin_share": [str(s) for s in block_shares(profile.edges, block)] if uniform else None,
        # the checker does the sum again
        "blocks": [{"n": n, "discard": d, "eps": str(e)} for n, d, e in blocks],
        "blocks_asked": None if settings.blocks is None else list(settings.blocks),
    }
    about = net, scores, profile, settings, train
    return _pac_claim(
        *about,
        scale,
        evidence,
        quantifier=f"in each claimed {place} of K, a new rollout drawn from "
        f"{scores.law.describe()} with k in that {place.split()[0]}",
        eps=max(eps for _, _, eps in blocks),
        n=scores.n,
        discard=max(discard for _, discard, _ in blocks),
        bin_eps=tuple(supported[b] if scales[b] < np.inf else None for b in block),
    )


def block_of_bins(grid: tuple[int, ...], blocks: Sequence[int] | None) -> np.ndarray:
    """(n_bins,) block of every bin of the grid, row-major; as evenly many bins in each as can be,
    and every bin its own block where blocks is None or finer. Raises InputError.
    """
    blocks = grid if blocks is None else tuple(blocks if np.iterable(blocks) else [blocks])
    for n in blocks:
        check_count("blocks", n, 1, "None for a claim in every bin")
    if len(blocks) != len(grid):
        raise InputError(f"blocks: expected {len(grid)} numbers >= 1, one per axis; got {blocks}.")
    number = np.zeros((), int)
    for n, along in zip(grid, blocks, strict=True):
        along = min(n, along)
        number = np.add.outer(number * along, np.arange(n) * along // n)
    return number.reshape(-1)
