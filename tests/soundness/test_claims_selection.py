"""What a claim is worth after a hostile planner has chosen k."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import plant, straight, straight_network

from parc_jax.common.keys import Stage
from parc_jax.learning.bound.counts import NoStatement
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.bound.pipeline import bound_error
from parc_jax.learning.runs.collect import collect

NET, KEY = straight_network(4), jax.random.PRNGKey(0)
pytestmark = pytest.mark.soundness


def rough(key, k, s):
    """Rarely bad anywhere, often bad near k_0 = 0.8: violations sit in a few percent of K."""
    p, q = straight(k, s)
    gain = 0.01 + 0.3 * jnp.exp(-(((k[0] - 0.8) / 0.01) ** 2))
    return p + gain * jax.random.normal(key, (2,))[None] * s[:, None], q


@pytest.fixture(scope="module")
def rough_claim():
    return bound_error(NET, plant(rough), KEY, eps=0.01, delta=1e-3, bins=(1, 1), quiet=True)


def violated(claim, k, n=4000):
    runs = collect(plant(rough), jax.random.PRNGKey(9), n, Stage.VALIDATE, k=k, quiet=True)
    return (~inside_tube(claim, NET, runs)).mean()


def test_a_hostile_planner_breaks_any_promise_about_a_point(rough_claim):
    worst = violated(rough_claim, [0.8, 0.5])
    assert worst > 10 * rough_claim.eps / 2  # far above eps at the chosen k
    assert violated(rough_claim, None) <= rough_claim.eps  # while the claim itself is true
    answer = rough_claim.risk()
    assert isinstance(answer, NoStatement) and "one k" in answer.reason


@pytest.mark.parametrize("half_width", [0.2, 0.05, 0.01])
def test_a_hostile_planner_that_chooses_a_set_is_covered(rough_claim, half_width):
    lo, hi = 0.8 - half_width, min(1.0, 0.8 + half_width)

    @jax.jit
    def in_the_set(key):
        u = jax.random.uniform(key, (2,))
        return jnp.stack([lo + (hi - lo) * u[0], u[1]])

    risk = rough_claim.risk(share=hi - lo)
    rate = violated(rough_claim, in_the_set, 10_000)
    assert rate <= float(risk.bound) + 4 * np.sqrt(float(risk.bound) / 10_000)
    assert (
        rate > float(rough_claim.eps) / 4 or half_width > 0.1
    )  # the set was chosen where it hurts
