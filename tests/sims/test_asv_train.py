"""Training: what Brax learned is what the file does; a run goes on where it stopped."""

import functools
import json
import os
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sims.asv.policy import act, load_policy, policy_from_file_arrays
from sims.quiet import quiet_import

TINY = (
    "--steps",
    "8192",
    "--environments",
    "64",
    "--batch",
    "64",
    "--minibatches",
    "2",
    "--hidden",
    "8",
    "--cores",
    "1",
)


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


def command(folder, *options):
    environment = {**os.environ, "JAX_PLATFORMS": "cpu"}
    return subprocess.run(
        [
            sys.executable,
            "-m",
            "sims.asv.train",
            "--out",
            str(folder),
            "--evaluations",
            "2",
            *TINY,
            *options,
        ],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )


@pytest.mark.night
def test_training_goes_on_from_its_checkpoint(tmp_path):
    first = command(tmp_path)
    assert first.returncode == 0, first.stderr
    lines = first.stdout.splitlines()
    assert all("return" in line and "left" in line for line in lines[:-1])
    assert "warp" not in first.stdout
    before = load_policy(tmp_path / "hover.npz")

    again = command(tmp_path, "--steps", "20480")
    assert again.returncode == 0, again.stderr
    record = json.loads((tmp_path / "hover_training.json").read_text())
    assert record["resumed_at"] == [10240]
    assert [row["steps"] for row in record["history"]] == sorted(
        {row["steps"] for row in record["history"]}
    )
    assert record["history"][-1]["steps"] >= 20480
    after = load_policy(tmp_path / "hover.npz")
    step = np.abs(after.weights[1] - before.weights[1]).max()
    assert 0 < step < 0.2  # further from where it was, not from nothing

    nothing_left = command(tmp_path, "--steps", "20480")
    assert nothing_left.returncode == 0
    assert np.array_equal(load_policy(tmp_path / "hover.npz").weights[1], after.weights[1])

    other = command(tmp_path, "--steps", "20480", "--seed", "1")
    assert other.returncode != 0
    assert "seed differ" in other.stderr


@pytest.mark.night
@pytest.mark.parametrize(("plant", "most"), [("ode", 15_000), ("mjx", 18_000)])
def test_a_control_step_is_little_work(plant, most):
    """Operations of one step in a batch, as XLA counts them; rates: python -m sims.asv.speed."""
    from sims.asv.scenario import system

    keys = jax.random.split(jax.random.key(0), 8)
    rollouts = jax.jit(jax.vmap(system(plant, "study").rollout))
    work = rollouts.lower(keys, jnp.zeros((8, 3))).cost_analysis()  # of a loop: one turn
    assert work["flops"] < 8 * most
