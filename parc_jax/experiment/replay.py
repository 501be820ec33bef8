"""Replay of certified plans in the black box: the only test that knows the truth.

A plan whose run stayed inside the tube must reach the goal and touch nothing: anything else is a
bug, and raises. A run that left the tube is counted against the claim.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import x64
from parc_jax.claim.error_set import ErrorBox
from parc_jax.claim.monitor import inside_tube
from parc_jax.errors import SoundnessError
from parc_jax.keys import Stage
from parc_jax.model import TrajectoryModel
from parc_jax.network.predict import moved_to
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import collect
from parc_jax.verdict.near import whole_scene
from parc_jax.verdict.pointwise import clearance
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


def outcomes(
    scene: Scene, runs: RolloutBatch, p0: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What runs from p0 (n, n_p) did: path (n, n_record + 1, n_c), whether the goal was reached
    (n,), smallest distance [m] from an obstacle (n,). A failed run reached nothing.
    """
    path = moved_to(p0, np.asarray(runs.p, np.float64))
    state = np.concatenate([path[:, -1], runs.q], axis=1)
    reached = (state @ scene.goal_A.T <= scene.goal_b).all(axis=1)
    with x64():
        distance = np.asarray(_true_clearance(scene.arrays, runs.time.stride, path))
    return path, reached, distance


@jax.jit(static_argnums=1)
def _true_clearance(scene: Scene, stride: int, path):
    """Distance (n,) of recorded paths (n, n_record + 1, n_c) from the obstacles grown by the body
    alone: of the hull of each part at two records in a row, so that nothing between them is missed.
    """
    active = scene.obstacles.active.repeat(stride, axis=1)
    fine = scene.replace(obstacles=scene.obstacles.replace(active=active), slack=np.float64(0))
    n_p = scene.z_lo.shape[0]
    still = ErrorBox(jnp.zeros((path.shape[1] - 1, path.shape[2] // n_p, n_p)))
    return jax.lax.map(lambda one: clearance(fine, one, still), path)
