"""Replay of certified plans in the black box: the only test that knows the truth.

A plan whose run stayed inside the tube must reach the goal and touch nothing: anything else is a
bug, and raises. A run that left the tube is counted against the claim.
"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.claim.monitor import inside_tube
from parc_jax.errors import SoundnessError
from parc_jax.keys import Stage
from parc_jax.model import TrajectoryModel
from parc_jax.rollout.collect import collect
from parc_jax.verdict.near import whole_scene
from parc_jax.verdict.outcomes import outcomes
from parc_jax.verdict.scene import Scene

# runs per compiled call, as in the large collections: nothing is compiled for a replay alone
CHUNK = 256


class Replay(NamedTuple):
    """What the black box did with n plans. reached, touched, inside (n,) bool: goal, any obstacle,
    tube.

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
    system, model: TrajectoryModel, scene: Scene, plans: np.ndarray, key: jax.Array, quiet=True
) -> Replay:
    """Run plans (n, n_p + n_k) with fresh randomness. Raises SoundnessError when the proof and the
    run disagree.
    """
    p0, k = plans[:, : model.n_p], plans[:, model.n_p :]
    runs = collect(system, key, len(plans), Stage.REPLAY, k=k, chunk=CHUNK, quiet=quiet)
    path, reached, distance = outcomes(whole_scene(scene, model), runs, p0)
    inside = inside_tube(model.claim, model.net, runs)
    out = Replay(reached, ~(distance > 0), inside, distance, path, np.asarray(runs.q))
    bugs = out.inside & out.failed
    if bugs.any():
        first = int(np.argmax(bugs))
        raise SoundnessError(
            f"replay: {int(bugs.sum())} of {len(plans)} plans failed although their run stayed "
            "inside the tube; the "
            f"first is p0 = {p0[first]}, k = {k[first]}. This contradicts the proof: please report "
            "it with the answer."
        )
    return out
