"""Replay of certified plans in the black box: the only test that knows the truth.

A plan whose run stayed inside the tube must reach the goal and touch nothing: anything else is a
bug, and raises. A run that left the tube is counted against the claim.
"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.counts import clopper_pearson
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import collect
from parc_jax.problem.robust.realisations import executions_of
from parc_jax.safe_set.verdict.outcomes import outcomes, reached_and_touched
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.scene import Scene, unpruned_scene

# runs per compiled call, as in the large collections: nothing is compiled for a replay alone
CHUNK = 256


class Replay(NamedTuple):
    """What the black box did with n plans: reached the goal, touched, stayed inside (n,) bool.

    clearance (n,) [m]: smallest distance of the body from an obstacle over the recorded path, not
    positive when touched. path (n, n_record + 1, n_c), q (n, n_q): the true runs, started at p0.
    """

    reached: np.ndarray
    touched: np.ndarray
    inside: np.ndarray
    clearance: np.ndarray
    path: np.ndarray
    q: np.ndarray

    @property
    def failed(self) -> np.ndarray:
        """(n,) bool: goal missed or obstacle touched."""
        return ~self.reached | self.touched


def replay(
    system, scene: Scene, plans: np.ndarray, key: jax.Array | None = None, quiet=True
) -> Replay:
    """Run plans (n, n_p + n_k) with fresh randomness from the REPLAY stream of `key`.

    system: a black box; or a RolloutBatch of recorded runs, one of each plan's own k, in order,
        which are moved to the plans' starts: then key is unused. `replay_recorded` finds such
        plans.
    Raises SoundnessError when the proof and the run disagree, InputError for another system, or
    recorded runs of other k, on another time grid or of other points.
    """
    runs, inside = _driven(system, scene, plans, key, quiet)
    path, reached, distance = outcomes(unpruned_scene(scene), runs, plans[:, : scene.model.n_p])
    out = Replay(reached, ~(distance > 0), inside, distance, path, np.asarray(runs.q))
    _refuse_contradictions(plans, out.inside & out.failed)
    return out


def counts_of(system, scene: Scene, plans: np.ndarray, key: jax.Array) -> dict[str, int]:
    """How many of the plans did what, by the same judgement: for the many, whose distances nobody
    reads. Raises SoundnessError as `replay` does.
    """
    runs, inside = _driven(system, scene, plans, key, quiet=True)
    scene = unpruned_scene(scene)
    reached, touched = reached_and_touched(scene, runs, plans[:, : scene.model.n_p])
    _refuse_contradictions(plans, inside & (touched | ~reached))
    return {
        "plans": len(plans),
        "reached": int(reached.sum()),
        "touched": int(touched.sum()),
        "left the tube": int((~inside).sum()),
    }


def tally(runs: Replay, repeats: int, delta: float) -> dict:
    """Counts, and upper bounds on how often these plans fail, both at confidence 1 - delta. [T6]

    mean: over the plans, all runs together. Runs of different plans are independent but not alike;
    for fewer failures than the mean the binomial tail is still an upper bound (Hoeffding 1956), so
    Clopper-Pearson holds for the mean.
    worst: for every plan at once, from its own runs, delta split over the plans. Not for systems
    without disturbance, where one run decides.
    """
    failed = runs.failed.reshape(-1, repeats).sum(axis=1)
    plans = len(failed)
    total = int(failed.sum())
    counts = {
        "plans": plans,
        "repeats": repeats,
        "runs": plans * repeats,
        "reached": int(runs.reached.sum()),
        "touched": int(runs.touched.sum()),
        "left_tube": int((~runs.inside).sum()),
        "failed": total,
    }
    if repeats == 1:
        return counts
    return counts | {
        "confidence": 1 - delta,
        "failure_mean": total / (plans * repeats),
        "failure_mean_at_most": float(clopper_pearson(total, plans * repeats, delta / 2)),
        "worst_plan_failed": int(failed.max()),
        "every_plan_at_most": float(clopper_pearson(int(failed.max()), repeats, delta / 2 / plans)),
        "failure_by_plan": failed.tolist(),
    }


def _driven(
    system, scene: Scene, plans: np.ndarray, key: jax.Array | None, quiet: bool
) -> tuple[RolloutBatch, np.ndarray]:
    """Runs of the plans, and which of them stayed inside the tube (n,). Raises InputError for a
    system, or recorded runs, that are not the model's.
    """
    model, k = _robot_of(scene, plans[:, scene.model.n_p :])
    if isinstance(system, RolloutBatch):
        runs = system
        _check_recorded(runs, model, k)
    else:
        require_same(system, model)
        runs = collect(system, key, len(plans), Stage.REPLAY, k=k, chunk=CHUNK, quiet=quiet)
    return runs, inside_tube(model.claim, model.net, runs)


def _robot_of(scene: Scene, k: np.ndarray) -> tuple[TrajectoryModel, np.ndarray]:
    """The model that was asked and all parameters (n, n_k) of its plans, where k (n, chosen) are
    what is left to choose of them, and the rest is given exactly; else what the scene says.
    """
    asked = scene.nominal.query
    if asked is None or asked.problem.uncertainty is None or asked.model.n_k == scene.model.n_k:
        return scene.model, k
    executions = executions_of(asked.problem.uncertainty, asked.model)
    return (asked.model, executions.whole(k)) if executions.exact else (scene.model, k)


def _check_recorded(runs: RolloutBatch, model: TrajectoryModel, k: np.ndarray) -> None:
    """Refuse recorded runs that are not of these k (n, n_k) and this model. Raises InputError."""
    same = (runs.time, runs.points) == (model.time, model.points)
    if not same or runs.k.shape != k.shape or not (runs.k == k).all():
        raise InputError(
            "replay: expected recorded runs on the time grid and of the reference points of the "
            f"model, one run of each plan's own k, in order; got {runs.n} runs for {len(k)} "
            "plans. Select rows of the batch, or let `replay_recorded` find the plans."
        )


def _refuse_contradictions(plans: np.ndarray, bugs: np.ndarray) -> None:
    """Raises SoundnessError for bugs (n,): plans that failed although their run stayed inside."""
    if bugs.any():
        first = int(np.argmax(bugs))
        raise SoundnessError(
            f"replay: {int(bugs.sum())} of {len(bugs)} plans failed although their run stayed "
            f"inside the tube; the first is (p0, k) = {plans[first].tolist()}. This contradicts "
            "the proof: please report it with the answer."
        )
