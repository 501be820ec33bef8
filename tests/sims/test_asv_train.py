"""Training: what Brax learned is what the file does; a run goes on where it stopped."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sims.asv.policy import act, policy_from_file_arrays
from sims.quiet import quiet_import


@pytest.mark.smoke
@pytest.mark.night
def test_exported_policy_acts_like_braxs_own():
    networks = quiet_import("brax.training.agents.ppo.networks")
    statistics = quiet_import("brax.training.acme.running_statistics")
    from sims.asv.training_log import policy_arrays

    with (
        jax.enable_x64(False),
        jax.numpy_dtype_promotion("standard"),
        jax.numpy_rank_promotion("allow"),
    ):
        network = networks.make_ppo_networks(
            6, 2, statistics.normalize, policy_hidden_layer_sizes=(16, 16), activation=jnp.tanh
        )
        params = network.policy_network.init(jax.random.PRNGKey(0))
        observations = jax.random.normal(jax.random.PRNGKey(1), (50, 6)) * 3
        normalizer = statistics.update(
            statistics.init_state(jax.ShapeDtypeStruct((6,), jnp.float32)), observations + 1.0
        )
        policy = networks.make_inference_fn(network)((normalizer, params), deterministic=True)
        theirs, _ = policy(observations, jax.random.PRNGKey(2))
        ours = policy_from_file_arrays(policy_arrays(normalizer, params, 0.2))
        actions = jax.vmap(functools.partial(act, ours))(observations)
    assert np.abs(np.asarray(theirs)).max() > 0.3
    np.testing.assert_allclose(actions, theirs, atol=2e-6)  # float32
