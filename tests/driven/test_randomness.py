"""A system without disturbance is found out from its program, never from a few equal runs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import Plant, exact, plant, straight
from toy_driven import gusty, still

import parc_jax as pj
from parc_jax.driven.randomness import ignores_key

pytestmark = pytest.mark.soundness


def rare(key, k, s):
    """A gust once in a million runs."""
    p, q = straight(k, s)
    return p + jnp.where(jax.random.uniform(key) < 1e-6, 1.0, 0.0) * s[:, None], q


def hidden(key, k, s):
    """The host draws."""
    p, q = straight(k, s)
    shape = jax.ShapeDtypeStruct((), p.dtype)
    gust = jax.pure_callback(lambda: np.asarray(np.random.default_rng().normal(), p.dtype), shape)
    return p + gust * s[:, None], q


def baked_in(key, k, s):
    """Drawn when the program is made."""
    p, q = straight(k, s)
    return p + np.random.default_rng().normal() * s[:, None], q


def in_the_end_only(key, k, s):
    """Through a loop, and only in the last state."""
    p, q = straight(k, s)
    return p, jax.lax.fori_loop(0, 3, lambda i, x: x + 1e-9 * jax.random.normal(key, (1,)), q)


@pytest.mark.parametrize("run", [exact, still])
def test_a_program_without_its_key_is_recognised(run):
    assert ignores_key(plant(run))


@pytest.mark.parametrize("run", [gusty, rare, hidden, baked_in, in_the_end_only])
def test_a_program_that_may_vary_is_not(run):
    assert not ignores_key(plant(run))


def test_the_looked_at_attribute_counts():
    class Wind(Plant):
        """Its key matters through an attribute."""

        def rollout(self, key, k):
            out = super().rollout(key, k)
            return out._replace(q=out.q + 0.0 * jax.random.normal(key, (1,)))

    base = plant(exact)
    assert not ignores_key(Wind(base.domain, base.time, base.run))  # erring towards runs


def test_what_is_not_a_jax_program_is_never_called_deterministic():
    def simulate(rng, k):
        return np.linspace(0, 1, 5)[:, None] * k[None], np.zeros(0)

    time = pj.time_grid(0.25, 1.0)
    k = pj.box([0, 0], [1, 1])
    system = pj.python_system(simulate, k, time, n_p=2, n_q=0, name="host", workers=0)
    assert not ignores_key(system)
