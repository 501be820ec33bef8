"""Replay of certified plans in the black box, the only test that knows the truth.

A proved plan whose run stayed inside the tube must reach the goal and touch nothing: anything else
is a bug, and raises. A run that left the tube is counted against the claim.
"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError, SoundnessError, check_kind
from parc_jax.common.keys import Stage
from parc_jax.drive.local.localise import require_begins
from parc_jax.learning.bound.counts import clopper_pearson
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.bound.start_gap import off_from_start
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import collect
from parc_jax.problem.robust.realisations import executions_of
from parc_jax.safe_set.verdict.outcomes import outcomes, reaches
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene, unpruned_scene

# runs per compiled call, as in the large collections: nothing is compiled for a replay alone
CHUNK = 256


class Replay(NamedTuple):
    """Outcomes of n plans in the black box: reached the goal, touched, stayed inside (n,) bool.

    clearance (n,) [m]: smallest distance of the body from an obstacle over the recorded path, not
    positive when touched. at_worst (n,) bool: failed, or would by as much as the claim says that a
    start may matter. lost (n,): as of `RolloutBatch`, 0 = made once. path (n, n_record + 1, n_c),
    q (n, n_q): the true runs, started at p0. plans (n, n_p + n_k), scene: of what, and where.
    """

    reached: np.ndarray
    touched: np.ndarray
    inside: np.ndarray
    clearance: np.ndarray
    at_worst: np.ndarray
    lost: np.ndarray
    path: np.ndarray
    q: np.ndarray
    plans: np.ndarray
    scene: Scene

    @property
    def failed(self) -> np.ndarray:
        """(n,) bool: goal missed, or an obstacle touched as far as records tell."""
        return ~self.reached | ~(self.clearance > 0)


def replay(
    system, scene: Scene, plans: np.ndarray, key: jax.Array | None = None, quiet=True
) -> Replay:
    """Run plans (n, n_p + n_k) with fresh randomness from the REPLAY stream of `key`.

    system: a black box; or a RolloutBatch of recorded runs, one for the k of each plan, in order,
        which are moved to the plans' starts: then key is unused. `sims.recorded` finds such
        plans.
    Raises SoundnessError when the proof and the run disagree, InputError for another system, or
    recorded runs of other k, on another time grid or of other points.
    """
    check_kind("replay: scene, after the system", scene, Scene)
    n = scene.model.n_p + scene.model.n_k
    plans = as_float64("replay: plans, after the scene", plans, (None, n))
    runs, inside = _executed(system, scene, plans, key, quiet)
    whole, off = unpruned_scene(scene), off_from_start(scene.model.claim)
    path, reached, distance = outcomes(whole, runs, plans[:, : scene.model.n_p])
    worst = ~reaches(whole, path, runs.q, off) | ~(distance > off * np.sqrt(scene.model.n_p))
    lost = np.zeros(runs.n, int) if runs.lost is None else runs.lost
    out = Replay(reached, distance <= 0, inside, distance, worst, lost, path, runs.q, plans, scene)
    _refuse_contradictions(scene, plans, out.inside & out.failed)
    return out


def tally(runs: Replay, repeats: int, delta: float) -> dict:
    """Counts, and upper bounds on how often these plans fail, both at confidence 1 - delta. [T6]

    mean: over the plans, all runs together. Runs of different plans are independent, with different
    laws; for fewer failures than the mean the binomial tail is still an upper bound (Hoeffding
    1956), so Clopper-Pearson holds for the mean.
    worst: for every plan at once, from the runs of each, delta split over the plans. Not for
    systems without disturbance, where one run decides.
    """
    failed = runs.at_worst.reshape(-1, repeats).sum(axis=1)
    plans, total, most = len(failed), int(failed.sum()), int(failed.max())
    n = plans * repeats
    counts = {"plans": plans, "repeats": repeats, "runs": n, "failed": total}
    counts |= {"reached": int(runs.reached.sum()), "touched": int(runs.touched.sum())}
    counts |= {"left_tube": int((~runs.inside).sum()), "lost": int((runs.lost != 0).sum())}
    if repeats == 1:
        return counts
    counts |= {"confidence": 1 - delta, "failure_mean": total / n, "worst_plan_failed": most}
    return counts | {
        "failure_mean_at_most": float(clopper_pearson(total, n, delta / 2)),
        "every_plan_at_most": float(clopper_pearson(most, repeats, delta / 2 / plans)),
        "failure_by_plan": failed.tolist(),
    }


def _executed(
    system, scene: Scene, plans: np.ndarray, key: jax.Array | None, quiet: bool
) -> tuple[RolloutBatch, np.ndarray]:
    """Runs of the plans, and which of them stayed inside the tube (n,). Raises InputError for a
    system, or recorded runs, that are not the model's.
    """
    model, k, query = scene.model, plans[:, scene.model.n_p :], scene.nominal.query
    known = None if query is None else query.problem.uncertainty
    if known is not None and query.model.n_k != model.n_k:  # some may be given exactly
        executions = executions_of(known, query.model)
        model, k = (query.model, executions.whole(k)) if executions.exact else (model, k)
    if not isinstance(system, RolloutBatch):
        require_begins("replay", system, model)
        runs = collect(system, key, len(plans), Stage.REPLAY, k=k, chunk=CHUNK, quiet=quiet)
    else:
        runs = system
        same = (runs.time, runs.points) == (model.time, model.points)
        if not same or runs.k.shape != k.shape or not (runs.k == k).all():
            raise InputError(
                "replay: expected recorded runs on the time grid and of the reference points of "
                f"the model, one run of each plan's own k, in order; got {runs.n} runs for "
                f"{len(k)} plans. Select rows of the batch, or let "
                "`sims.recorded` find the plans."
            )
    return runs, inside_tube(model.claim, model.net, runs)


def _refuse_contradictions(scene: Scene, plans: np.ndarray, bugs: np.ndarray) -> None:
    """Raises SoundnessError for those of bugs (n,), plans that failed inside, that are proved."""
    if len(rows := np.flatnonzero(bugs)):
        p0, k = np.split(plans[rows], [scene.model.n_p], axis=1)
        bugs[rows] = verdicts(scene, p0, k).safe
    if bugs.any():
        first = int(np.argmax(bugs))
        raise SoundnessError(
            f"replay: {int(bugs.sum())} of {len(bugs)} plans failed although their run stayed "
            f"inside the tube; the first is (p0, k) = {plans[first].tolist()}. This contradicts "
            "the proof: please report it with the answer."
        )
