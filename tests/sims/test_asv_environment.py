"""The Brax environment: reward, redraws, and Brax's own wrappers around it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sims.asv.environment import HoverEnv
from sims.quiet import quiet_import

ACTION = np.array([0.8, 0.6])


@pytest.mark.night
def test_reward_is_progress_plus_hovering_minus_effort():
    env = HoverEnv(law="none", redraw=0.0)
    step = jax.jit(env.step)
    state = step(
        jax.jit(env.reset)(jax.random.PRNGKey(0)), ACTION
    )  # the first step redraws: start from the second
    before, state = state.pipeline_state, step(state, ACTION)
    after = state.pipeline_state
    d0, d1 = float(before.distance), float(after.distance)
    r = float(after.vessel.velocity[2])
    expected = d0 - d1 + 0.2 * (np.exp(-d1 / 0.25) - 0.05 * r**2 - 0.02 * (0.8**2 + 0.6**2))
    assert abs(r) > 1e-4
    assert float(state.reward) == pytest.approx(expected, abs=1e-12)
    assert float(state.metrics["distance"]) == d1
    assert np.hypot(*np.asarray(after.goal)) == pytest.approx(np.hypot(*np.asarray(before.goal)))


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
