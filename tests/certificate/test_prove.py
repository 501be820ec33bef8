"""Proofs of many problems about one model: network and tube are read once, and no other model is
mistaken for it.
"""

import json

import jax
import numpy as np
import pytest
from toy_models import toy_case

from parc_jax import checker
from parc_jax.planner.planner import Planner
from parc_jax.proof.certificate.write import network_part, problem_part, tube_part
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
