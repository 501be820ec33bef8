"""What a robot did once, moved to starts from which an answer proves its k safe; nothing is run."""

from typing import NamedTuple

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.replay import Replay, replay
from parc_jax.common.errors import InputError
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.runs.batch import RolloutBatch

ENDS = 400  # places in the goal tried as the predicted end of a run
STARTS = 10  # of those that prove safe, replayed at most


class Recorded(NamedTuple):
    """Replays of recorded runs. runs: what they did. plans (n, n_p + n_k): what was replayed, row
    (n,) of the runs. with_start (n_runs,) bool: runs with a start that the answer proves safe.
    """

    runs: Replay
    plans: np.ndarray
    row: np.ndarray
    with_start: np.ndarray

    def counts(self) -> dict[str, int]:
        """How many of the runs and of their replays did what."""
        seen = self.runs
        return {
            "runs": len(self.with_start),
            "with_start": int(self.with_start.sum()),
            "replays": len(self.plans),
            "left_the_tube": int((~seen.inside).sum()),
            "missed_the_goal": int((~seen.reached).sum()),
            "touched": int(seen.touched.sum()),
        }

    def statement(self) -> str:
        """One sentence."""
        n = self.counts()
        return (
            f"At least {n['with_start']:,} of {n['runs']:,} recorded runs have a k with a start "
            f"that is proved safe; of {n['replays']:,} replays from such starts "
            f"{n['left_the_tube']:,} left the tube, {n['missed_the_goal']:,} missed the goal, "
            f"{n['touched']:,} touched an obstacle; none that stayed in the tube failed."
        )


def replay_recorded(answer: Answer, runs: RolloutBatch) -> Recorded | None:
    """Move every recorded run to starts from which the answer proves its k safe, at most STARTS
    each; None where no run has one.

    Raises InputError for an answer under uncertainty, or runs on another time grid or of other
    points; SoundnessError when a run that stays in the tube misses the goal or touches an obstacle.
    """
    if answer.uncertainty is not None:
        raise InputError(
            "replay_recorded: expected an answer without uncertainty, since recorded runs were "
            "executed as they are; solve the same problem with uncertainty=None."
        )
    plans, row = starts_of(answer, runs)
    if not len(plans):
        return None
    done = replay(runs.select(row), answer.scene, plans)
    return Recorded(done, plans, row, np.isin(np.arange(runs.n), row))


def starts_of(answer: Answer, runs: RolloutBatch) -> tuple[np.ndarray, np.ndarray]:
    """Plans (n, n_p + n_k) that the answer proves safe with the k of the runs, at most STARTS of
    each, and the rows (n,) of the runs that they belong to. Of all starts those are tried that lead
    to ENDS places in the goal's box, or the only one of the answer.
    """
    model, scene = answer.model, answer.scene
    lo, hi = (np.asarray(side)[: model.n_p] for side in (scene.z_lo, scene.z_hi))
    ends = lo + (hi - lo) * np.random.default_rng(0).random((ENDS, model.n_p))
    offsets = trajectories(model.net, model.layout, runs.k)[0][:, -1, : model.n_p]
    plans = [np.zeros((0, model.n_p + model.n_k))]
    rows = [np.zeros(0, int)]
    for row in np.flatnonzero(model.domain.contains(runs.k)):
        p0 = ends - offsets[row] if scene.at is None else scene.at[None]
        k = np.tile(runs.k[row], (len(p0), 1))
        inside = np.flatnonzero(answer.contains(p0, k))[:STARTS]
        plans.append(np.concatenate([p0[inside], k[inside]], axis=1))
        rows.append(np.full(len(inside), row))
    return np.concatenate(plans), np.concatenate(rows)
