"""A cart pushed aside by a gust, as a module that the main job runs: `system()`, `problem()`,
`STUDY`.
"""

import jax
import jax.numpy as jnp

import parc_jax as pj
from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound
from parc_jax.safe_set.settings import Settings

STUDY = Study(
    hidden=(4,),
    rollouts=60,
    tail=8.0,
    seeds=1,
    steps=60,
    repeats=20,
    bound=ModelBound(bins=(2, 1), eps=0.1, delta=0.05, blocks=(2, 1), profile_runs=100),
    settings=Settings(samples=5, target=0.2, budget_s=300.0),
)


class Cart:
    """Rolls k_0 along x and k_1 along y in one second; a gust of 2 cm."""

    name, n_p, n_q = "cart", 2, 0
    domain, time = (
        pj.box([0.5, -0.5], [1.0, 0.5]),
        pj.learning.time_grid(dt=0.25, t_f=1.0, dt_record=0.125),
    )

    def rollout(self, key, k):
        """Straight to k, and aside."""
        s = jnp.linspace(0.0, 1.0, 9)[:, None].astype(k.dtype)
        gust = 0.02 * k[0] * jax.random.uniform(key, (2,), k.dtype, -1, 1)
        return pj.Trajectory(s * k[None] + s**2 * gust[None], k[:0])


def system():
    """The cart."""
    return Cart()


def problem():
    """A goal behind two blocks."""
    blocks = (pj.box([-0.5, 0.25], [-0.2, 0.9]), pj.box([-0.5, -0.9], [-0.2, -0.25]))
    return pj.reach_avoid(pj.box([-0.15, -0.3], [0.3, 0.3]), blocks, 0.05)
