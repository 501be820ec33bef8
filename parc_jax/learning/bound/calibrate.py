"""A fresh holdout and a profile -> a tube and a claim. [T1, T2, T9]"""

from fractions import Fraction

import numpy as np

from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import hex_text, listed, rounded_up
from parc_jax.learning.bound.asked import BoundSettings
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
from parc_jax.learning.bound.fresh import check_fresh, freshness, left_out, short_ids
from parc_jax.learning.bound.score import Scores, score_batch
from parc_jax.learning.bound.start_gap import invariances
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.labels import name_of
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.subject import Subject

# the division that made the score and the product that undoes it, rounded up
_OUTWARD = 1 + 2.0**-48
_SHOWN = 32  # largest scores kept as evidence


def calibrate(
    net: ReLUNetwork,
    holdout: RolloutBatch | Scores,
    profile: Tube,
    asked: BoundSettings | None = None,
    *,
    train: RolloutBatch | None = None,
    **options,
) -> ErrorClaim:
    """The claim that a holdout supports about tube = (largest score) x profile. [T1, T2]

    holdout: runs that neither the network nor the profile has seen, i.i.d. from one law, or their
        `Scores`.
    asked, or options by name: `eps`, `delta`, `discard`, `looks` and `intersample` of
        `BoundSettings`. With too few runs the claim carries the larger eps that they support, and
        says so; of more than needed as many are discarded as eps and delta allow, or with a number
        of discards the eps is smaller. Each of the looks (nets compared, retries) gets delta /
        looks.
    train: the training runs, to refuse any of them in the holdout. A failed run has an infinite
        score.
    Runs that come in groups (parts of one recording) count as one: n is the number of groups, and
    the score of a group is its worst. Raises InputError, also for repeated runs and near copies.
    """
    asked = (asked or BoundSettings()).replace(**options)
    recorded = isinstance(holdout, RolloutBatch)
    scores = score_batch(net, holdout, profile) if recorded else holdout
    check_fresh(scores, train)
    eps, delta = as_probability("eps", asked.eps), as_probability("delta", asked.delta)
    evidence = {}
    unit = scores.unit
    where = " whose k lies in K," if scores.law.fitted else ""
    independent = scores.by_group()
    n = len(independent)
    claimed, discard = pac_label(n, eps, delta / asked.looks, asked.discard, unit)
    if claimed > eps:
        needed = required_runs(float(eps), float(delta / asked.looks), discard)
        evidence["eps_asked"] = f"eps = {rounded_up(eps, 10)} (needs {needed:,} {unit.many})"
    scale = float(kept_maximum(independent, discard))
    evidence["scale"] = scale.hex()
    return shown_claim(
        net,
        scores,
        profile,
        asked,
        np.full(profile.n_bins, scale),
        train=train,
        quantifier=f"{unit.each}{where} drawn from {scores.law.describe()}",
        eps=claimed,
        n=n,
        discard=discard,
        evidence=evidence,
    )


def shown_claim(
    net: ReLUNetwork,
    scores: Scores,
    profile: Tube,
    asked: BoundSettings,
    scale: np.ndarray,
    *,
    train: RolloutBatch | None,
    evidence: dict,
    **fields,
) -> ErrorClaim:
    """The claim that a holdout shows about the profile times scale (n_bins,). train: as of
    `calibrate`. evidence: beside that of the holdout. fields: further ones of `ErrorClaim`.
    """
    if train is not None:
        evidence = {"train": content_hash(train.k, train.q)} | evidence
    step = scores.subject.time.dt_record
    term = asked.intersample.term(step, profile.n_p, profile.n_points)
    return error_claim(
        kind="pac",
        tube=scaled(profile, scale, term),
        subject=scores.subject,
        network=net.hash,
        delta=as_probability("delta", asked.delta),
        looks=asked.looks,
        law=scores.law,
        assumptions=(
            *ledger(asked.intersample.assumption(step), scores.subject, scores.lost),
            *freshness(scores, train),
        ),
        evidence={"profile": profile.hash, **evidence_of(scores, train), **evidence},
        intersample=tuple(term),
        **fields,
    )


def kept_maximum(score: np.ndarray, discard: int) -> np.ndarray:
    """The (discard + 1)-th largest score along the last axis: all but `discard` runs fit. [T2]"""
    return np.sort(score, axis=-1)[..., score.shape[-1] - 1 - discard]


def pac_label(
    n: int, eps: Fraction, delta: Fraction, discard: int | str, unit: Unit = RUNS
) -> tuple[Fraction, int]:
    """(eps that n runs, or recordings, support, discards): the eps asked for where "most" of those
    beyond its need are discarded; else whatever they support, less when there are more of them. All
    of it is fixed before a run is seen. Raises InputError if they support none.
    """
    spent = discard == MOST
    if spent:
        discard = max(0, most_discards(n, float(eps), float(delta)))
    needed = required_runs(float(eps), float(delta), discard)
    if n == needed or (n > needed and spent):
        return eps, discard
    supported = supported_eps(n, float(delta), discard)
    if supported is None:
        raise InputError(
            f"calibrate: {n} {unit.many} with {discard} discards support no eps at delta = "
            f"{rounded_up(delta, 10)}; collect more."
        )
    return supported, discard


def scaled(profile: Tube, scale: np.ndarray, term: np.ndarray) -> Tube:
    """Tube scale_b x shape_b + term (n_c,), rounded up; an infinite scale (n_bins,) leaves its bin
    without claim.
    """
    scale = np.asarray(scale, np.float64)
    grown = [
        np.nextafter((scale.reshape(-1, *[1] * (half.ndim - 1)) * half + more) * _OUTWARD, np.inf)
        for half, more in zip(profile.halves, profile.halves_around(term, 0.0), strict=True)
    ]
    return profile.with_halves(*grown)


def evidence_of(scores: Scores, train: RolloutBatch | None) -> dict:
    """The identity of calibration runs, how many were left out before, and the worst ones."""
    order = np.argsort(-scores.score, kind="stable")[:_SHOWN]
    worst = [
        {
            "row": int(scores.rows[i]),
            "score": hex_text(scores.score[i]),
            "k": hex_text(scores.k[i]),
            "coordinate": int(scores.worst[i]),
        }
        for i in order
    ]
    grouped = {}
    if scores.groups is not None:
        names = np.unique(scores.groups)
        grouped = {RECORDED_ROWS: scores.n, "recordings": content_hash(names)}
    recorded = {}
    if scores.seed is None:
        gaps = left_out(scores, train)
        recorded = {"runs": sorted(short_ids(scores.ids))} | ({"left_out": gaps} if gaps else {})
    return {
        **grouped,
        **recorded,
        **_lost(scores.lost),
        "holdout": content_hash(scores.k, scores.score),
        "holdout_rows": [int(scores.rows.min()), int(scores.rows.max())],
        "seed": None if scores.seed is None else list(scores.seed),
        "stage": scores.stage,
        "failed": int(np.isinf(scores.by_group()).sum()),
        "worst": worst,
    }


def _lost(lost: np.ndarray | None) -> dict:
    """Evidence of runs that were made again: how many, or that nobody counted."""
    if lost is None or not lost.any():
        return {}
    return {"lost": "uncounted" if (lost < 0).any() else int((lost > 0).sum())}


def hidden_start(about: Subject) -> tuple[str, ...]:
    """What is assumed of the start where some of it is measured and goes into k: what is not
    measured is distributed in use as in the runs, given what is. [T37]
    """
    names = [name_of(about.labels.k[axis]) for axis in about.given]
    return (f"HIDDEN_START(given {listed(names)})",) if names else ()


def ledger(between: str, about: Subject, lost: np.ndarray | None = None) -> tuple[str, ...]:
    """Assumptions every statistical claim rests on. lost: (n,) as of `Scores`. [T33, T37]"""
    again = [f"WORKERS_LOST({n}, independent of the run)" for n in _lost(lost).values()]
    return (
        "IID",
        *again,
        *invariances(about.rotation),
        *hidden_start(about),
        between,
        "DEPLOYMENT_LAW = CALIBRATION_LAW",
        "UNCHANGED_SYSTEM",
    )
