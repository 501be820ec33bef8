"""A plant with a gust of known law, a claim about it, and one answer to choose from."""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from synthetic_plants import Plant, plant, straight, straight_network

import parc_jax as pj
from parc_jax.answer.looks import Looks
from parc_jax.learning.bound.pipeline import bound_error
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.system import Retried

T = 4
NET = straight_network(T)
GUST = 0.05  # [m] at the end, times k_0


def gusty(key, k, s):
    """Pushed aside by at most GUST k_0, uniformly: the error is largest where k_0 is."""
    p, q = straight(k, s)
    push = GUST * k[0] * jax.random.uniform(key, (2,), minval=-1, maxval=1)
    return p + s[:, None] ** 2 * push[None], q


def still(key, k, s):
    """The same error at the same k, whatever the key."""
    p, q = straight(k, s)
    return p + 0.02 * s[:, None] * jnp.sin(9 * k)[None], q


def problem(wall=0.95):
    """A goal at the end of the diagonal, and a wall along the upper edge."""
    goal = pj.box([0.3, 0.3, -1.0], [0.7, 0.7, 2.0])
    return pj.reach_avoid(goal, [pj.box([-1.0, wall], [2.0, wall + 1])], 0.05)


@functools.cache
def model(run=gusty, claims=("one",)):
    """The straight line with a claim about all of K = [0, 1]^2 at 0.1, from 60 runs and more."""
    system = plant(run, T)
    key = jax.random.PRNGKey(3)
    train = collect(system, key, 100, quiet=True)
    options = {"eps": 0.1, "delta": 0.05, "bins": (1, 1), "claims": claims, "quiet": True}
    claim = bound_error(NET, system, key, train=train, profile_runs=100, **options)
    return pj.learning.trajectory_model(NET, claim)


@functools.cache
def planner():
    """Of the gusty plant."""
    return pj.Planner(model())


def answer():
    """A new answer each time, for it remembers the looks at it; the search is done once."""
    found = _answer()
    return replace(found, looks=Looks())


SETTINGS = pj.Settings(samples=5, target=0.2, budget_s=300)


@functools.cache
def _answer():
    return planner().solve(problem(), jax.random.PRNGKey(0), SETTINGS)


GAP = 0.03  # [m] that the start matters on the hill, nearly everywhere


class Hill:
    """The gusty plant, pushed aside by GAP wherever it starts but at the origin, from which runs
    are recorded.
    """

    name, n_p, n_q = "plant", 2, 1
    domain, time = pj.box([0.0, 0.0], [1.0, 1.0]), pj.learning.time_grid(1 / T, 1.0, 1 / (5 * T))

    def rollout(self, key, k):
        return self.rollout_from(key, k, jnp.zeros(2, k.dtype))

    def rollout_from(self, key, k, p0):
        s = jnp.linspace(0.0, 1.0, self.time.n_record + 1)
        p, q = gusty(key, k, s)
        return pj.Trajectory(p + GAP * jnp.tanh(400 * p0)[None] * s[:, None], q)


class Again(Plant):
    """The gusty plant, some runs of which are lost with their workers, and made again."""

    def rollout_batch(self, keys, k):
        run = jax.vmap(super().rollout)(jnp.asarray(keys), jnp.asarray(k))
        return Retried(np.asarray(run.p), np.asarray(run.q), np.arange(len(k)) % 3)


def again():
    """One of them."""
    return Again(Hill.domain, Hill.time, gusty)


@functools.cache
def on_the_hill():
    """The model of `model` with a claim that declares what the hill does, and a bound of speeds."""
    declared = {"gap": 1.01 * GAP, "intersample": pj.types.SpeedBound(1.2)}
    options = {"eps": 0.1, "delta": 0.05, "bins": (1, 1), "quiet": True, "profile_runs": 100}
    train = collect(Hill(), jax.random.PRNGKey(3), 100, quiet=True)
    claim = bound_error(NET, Hill(), jax.random.PRNGKey(3), train=train, **options, **declared)
    return pj.learning.trajectory_model(NET, claim)
