"""What recorded runs did in a scene: no model, no tube, the truth as far as it was recorded."""

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import x64
from parc_jax.claim.error_set import ErrorBox
from parc_jax.network.predict import moved_to
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.verdict.pointwise import clearance
from parc_jax.verdict.scene import Scene


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
