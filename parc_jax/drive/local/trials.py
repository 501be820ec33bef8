"""Tests of plans, fixed before they are made: fresh runs of a plan that was chosen, or of plans
drawn from nested sets, or recorded runs that nothing has seen, moved to drawn starts. [T6, T42]
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.drive.local.nested import levels_of, shape_of
from parc_jax.learning.bound.calibrate import ledger
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.fresh import CALIBRATION, check_fresh, seen_in_training, used_by
from parc_jax.learning.bound.measure import scores_of
from parc_jax.learning.bound.settings import DISCRETE_TIME
from parc_jax.learning.bound.start_gap import ALIKE, StartTrial, invariances, off_from_start
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.law import OF_EACH, logged_on
from parc_jax.learning.system import System
from parc_jax.safe_set.corridors.safe_plans import SafePlans
from parc_jax.safe_set.verdict.outcomes import reached_and_touched
from parc_jax.safe_set.verdict.scene import Scene

CHUNK = 256  # runs per compiled call, as of all large collections
UNSEEN = (
    "UNSEEN(1 look; network, K, error shape and scales were settled before these recordings; each "
    "further claim from them adds its own delta)"
)


class Trial(NamedTuple):
    """Tests of nested sets. inside, failed: (sets, tests) bool: which tests are of which set, and
    which of these failed. lost: (tests,) as of `RolloutBatch`. start: as of `trial_of`.
    """

    inside: np.ndarray
    failed: np.ndarray
    lost: np.ndarray
    start: StartTrial | None = None


def run_once(
    system: System,
    scene: Scene,
    key: jax.Array,
    stage: Stage,
    plans: np.ndarray,
    quiet: bool,
    start: StartTrial | None = None,
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Plans (n, n_p + n_k) run once each, from the origin and moved to their starts, as those
    behind the claim: failed (n,), which miss the goal, touch something or do not return, by any run
    that begins where they do as far as `start` or the claim declares; lost (n,); and whether all
    of them are the same for the same k.
    """
    p0, k = np.split(plans, [scene.model.n_p], axis=1)
    failed, lost, first, ended = [], [], 0, set()
    off = off_from_start(scene.model.claim, start)
    for runs in stream_rollouts(system, key, len(k), stage, k=k, chunk=CHUNK, quiet=quiet):
        reached, touched = reached_and_touched(scene, runs, p0[first : first + runs.n], off)
        failed.append(runs.failed | ~reached | touched)
        lost.append(np.zeros(runs.n) if runs.lost is None else runs.lost)
        first += runs.n
        each = zip(runs.k, runs.p, runs.q, strict=True)  # of failed ones NaN, another end too
        ended |= {(k.tobytes(), hash(p.tobytes() + q.tobytes())) for k, p, q in each}
    alike = len(ended) == len({k for k, _ in ended})
    return np.concatenate(failed), np.concatenate(lost), alike


def by_recordings(
    runs: RolloutBatch, sets: Sequence[SafePlans], rng: np.random.Generator, first: int
) -> Trial:
    """Recorded runs, each of another recording, moved to a start of each set from `first` on that
    has one for its k: the first of ENDS drawn ones that the set holds, so uniform on all.
    """
    scene = sets[-1].scene
    p0, levels = levels_of(sets, rng, runs.k)
    inside = levels.min(axis=1) <= np.arange(len(sets))[:, None]
    failed, off = np.zeros_like(inside), off_from_start(scene.model.claim)
    tried = np.full(runs.n, -1)
    for i in range(first, len(sets)):
        at = (levels <= i).argmax(axis=1)
        new = np.flatnonzero(inside[i] & (at != tried))
        failed[i] = failed[i - 1]  # from the same start as in the set before
        if len(new):
            reached, touched = reached_and_touched(scene, runs.select(new), p0[new, at[new]], off)
            failed[i, new] = ~reached | touched
        tried[new] = at[new]
    return Trial(inside, failed, np.zeros(runs.n) if runs.lost is None else runs.lost)


def ledger_of_tests(
    claim: ErrorClaim, lost: np.ndarray, gone: int = 0, start: StartTrial | None = None
) -> tuple[str, ...]:
    """The ledger of further runs of the system of a claim, which are judged at their records and
    moved to where they are said to begin: with what was tried of that, or the claim declares.
    Others: of these.
    """
    about = claim.subject
    between = DISCRETE_TIME.assumption(about.time.dt_record)
    names = invariances(about.rotation)
    said = claim.assumptions if start is None else start.said_in(names)
    moved = {entry.partition("(")[0]: entry for entry in said if entry.startswith(names)}
    told = [moved.get(entry, entry) for entry in ledger(between, about, lost, gone)]
    return (*told, *(entry for entry in said if entry.startswith(ALIKE)))


def one_of_each(
    model: TrajectoryModel, runs: RolloutBatch, rng: np.random.Generator
) -> RolloutBatch:
    """A run of each recording, drawn from those with k in K where it has any, as its law says, of
    runs of the robot of this model that its training has not seen. Raises InputError.
    """
    # recordings state neither robot nor rotation, and none are taken whose k was measured
    about, free = replace(model.claim.subject, given=()), ("K", "system", "rotation")
    where = f"validate: recordings of the robot of this model, and those of {runs.name}"
    about.agree(where, runs.subject, free, "Record such runs, or learn from these.")
    if runs.seed is not None:
        raise InputError(
            f"validate: expected recordings; these runs of {runs.name} were collected with a key, "
            "of which training may have had a part. Pass the system."
        )
    K, shape = model.domain, shape_of(model.claim)
    if runs.law.lacks(K):
        raise InputError(
            f"validate: expected recordings with all k of the model's K; those of {runs.name} "
            "outside of a smaller box were left out, and were they tested nobody knows the "
            "result. Load them with the K of the model: domain=model.domain."
        )
    inside = runs.select(K.contains(runs.k)).replace(domain=K, law=logged_on(runs.law, K))
    if inside.n:  # as of a calibration set: independent, and none that the K was fitted to
        check_fresh(scores_of(model.net, shape, [inside]), None)
    _require_unseen(model.claim, runs)
    groups = np.arange(runs.n) if runs.groups is None else runs.groups
    order = rng.permutation(runs.n)
    order = order[np.argsort(~K.contains(runs.k[order]), kind="stable")]  # those in K come first
    one = runs.select(np.sort(order[np.unique(groups[order], return_index=True)[1]]))
    law = replace(runs.law, parameters=tuple(sorted({*runs.law.parameters, OF_EACH})))
    return one if runs.groups is None else one.replace(law=law)


def _require_unseen(claim: ErrorClaim, runs: RolloutBatch) -> None:
    """Refuse recordings that training has seen; a claim without error shape. Raises InputError."""
    made, scaled = used_by(claim, runs), "shape" in claim.evidence
    seen = seen_in_training(claim, runs) | (made != "") & ~(scaled & (made == CALIBRATION))
    if seen.any():
        raise InputError(
            "validate: expected recordings of which neither network, K nor error shape have seen "
            f"a part; of at least {int(seen.sum())} of {runs.n} runs they have, the first is row "
            f"{runs.rows[np.argmax(seen)]}. Pass what runs.split(share) set aside before training."
        )
