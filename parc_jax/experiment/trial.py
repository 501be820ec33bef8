"""Many runs of every returned plan in the black box, and what their failures prove about these
plans.
"""

import numpy as np

from parc_jax.claim.counts import clopper_pearson
from parc_jax.experiment.replay import Replay, replay
from parc_jax.verdict.scene import Scene


def trial(system, scene: Scene, plans: np.ndarray, key, repeats: int, quiet: bool) -> Replay:
    """Run every plan (n, n_p + n_k) `repeats` times with fresh randomness: n * repeats runs,
    grouped by plan.

    Raises SoundnessError when the proof and a run disagree.
    """
    return replay(system, scene, np.repeat(plans, repeats, axis=0), key, quiet)


def first_of(runs: Replay, repeats: int) -> Replay:
    """The first run of every plan."""
    return Replay(*(part[::repeats] for part in runs))


def tally(runs: Replay, repeats: int, delta: float) -> dict:
    """Counts, and two upper bounds on how often these plans fail, together with confidence 1 -
    delta. [T6]

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
