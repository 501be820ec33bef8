"""The shipped boat, run for run, against a small stored file: a change of draws, plant or weights
must be deliberate.

`python -m tests.sims.test_asv_stored` writes the file anew.
"""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import sims.asv as asv
from sims.asv.policy import act

pytestmark = pytest.mark.slow

STORED = Path(__file__).parent / "data" / "asv_stored.npz"
LAW = "full"  # every draw acts


def compute() -> dict:
    """Positions every 0.2 s of six runs, and 64 actions of the shipped policy."""
    rng = np.random.default_rng(6)
    ks = rng.uniform([4, -1, -np.pi / 6], [7, 1, np.pi / 6], (6, 3))
    observations = np.clip(rng.normal(size=(64, 6)) * [0.5, 0.1, 0.3, 1, 1, 3], -12, 12)
    keys, stored = jax.random.split(jax.random.key(6), 6), {"ks": ks, "observations": observations}
    rollout = jax.jit(jax.vmap(asv.system("ode", LAW).rollout))
    stored["p"] = np.asarray(rollout(keys, jnp.asarray(ks)).p[:, ::10])
    policy = asv.load_policy()
    stored["actions"] = np.asarray(jax.vmap(lambda o: act(policy, o))(jnp.asarray(observations)))
    return stored


def test_runs_and_actions_are_the_stored_ones():
    now = compute()
    with np.load(STORED) as stored:
        assert set(stored.files) == set(now)
        for name in ("ks", "observations", "actions"):
            np.testing.assert_allclose(now[name], stored[name], atol=1e-12, err_msg=name)
        # rounding differs between machines and is fed back through 50 decisions
        np.testing.assert_allclose(now["p"], stored["p"], atol=1e-7)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    np.savez_compressed(STORED, **compute())
