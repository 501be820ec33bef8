"""Refinement: it zooms to where plans nearly are, claims there, and says what each stage bought."""

import dataclasses

import jax
import numpy as np
import pytest
import toy_driven as toy
from synthetic_plants import plant

from parc_jax.checker import check_answer
from parc_jax.driven.local_model import Local
from parc_jax.driven.nearly import judged, nearly_safe, shrunk
from parc_jax.driven.probe import spread_out
from parc_jax.driven.refine import Refine
from parc_jax.errors import InputError
from parc_jax.planner import Planner
from parc_jax.verdict.pointwise import verdicts
from parc_jax.verdict.scene import scene_of

KEY = jax.random.PRNGKey(0)
LOCAL = Local(eps=0.1, rollouts=60, profile_runs=60)
ASKED = Refine((0.05, 0.01), centres=3, runs=30, kept=2, local=LOCAL, looks=2, delta=0.05)


@pytest.fixture(scope="module")
def narrow():
    """A wall so close above the goal that the tube of all of K leaves no plan."""
    return toy.problem(wall=0.39)


@pytest.fixture(scope="module")
def refined(narrow):
    said = []
    system = plant(toy.gusty, toy.T)
    found = toy.planner().refine(narrow, system, KEY, ASKED, toy.SETTINGS, say=said.append)
    return found, said


def test_the_score_is_the_share_of_the_tube_and_then_the_least_margin(rng):
    model = toy.model()
    scene = scene_of(toy.problem(wall=0.6), model)
    z, k = rng.uniform(0.2, 0.8, (400, 2)), rng.uniform(0, 1, (400, 2))
    plans = judged(model, scene, z, k)
    assert (np.diff(plans.share) <= 0).all()
    safe = verdicts(model, scene, plans.p0, plans.k).safe
    assert ((plans.share == 1.0) == safe).all() and safe.any()
    half = plans.share == 0.6
    less = dataclasses.replace(model.claim, tube=shrunk(model.tube, 0.6))
    under = model.replace(claim=less)
    assert verdicts(under, scene, plans.p0[half], plans.k[half]).safe.all()
    assert not safe[half].any()


def test_where_no_plan_is_safe_the_order_still_points_somewhere():
    model = toy.model()
    scene = scene_of(toy.problem(wall=0.3), model)
    plans = nearly_safe(model, scene, np.random.default_rng(0))
    assert len(plans.k) and plans.score < (1.0, 0.0)
    assert plans.score > judged(model, scene, np.full((1, 2), 0.65), np.full((1, 2), 0.5)).score


def test_centres_are_good_plans_apart_from_each_other():
    model = toy.model()
    plans = nearly_safe(model, scene_of(toy.problem(), model), np.random.default_rng(0))
    chosen = spread_out(plans, model.domain, 4, 0.1)
    assert (chosen[0] == plans.k[0]).all() and len(chosen) > 1
    gap = np.abs(chosen[:, None] - chosen[None]).max(axis=2) + np.eye(len(chosen))
    assert gap.min() >= 0.1


@pytest.mark.slow
@pytest.mark.soundness
def test_a_plan_where_the_model_of_all_of_k_has_none(refined, narrow):
    found, said = refined
    model = toy.model()
    whole = nearly_safe(model, scene_of(narrow, model), np.random.default_rng(0))
    assert whole.score[0] < 1.0  # the global tube leaves none
    near = found.choice.near
    assert near.answer.proved and found.looks.taken <= 2
    assert check_answer(near.answer.to_json()).samples > 0
    e = verdicts(near.model, near.answer.scene, found.choice.p0[None], found.choice.k[None])
    assert e.safe.all() and near.model.domain.contains(found.choice.k)
    # delta is split over the looks, and the claim is about runs of its own
    assert near.model.claim.delta * 2 == found.looks.delta
    assert near.model.claim.evidence["seed"] != model.claim.evidence["seed"]
    assert found.stages[0].stage == "model of all of K" and len(said) >= 2
    assert found.stages[-1].part == 1.0 and "claim, look" in found.stages[-1].stage
    assert "safe under" in found.table() and "(D) Near it" in found.statement()


@pytest.mark.slow
def test_no_plan_is_no_proof(narrow):
    walled = toy.problem(wall=0.0)
    asked = Refine((0.05,), centres=2, runs=30, kept=1, local=LOCAL, looks=1, delta=0.05)
    quick = toy.SETTINGS.replace(budget_s=300, no_plan_budget_s=0.0)
    found = toy.planner().refine(walled, plant(toy.gusty, toy.T), KEY, asked, quick)
    assert found.choice is None and found.answer is None
    assert "not a proof that none exists" in found.statement() and found.looks.taken == 1


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"shares": (0.01, 0.05)}, "falling shares"),
        ({"shares": ()}, "falling shares"),
        ({"runs": 3}, "20 runs"),
        ({"centres": 0}, "at least one centre"),
    ],
)
def test_settings_that_make_no_sense(change, match):
    with pytest.raises(InputError, match=match):
        Refine(**change)


def test_questions_that_make_no_sense(narrow):
    with pytest.raises(InputError, match="expected the system of this model"):
        toy.planner().refine(narrow, plant(toy.gusty, toy.T, name="other"), KEY)
    with pytest.raises(InputError, match="refine: expected a Refine"):
        Planner(toy.model()).refine(narrow, plant(toy.gusty, toy.T), KEY, 3)
