"""The Brax environment under Brax's own wrappers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sims.asv.environment import HoverEnv
from sims.quiet import quiet_import

ACTION = np.array([0.8, 0.6])


@pytest.mark.smoke
@pytest.mark.night
def test_stock_wrappers_do_not_repeat_the_first_task():
    training = quiet_import("brax.envs").training
    with jax.numpy_dtype_promotion("standard"):  # Brax mixes integer and float types
        env = training.wrap(HoverEnv(redraw=0.0), episode_length=3)
        step = jax.jit(env.step)
        state, goals, done = jax.jit(env.reset)(jax.random.split(jax.random.PRNGKey(2), 4)), [], []
        for _ in range(9):
            state = step(state, jnp.tile(ACTION, (4, 1)))
            goals.append(np.asarray(state.pipeline_state.goal))
            done.append(np.asarray(state.done))
    assert np.array_equal(np.flatnonzero(np.array(done)[:, 0]), [2, 5, 8])
    assert np.array_equal(
        goals[2], goals[5]
    )  # auto-reset: the first state again, for one observation ...
    episodes = [goals[0], goals[3], goals[6]]
    assert len({tuple(map(float, g[0])) for g in episodes}) == 3  # ... then a task of its own
    assert np.array_equal(goals[3], goals[4])
