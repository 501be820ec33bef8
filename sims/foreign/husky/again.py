"""Every held-out command against the answer: the recorded path, moved to starts that the answer
proves safe for this command.
"""

from typing import NamedTuple

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.claim.monitor import inside_tube
from parc_jax.errors import SoundnessError
from parc_jax.experiment.replay import Replay, outcomes
from parc_jax.network.predict import trajectories
from parc_jax.rollout.batch import RolloutBatch

ENDS = 400  # places in the goal tried as the predicted end of a command
STARTS = 10  # of those that prove safe, replayed at most


class Again(NamedTuple):
    """Replays of recorded runs. plans (n, n_p + n_k): what was replayed. row (n,): of each among
    the runs. with_start (n_runs,) bool: runs whose command has a start that the answer proves safe.
    """

    runs: Replay
    plans: np.ndarray
    row: np.ndarray
    with_start: np.ndarray


def again(answer: Answer, runs: RolloutBatch) -> Again | None:
    """Move every run to starts of the answer's polytopes; None when no command has one. Raises
    SoundnessError when a run that stays in the tube misses the goal or touches a wall.
    """
    plans, row = starts_of(answer, runs)
    if not len(plans):
        return None
    moved = runs.select(row)
    path, reached, distance = outcomes(answer.scene, moved, plans[:, : answer.model.n_p])
    inside = inside_tube(answer.model.claim, answer.model.net, moved)
    done = Replay(reached, ~(distance > 0), inside, distance, path, moved.q)
    bugs = np.flatnonzero(done.inside & done.failed)
    if len(bugs):
        raise SoundnessError(
            f"{len(bugs)} of {len(plans)} recorded runs failed although they stay inside the tube; "
            f"the first is run {row[bugs[0]]} from {plans[bugs[0], : answer.model.n_p]}. This "
            "contradicts the proof: please report it with the answer."
        )
    return Again(done, plans, row, np.isin(np.arange(runs.n), row))


def starts_of(answer: Answer, runs: RolloutBatch) -> tuple[np.ndarray, np.ndarray]:
    """Plans (n, n_p + n_k) inside the answer's polytopes with the k of the runs, at most STARTS of
    each, and the rows (n,) of the runs that they belong to.
    """
    model, scene = answer.model, answer.scene
    lo, hi = (np.asarray(side)[: model.n_p] for side in (scene.z_lo, scene.z_hi))
    ends = lo + (hi - lo) * np.random.default_rng(0).random((ENDS, model.n_p))
    offsets = trajectories(model.net, model.layout, runs.k)[0][:, -1, : model.n_p]
    plans, rows = [], []
    for row in range(runs.n):
        p0 = ends - offsets[row]
        k = np.tile(runs.k[row], (ENDS, 1))
        inside = np.flatnonzero(answer.contains(p0, k))[:STARTS]
        plans.append(np.concatenate([p0[inside], k[inside]], axis=1))
        rows.append(np.full(len(inside), row))
    return np.concatenate(plans), np.concatenate(rows)
