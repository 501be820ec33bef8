"""One number per run: by what factor the profile must grow to hold the whole run. [T1]"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from parc_jax.claim.measure import Errors, measure
from parc_jax.claim.tube import Tube
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.network.predict import Layout, layout_of
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch, worst_by_group
from parc_jax.rollout.collect import stream_rollouts
from parc_jax.rollout.copies import Marks, marks_of
from parc_jax.rollout.law import LawSpec


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of n runs against a profile: S = max over coordinates of |error| / profile; infinite
    for a failed run.

    rows (n,), k (n, n_k), score (n,) float64; worst (n,) int32: coordinate of the maximum,
    intervals (t, column) first, then final; ids (n,) content hashes.
    law, seed, stage: where the runs come from. groups: (n,) which recording a row is part of, None
    = every row its own run. marks: of recorded runs, to recognise copies.
    """

    rows: np.ndarray
    k: np.ndarray
    score: np.ndarray
    worst: np.ndarray
    ids: np.ndarray
    law: LawSpec
    seed: tuple[int, ...] | None
    stage: int | None
    groups: np.ndarray | None = None
    marks: Marks | None = None

    @property
    def n(self) -> int:
        """Number of rows."""
        return self.score.shape[0]

    @property
    def each(self) -> str:
        """What is independent, and what a claim speaks of."""
        return "a new rollout" if self.groups is None else "any run of a new recording"

    def by_group(self) -> np.ndarray:
        """The independent scores: of every group its worst."""
        return worst_by_group(self.score, self.groups)


def score_batch(net: ReLUNetwork, batch: RolloutBatch, profile: Tube) -> Scores:
    """Scores of runs held in memory. Raises InputError."""
    return scores_of([net], [profile], [batch])[0]


def score_system(
    net: ReLUNetwork,
    system,
    key,
    profile: Tube,
    n: int,
    stage: Stage = Stage.BOUND,
    *,
    k=None,
    chunk: int | None = None,
    path=None,
    quiet: bool = False,
) -> Scores:
    """Scores of n fresh runs, never holding more than a few chunks of them; resumable when `path`
    (a folder) is given. Arguments as in `collect`. Does not consume `key`. Raises InputError.
    """
    check_profile(net, profile, layout_of(system))
    fresh = stream_rollouts(system, key, n, stage, k=k, chunk=chunk, path=path, quiet=quiet)
    return scores_of([net], [profile], fresh)[0]


def scores_of(
    nets: list[ReLUNetwork], profiles: list[Tube], batches: Iterable[RolloutBatch]
) -> list[Scores]:
    """Scores of the same runs against every network's profile; the runs are seen once, and never
    held. Raises InputError.
    """
    rows = []
    k = []
    ids = []
    groups = []
    marks = []
    score = [[] for _ in nets]
    worst = [[] for _ in nets]
    for batch in batches:
        rows.append(batch.rows)
        k.append(batch.k)
        ids.append(batch.hashes())
        groups.append(batch.groups)
        if batch.seed is None:
            marks.append(marks_of(batch))
        for number, (net, profile) in enumerate(zip(nets, profiles, strict=True)):
            check_profile(net, profile, layout_of(batch))
            largest, where = score_errors(measure(net, batch), profile, batch.k)
            score[number].append(largest)
            worst[number].append(where)
    common = {
        "rows": np.concatenate(rows),
        "k": np.concatenate(k),
        "ids": np.concatenate(ids),
        "law": batch.law,
        "seed": batch.seed,
        "stage": batch.stage,
        "groups": None if groups[0] is None else np.concatenate(groups),
        "marks": Marks(*map(np.concatenate, zip(*marks, strict=True))) if marks else None,
    }
    return [
        Scores(score=np.concatenate(s), worst=np.concatenate(w), **common)
        for s, w in zip(score, worst, strict=True)
    ]


def score_errors(errors: Errors, profile: Tube, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scores (n,) and worst coordinates (n,) of measured errors of runs with parameters k (n,
    n_k).
    """
    n = len(k)
    # on a shared edge a run must fit every bin that it touches
    interval, final = profile.narrowest_at(k)
    ratio = np.concatenate(
        [
            (np.asarray(errors.interval) / interval).reshape(n, -1),
            np.asarray(errors.final) / final,
        ],
        axis=1,
    )
    return ratio.max(axis=1), ratio.argmax(axis=1).astype(np.int32)


def check_profile(net: ReLUNetwork, profile: Tube, layout: Layout) -> None:
    """Refuse a profile that does not fit the network, or has a zero or infinite width. Raises
    InputError.
    """
    n_end = net.n_out - layout.n_offsets + layout.n_c
    if profile.layout != layout or profile.n_c + profile.n_q != n_end or profile.n_k != net.n_in:
        raise InputError(
            f"profile: expected interval (bins, {layout.n_steps}, {layout.n_c}) of "
            f"{layout.n_points} reference points, final (bins, {n_end}), edges for {net.n_in} "
            f"axes; got {profile.interval.shape} of {profile.n_points}, {profile.final.shape}, "
            f"{profile.n_k} axes."
        )
    widths = np.concatenate([profile.interval.reshape(-1), profile.final.reshape(-1)])
    if not (np.isfinite(widths).all() and (widths > 0).all()):
        raise InputError(
            "profile: expected finite widths > 0 (a floor); a zero width would make any error "
            "infinite."
        )
