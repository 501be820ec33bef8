"""Proofs of many problems about one model: network and tube are read once, and no other model is
mistaken for it.
"""

import json

import jax
import numpy as np
import pytest
from toy_models import toy_case

from parc_jax import checker
from parc_jax.common.sets.box import box
from parc_jax.learning.network.relu import relu_network
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.certificate import prove as module
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import network_part, problem_part, sample_part, tube_part
from parc_jax.safe_set.separation import directions
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import paths_of, verdicts
from parc_jax.safe_set.verdict.scene import scene_of

MODEL, PROBLEM = toy_case(4)
NEARER = PROBLEM.replace(body=PROBLEM.body.replace(radius=10.0))


@pytest.fixture(scope="module")
def plan():
    return (
        Planner(MODEL)
        .solve(PROBLEM, jax.random.PRNGKey(0), Settings(samples=1, samples_only=True, proof=False))
        .samples[0]
    )


def part_of(problem, model, plan):
    p0, k = plan[: model.n_p], plan[model.n_p :]
    path = paths_of(model, p0[None], k[None])[0]
    return sample_part(scene_of(problem, model), model.tube, p0, k, path)


@pytest.mark.slow
def test_network_and_tube_are_read_once_for_many_problems(plan, monkeypatch):
    monkeypatch.setattr(module, "_RECENT", {})
    reads, real = [], checker.Context._read_network
    monkeypatch.setattr(
        checker.Context, "_read_network", lambda self, part: (reads.append(1), real(self, part))[1]
    )
    part = part_of(PROBLEM, MODEL, plan)
    verdicts = [prove(p, MODEL, [part])[0][0] for p in (PROBLEM, NEARER, PROBLEM)]
    assert verdicts == [True, False, True] and len(reads) == 1
    moved = relu_network(MODEL.net.weights, [*MODEL.net.biases[:-1], MODEL.net.biases[-1] + 5.0])
    assert not prove(PROBLEM, MODEL.replace(net=moved), [part])[0][0] and len(reads) == 2
    for shift in range(1, 8):
        other = relu_network(
            MODEL.net.weights, [*MODEL.net.biases[:-1], MODEL.net.biases[-1] + shift]
        )
        prove(PROBLEM, MODEL.replace(net=other), [part])
    assert len(module._RECENT) == 4


def spelled(context):
    """All that the checker has read, as one text."""
    return json.dumps(vars(context), default=lambda x: getattr(x, "__dict__", None) or str(x))


def test_another_problem_is_read_as_if_it_were_the_first(plan):
    parts = network_part(MODEL.net), tube_part(MODEL.tube)
    first = checker.Context(problem_part(PROBLEM, MODEL), *parts)
    again, anew = (
        first.about(problem_part(NEARER, MODEL)),
        checker.Context(problem_part(NEARER, MODEL), *parts),
    )
    assert spelled(again) == spelled(anew) and again.parts != first.parts
    for field, value in (
        ("steps", 3),
        ("n_q", 0),
        ("domain", {"lo": ["0"] * MODEL.n_k, "hi": ["9"] * MODEL.n_k}),
    ):
        with pytest.raises(checker.Rejected):
            first.about(problem_part(PROBLEM, MODEL) | {field: value})


def test_paths_on_the_host_are_those_of_the_verdicts(rng):
    p0, k = rng.normal(size=(20, 2)), rng.uniform(MODEL.domain.lo, MODEL.domain.hi, (20, MODEL.n_k))
    seen = verdicts(scene_of(PROBLEM, MODEL), p0, k)
    np.testing.assert_allclose(paths_of(MODEL, p0, k), seen.path, atol=1e-12)


def test_obstacles_of_one_shape_share_their_directions():
    """The table by remembered fans is the table of each obstacle on its own, to the last
    rounding.
    """
    blocks = [
        box([1.1, 0.3], [2.0, 0.9]),
        box([-3.7, 1.0], [-3.1, 2.5]),
        box([0.0, -7.3], [0.1, -7.0]),
    ]
    problem = reach_avoid(PROBLEM.goal, blocks, 0.25)
    table = directions.direction_table(problem, 2)
    assert table.multipliers[0] is table.multipliers[1] is table.multipliers[2]
    for j in range(3):
        for d, m in enumerate(table.multipliers[j]):
            w, support = table.direction(j, m)
            np.testing.assert_array_equal(table.w[j, d], w)
            np.testing.assert_allclose(table.support[j, d], support, rtol=1e-15, atol=1e-15)
