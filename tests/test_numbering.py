"""What a file lists is called by its index there, from 0. Of two obstacles the second is always the
one that is wrong, of four samples the second.
"""

import copy
import json

import pytest
from scene_text import problem_of_text
from toy_answer import SEP, toy_answer
from toy_models import line_model

import parc_jax as pj
from parc_jax import checker
from parc_jax.common.spelling import hex_text
from parc_jax.proof.certificate.write import answer_part
from parc_jax.safe_set.verdict.scene import scene_of

GOAL = pj.box([-0.2, -0.2, -1.0], [0.2, 0.2, 1.0])
BLOCK = pj.box([-0.5, 0.3], [0.0, 0.6])
BAND = pj.hpolytope([[1, 0], [-1, 0]], [1, 1])
SCENE = """
[goal]
lo = [-0.2, -0.2, -1.0]
hi = [0.2, 0.2, 1.0]
[body]
radius = 0.1
[[obstacles]]
lo = [-0.5, 0.3]
hi = [0.0, 0.6]
[[obstacles]]
lo = [-0.5, -0.6]
"""


def scene(obstacles, spans=None):
    return scene_of(pj.reach_avoid(GOAL, obstacles, 0.1, spans=spans), line_model(T=4))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: problem_of_text(SCENE),
        lambda: scene([BLOCK, pj.box([1], [2])]),
        lambda: scene([BLOCK, BAND]),
        lambda: scene([BLOCK, BLOCK], [None, (0, 4)]),
        lambda: pj.Uncertainty(obstacles=[None, 0.1]),
    ],
    ids=["file", "dimension", "unbounded", "span", "uncertainty"],
)
def test_messages_call_the_second_obstacle_obstacle_1(wrong):
    with pytest.raises(pj.InputError, match="obstacle 1: expected"):
        wrong()


def test_so_does_the_checker_and_it_calls_the_second_sample_sample_1():
    answer = toy_answer()
    plans = [(hex_text(x[:2]), hex_text(x[2:])) for x in answer.samples]
    parts = [{"p0": p0, "k": k, "sep": copy.deepcopy(SEP)} for p0, k in plans]
    parts[1]["sep"][1] = [[[4, [[3, "1"]]]]]  # below the lower block, where no plan is
    written = answer_part(answer.problem, answer.model, parts, [], [], no_plan=None, meta={})
    with pytest.raises(checker.Rejected, match=r"samples\[1\]: the condition of obstacle 1 at"):
        checker.check_answer(json.loads(json.dumps(written)))
