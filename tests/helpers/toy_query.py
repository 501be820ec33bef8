"""One small query of the folding toy model, asked once per process: an answer with plans, and one
that proves none.
"""

import functools

import jax
from toy_models import fold_model

import parc_jax as pj

GOAL = pj.box([-0.25, -0.25, -1.0], [0.25, 0.25, 1.0])
START = pj.box([-1.5, -1.5], [1.5, 1.5])


def gap(wall=False):
    """A block beside the way, or (wall) one that covers every way and leaves part of the goal
    free.
    """
    blocks = [pj.box([-3.0, -3.0], [0.2, 3.0])] if wall else [pj.box([-0.5, 0.3], [0.0, 0.6])]
    return pj.reach_avoid(GOAL, blocks, 0.1, START, spans=[(1, 3)])


@functools.cache
def planner():
    """Of the model that folds over at k_1 = 0."""
    return pj.Planner(fold_model(T=4, e=0.02))


@functools.cache
def answer(wall=False):
    """The answer to `gap`."""
    settings = pj.Settings(samples=5, target=0.1, budget_s=300)
    return planner().solve(gap(wall), jax.random.PRNGKey(0), settings)


@functools.cache
def polytopes():
    """Those of the answer to `gap`."""
    return answer().polytopes(jax.random.PRNGKey(1), 2000)
