"""A fresh holdout and a shape -> a tube and a claim. [T1, T2, T9]"""

from fractions import Fraction

import numpy as np

from parc_jax.arrays import content_hash
from parc_jax.error.claim import ErrorClaim
from parc_jax.error.counts import as_probability, most_discards, required_runs, supported_eps
from parc_jax.error.intersample import DISCRETE_TIME, AccelerationBound, DiscreteTime, SpeedBound
from parc_jax.error.score import Scores, score_batch
from parc_jax.error.tube import Tube, tube
from parc_jax.errors import InputError
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.system import TimeGrid

Intersample = DiscreteTime | SpeedBound | AccelerationBound
_OUTWARD = 1 + 2.0**-48  # the division that made the score and the product that undoes it, rounded up
_SHOWN = 32  # largest scores kept as evidence


def calibrate(
    net: ReLUNetwork,
    holdout: RolloutBatch | Scores,
    shape: Tube,
    eps=1e-3,
    delta=1e-3,
    *,
    time: TimeGrid | None = None,
    discard: int | str = 0,
    looks: int = 1,
    kind: str = "pac",
    intersample: Intersample = DISCRETE_TIME,
    train: RolloutBatch | None = None,
) -> ErrorClaim:
    """The claim that a holdout supports about tube = (largest score) x shape. [T1, T2]

    holdout: runs that neither the network nor the shape has seen, i.i.d. from one law, or their `Scores` (then `time`
    is needed).
    eps, delta: asked for. With too few runs the claim carries the eps that they do support, and says so.
    discard: runs to leave outside, fixed before the holdout is seen; "most" = as many as n, eps, delta allow.
    looks: how many times this holdout is used in all (nets compared, retries); each look gets delta / looks.
    kind: "pac", or "conformal" for the marginal reading. intersample: what happens between records. [T9]
    train: the training runs, to refuse any of them in the holdout. A failed run has an infinite score.
    Raises InputError, also for repeated runs.
    """
    scores, time = _scored(net, holdout, shape, time)
    check_fresh(scores, train)
    eps, delta = as_probability("eps", eps), as_probability("delta", delta)
    if looks < 1 or kind not in ("pac", "conformal"):
        raise InputError(f'calibrate: expected looks >= 1 and kind "pac" or "conformal"; got {looks}, {kind!r}.')
    evidence = {"network": net.hash, "shape": shape.hash, **evidence_of(scores)}
    if train is not None:
        evidence["train"] = content_hash(train.k, train.q)
    if kind == "pac":
        claimed, discard = pac_label(scores.n, eps, delta / looks, discard)
        if claimed != eps:
            evidence["eps_asked"] = (
                f"eps = {float(eps):g} (needs {required_runs(float(eps), float(delta / looks), discard):,} runs)"
            )
    else:
        discard = int(eps * (scores.n + 1)) - 1 if discard == "most" else discard
        claimed, delta = Fraction(discard + 1, scores.n + 1), None
        if claimed >= 1:
            raise InputError(f"calibrate: {scores.n} runs with {discard} discards support no claim; collect more.")
    scale = float(kept_maximum(scores.score, discard))
    evidence["scale"] = scale.hex()
    term = intersample.term(time.dt_record, shape.interval.shape[2])
    return ErrorClaim(
        kind=kind,
        tube=scaled(shape, np.full(shape.n_bins, scale), term),
        quantifier=f"a new rollout drawn from {scores.law.describe()}",
        eps=claimed,
        delta=delta,
        n=scores.n,
        discard=discard,
        looks=looks,
        law=scores.law,
        assumptions=ledger(intersample.assumption(time.dt_record)),
        evidence=evidence,
        intersample=tuple(term),
    )


def kept_maximum(score: np.ndarray, discard: int) -> np.ndarray:
    """The (discard + 1)-th largest of the scores along the last axis: all but `discard` runs fit. [T2]"""
    return np.sort(score, axis=-1)[..., score.shape[-1] - 1 - discard]


def pac_label(n: int, eps: Fraction, delta: Fraction, discard: int | str) -> tuple[Fraction, int]:
    """(eps that n runs support, discards), at least the eps asked for. Raises InputError if none."""
    if discard == "most":
        discard = max(0, most_discards(n, float(eps), float(delta)))
    if required_runs(float(eps), float(delta), discard) <= n:
        return eps, discard
    supported = supported_eps(n, float(delta), discard)
    if supported is None:
        raise InputError(
            f"calibrate: {n} runs with {discard} discards support no eps at delta = {float(delta):g}; collect more."
        )
    return supported, discard


def scaled(shape: Tube, scale: np.ndarray, term: np.ndarray) -> Tube:
    """Tube scale_b x shape_b + term, rounded up; an infinite scale (n_bins,) leaves its bin without claim."""
    scale = np.asarray(scale, np.float64)
    interval = np.nextafter((scale[:, None, None] * shape.interval + term) * _OUTWARD, np.inf)
    return tube(shape.edges, interval, np.nextafter(scale[:, None] * shape.final * _OUTWARD, np.inf))


def evidence_of(scores: Scores) -> dict:
    """What is kept of a holdout: its identity and its worst runs."""
    order = np.argsort(-scores.score, kind="stable")[:_SHOWN]
    worst = [
        {
            "row": int(scores.rows[i]),
            "score": float(scores.score[i]).hex(),
            "k": [float(x).hex() for x in scores.k[i]],
            "coordinate": int(scores.worst[i]),
        }
        for i in order
    ]
    return {
        "holdout": content_hash(scores.k, scores.score),
        "holdout_rows": [int(scores.rows.min()), int(scores.rows.max())],
        "seed": None if scores.seed is None else list(scores.seed),
        "stage": scores.stage,
        "failed": int(np.isinf(scores.score).sum()),
        "worst": worst,
    }


def check_fresh(scores: Scores, train: RolloutBatch | None) -> None:
    """Refuse repeated runs, and runs of the training data. Raises InputError."""
    ids = scores.ids if scores.ids is not None else scores.rows
    repeated = len(ids) - len(np.unique(ids))
    if repeated:
        raise InputError(
            f"holdout: {repeated} of {len(ids)} runs occur twice; expected independent runs. Remove the copies."
        )
    if train is None:
        return
    shared = 0
    if scores.ids is not None:
        shared = int(np.isin(scores.ids, train.hashes()).sum())
    if scores.law.k_law == "uniform":  # two independent uniform draws of k are never equal
        shared = max(shared, int(np.isin(_row_bytes(scores.k), _row_bytes(train.k)).sum()))
    if scores.seed is not None and (scores.seed, scores.stage) == (train.seed, train.stage):
        shared = max(shared, int(np.isin(scores.rows, train.rows).sum()))
    if shared:
        raise InputError(
            f"holdout: {shared} of {scores.n} runs are training runs; expected fresh ones. Draw from stage BOUND."
        )


def ledger(between: str) -> tuple[str, ...]:
    """Assumptions every statistical claim rests on."""
    return ("IID", "TRANSLATION_INVARIANCE", between, "DEPLOYMENT_LAW = CALIBRATION_LAW")


def _scored(net, holdout, shape, time) -> tuple[Scores, TimeGrid]:
    if isinstance(holdout, RolloutBatch):
        return score_batch(net, holdout, shape), holdout.time
    if time is None:
        raise InputError("calibrate: expected time (the TimeGrid of the runs) beside Scores.")
    return holdout, time


def _row_bytes(k: np.ndarray) -> np.ndarray:
    k = np.ascontiguousarray(k, "<f8")
    return k.view(f"V{k.shape[1] * 8}").ravel()
