"""A hand-made answer: straight lines past two blocks into a goal, with certificates, polytopes and
a replay.
"""

import itertools
from types import SimpleNamespace

import numpy as np
from toy_models import line_model

from parc_jax.app.study.replay import Replay
from parc_jax.common.sets.box import box
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.verdict.scene import scene_of

P0 = np.array([[-0.9, -0.05], [-0.95, 0.0], [-0.85, 0.05], [-0.9, 0.02]])
K = np.array([[0.9, 0.05], [0.95, -0.01], [0.85, -0.04], [0.9, 0.0]])
SEP = [
    [[[2, [[2, "1"], [3, "1"]]], [4, [[3, "1"]]]]],
    [[[4, [[1, "3/4"]]]]],
]  # rows of a box: x <=, y <=, -x <=, -y <=


class ToyPolytopes(list):
    """Polytopes by their corners."""

    coverage = SimpleNamespace(share=0.8)

    def project(self, dims):
        return [corners[:, list(dims)] for corners in self]


def toy_answer():
    """Everything the pictures read of an Answer. Unit goal offset; corridor |y| < 0.3 between two
    blocks; disc body.
    """
    model = line_model(T=4, e=0.02)
    goal = box([-0.2, -0.2, -1.0], [0.2, 0.2, 1.0])
    blocks = [box([-0.5, 0.3], [0.0, 0.6]), box([-0.5, -0.6], [0.0, -0.3])]
    problem = reach_avoid(goal, blocks, 0.1, spans=[None, (0, 3)])
    plans = np.concatenate([P0, K], axis=1)
    solids = [box(plan - 0.02, plan + 0.02) for plan in plans]
    corners = [np.array(list(itertools.product(*zip(s.lo, s.hi, strict=True)))) for s in solids]
    return SimpleNamespace(
        model=model,
        problem=problem,
        scene=scene_of(problem, model),
        samples=plans,
        certificates=[{"sep": SEP}] * len(plans),
        polytopes=lambda key: ToyPolytopes(corners),
    )


def toy_replay(answer, shift=0.01):
    """Runs that follow the prediction, moved sideways by `shift` [m]; the last one is marked as
    failed.
    """
    n, steps = len(answer.samples), answer.model.time.n_record
    share = np.linspace(0, 1, steps + 1)[None, :, None]
    path = P0[:, None] + share * K[:, None] + shift * share
    touched = np.arange(n) == n - 1
    away, inside = np.where(touched, -0.1, 0.1), np.ones(n, bool)
    of = answer.samples, answer.scene
    return Replay(inside, touched, inside, away, touched, 0 * touched, path, K[:, :1], *of)
