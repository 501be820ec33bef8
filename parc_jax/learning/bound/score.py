"""One number per run: by what factor the profile must grow to hold the whole run. [T1]"""

from collections.abc import Iterable
from dataclasses import dataclass

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.shapes import ManyParams, Paths, States
from parc_jax.learning.bound.claim import check_edges
from parc_jax.learning.bound.counts import RECORDINGS, RUNS, Unit
from parc_jax.learning.bound.measure import (
    Allowance,
    Errors,
    allowance,
    by_chunk,
    measure_arrays,
    measure_arrays_along,
)
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.predict import Layout, layout_of
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.copies import Marks, marks_of
from parc_jax.learning.runs.groups import worst_by_group
from parc_jax.learning.runs.law import LawSpec
from parc_jax.learning.runs.subject import Subject


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of n runs against a profile: S = max over coordinates of |error| / profile, or over
    pairs of faces of |u . error - centre| / half; infinite for a failed run. [T1, T26]

    rows (n,), k (n, n_k), score (n,) float64; worst (n,) int32: coordinate of the maximum,
    intervals (t, p), or (t, point, pair of faces), first, then final; ids (n,) content hashes.
    law, seed, stage: where the runs come from. subject: what they are about. groups: (n,) which
    recording a row is part of, None = every row its own run. marks: of recorded runs, to recognise
    copies. lost: (n,) as of `RolloutBatch`, 0 for a run that was made once.
    """

    rows: np.ndarray
    k: np.ndarray
    score: np.ndarray
    worst: np.ndarray
    ids: np.ndarray
    law: LawSpec
    subject: Subject
    seed: tuple[int, ...] | None
    stage: int | None
    groups: np.ndarray | None = None
    marks: Marks | None = None
    lost: np.ndarray | None = None

    @property
    def n(self) -> int:
        """Number of rows."""
        return self.score.shape[0]

    @property
    def unit(self) -> Unit:
        """What is independent."""
        return RUNS if self.groups is None else RECORDINGS

    def by_group(self) -> np.ndarray:
        """The independent scores: of every group its worst."""
        return worst_by_group(self.score, self.groups)


def score_batch(net: ReLUNetwork, batch: RolloutBatch, profile: Tube) -> Scores:
    """Scores of runs held in memory. Raises InputError."""
    return scores_of([net], [profile], [batch])[0]


def scores_of(
    nets: list[ReLUNetwork], profiles: list[Tube], batches: Iterable[RolloutBatch]
) -> list[Scores]:
    """Scores of the same runs, seen once and never held, for each network. Raises InputError."""
    seen = []
    for batch in batches:
        judged = [_judged(net, own, batch) for net, own in zip(nets, profiles, strict=True)]
        marks = marks_of(batch) if batch.seed is None else None
        lost = np.zeros(batch.n, np.int64) if batch.lost is None else batch.lost
        seen.append((batch.rows, batch.k, batch.hashes(), batch.groups, marks, lost, judged))
    found = jax.tree.map(lambda *parts: np.concatenate(parts), *seen)
    rows, k, ids, groups, marks, lost, judged = found
    about = (ids, batch.law, batch.subject, batch.seed, batch.stage, groups, marks, lost)
    return [Scores(rows, k, score, worst, *about) for score, worst in judged]


def _judged(net: ReLUNetwork, profile: Tube, batch: RolloutBatch) -> tuple[np.ndarray, np.ndarray]:
    check_profile(net, profile, layout_of(batch), batch.domain)
    slack = allowance(net, batch.domain, profile.layout)

    def judge(rows: np.ndarray):
        return score_arrays(net, slack, profile, batch.k[rows], batch.p[rows], batch.q[rows])

    return by_chunk(batch.n, judge)


def score_arrays(
    net: ReLUNetwork, slack: Allowance, profile: Tube, k: ManyParams, p: Paths, q: States
) -> tuple[np.ndarray, np.ndarray]:
    """Scores (n,) and worst coordinates (n,) of runs."""
    # on a shared edge a run must fit every bin that it touches
    ratio = np.maximum.reduce(
        [
            ratios(sizes(net, slack, profile, bins, k, p, q), profile, bins)
            for bins in profile.bins_of(k).T
        ]
    )
    return ratio.max(axis=1), ratio.argmax(axis=1).astype(np.int32)


def sizes(
    net: ReLUNetwork,
    slack: Allowance,
    held_by: Tube,
    bins: np.ndarray,
    k: ManyParams,
    p: Paths,
    q: States,
) -> Errors:
    """What `Tube.halves` of the bins (n,) must be at least to hold the runs: |error|, or its
    distance from the middle of the faces. Host arrays.
    """
    if held_by.templates is None:
        return jax.device_get(measure_arrays(net, slack, held_by.layout, k, p, q))
    along = Errors(*(given.directions[bins] for given in held_by.templates))
    seen = jax.device_get(measure_arrays_along(net, slack, held_by.layout, along, k, p, q))
    centres = (given.centre[bins] for given in held_by.templates)
    parts = zip(*seen, centres, strict=True)
    return Errors(*(np.maximum(most - centre, centre - least) for least, most, centre in parts))


def ratios(needed: Errors, profile: Tube, bins: np.ndarray) -> np.ndarray:
    """(n, coordinates) by what factor every half width of the bins (n,) must grow to the needed."""
    parts = zip(needed, profile.halves, strict=True)
    return np.concatenate([(e / half[bins]).reshape(len(bins), -1) for e, half in parts], axis=1)


def check_profile(net: ReLUNetwork, profile: Tube, layout: Layout, domain: Box) -> None:
    """Raises InputError where it does not fit network or K, or a width is zero or infinite."""
    n_end = net.n_out - layout.n_offsets + layout.n_c
    if profile.layout != layout or profile.n_c + profile.n_q != n_end or profile.n_k != net.n_in:
        raise InputError(
            f"profile: expected interval (bins, {layout.n_steps}, {layout.n_c}) of "
            f"{layout.n_points} reference points, final (bins, {n_end}), edges for {net.n_in} "
            f"axes; got {profile.interval.shape} of {profile.n_points}, {profile.final.shape}, "
            f"{profile.n_k} axes."
        )
    check_edges(profile, domain)
    widths = np.concatenate([half.reshape(-1) for half in profile.halves])
    if not (np.isfinite(widths).all() and (widths > 0).all()):
        raise InputError(
            "profile: expected finite widths > 0 (a floor); a zero width would make any error "
            "infinite."
        )
