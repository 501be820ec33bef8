"""An answer whose true values are known: everything is safe. One cell, no obstacle, and one
polytope that is all of it.
"""

import functools

import jax
from toy_models import line_model

import parc_jax as pj


@functools.cache
def answer():
    """Asked once per process."""
    problem = pj.reach_avoid(pj.box([-0.5, -0.5, -9], [0.5, 0.5, 9]), [], 0.1)
    settings = pj.Settings(samples=5, target=0.1, budget_s=300)
    return pj.Planner(line_model(4, 0.0)).solve(problem, jax.random.key(0), settings)
