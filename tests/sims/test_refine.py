"""Refinement: it zooms to where plans nearly are, claims there, and says what each stage bought."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import toy_driven as toy
from synthetic_plants import Plant, plant
from toy_models import told

from parc_jax.answer.answer import answer_data
from parc_jax.checker import check_answer
from parc_jax.common.errors import InputError
from parc_jax.drive.local.localise import Local
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.system import Trajectory
from parc_jax.safe_set.verdict.outcomes import outcomes
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of
from sims.boxes_of_k import (
    Aim,
    margins_of,
    pilot_samples,
    rank_given,
    rank_plans,
    scaled_tube,
    smaller_boxes,
    spaced,
    under,
)
from sims.refine import refine

KEY = jax.random.PRNGKey(0)
pytestmark = pytest.mark.slow  # kernels of its own: of the gate
LOCAL = Local(eps=0.1, rollouts=60, profile_runs=60)
ASKED = {"shares": (0.05, 0.01), "centres": 3, "runs": 60, "looks": 2, "delta": 0.05}


@pytest.fixture(scope="module")
def narrow():
    """A wall so close above the goal that the tube of all of K leaves no plan."""
    return toy.problem(wall=0.39)


@pytest.fixture(scope="module")
def refined(narrow):
    said = []
    system = plant(toy.gusty, toy.T)
    found = refine(
        toy.planner().model,
        narrow,
        system,
        KEY,
        LOCAL,
        **ASKED,
        settings=toy.SETTINGS,
        say=said.append,
    )
    return found, said


class Leaning(Plant):
    """Its runs lean with where they start."""

    def rollout_from(self, key, k, p0):
        p, q = self.run(key, k, jnp.linspace(0.0, 1.0, self.time.n_record + 1))
        return Trajectory(p + jnp.sin(p0[0]) * jnp.linspace(0.0, 1.0, len(p))[:, None], q)


def test_a_start_that_matters_is_refused_before_a_probe_or_a_look(narrow):
    steady = plant(toy.gusty, toy.T)
    leaning = Leaning(steady.domain, steady.time, steady.run)
    said = []
    with pytest.raises(InputError, match="do not depend on where they start"):
        refine(
            toy.planner().model,
            narrow,
            leaning,
            KEY,
            LOCAL,
            **ASKED,
            settings=toy.SETTINGS,
            say=said.append,
        )
    choice = toy.answer().choose()
    with pytest.raises(InputError, match="do not depend on where they start"):
        choice.localise(leaning, KEY, LOCAL)
    assert said == [] and choice.looks.taken == 0


def test_the_score_is_the_least_margin_under_all_of_the_tube_or_a_part(rng):
    model = toy.model()
    scene = scene_of(toy.problem(wall=0.6), model)
    p0, k = rng.uniform(-0.2, 0.4, (400, 2)), rng.uniform(0, 1, (400, 2))
    plans = rank_given(scene, p0, k)
    assert (np.diff(plans.value) <= 0).all()
    e = verdicts(scene, *plans.x)
    assert (plans.value == e.room).all()
    assert ((plans.value > 0) == e.safe).all() and e.safe.any() and not e.safe.all()
    less = rank_plans(scene, np.random.default_rng(0), part=0.5)
    thinner = under(scene, told(model, tube=scaled_tube(model.tube, 0.5)))
    seen = verdicts(thinner, less.x[0], less.x[1])
    assert seen.safe[less.value > 0].all() and less.score == seen.clearance[0]
    assert less.score > rank_plans(scene, np.random.default_rng(0)).score


def test_where_no_plan_is_safe_the_order_still_points_somewhere():
    model = toy.model()
    scene = scene_of(toy.problem(wall=0.3), model)
    plans = rank_plans(scene, np.random.default_rng(0))
    assert len(plans.x[1]) and -0.2 < plans.score < 0
    middle = np.full((1, 2), 0.5)
    assert plans.score > rank_given(scene, 0.15 + 0 * middle, middle).score


def test_centres_are_good_plans_apart_from_each_other():
    model = toy.model()
    plans = rank_plans(scene_of(toy.problem(), model), np.random.default_rng(0), spacing=0.1)
    chosen = plans.x[1][spaced(plans.x[1], model.domain, 4, 0.1)]
    assert (chosen[0] == plans.x[1][0]).all() and len(chosen) > 1
    gap = np.abs(chosen[:, None] - chosen[None]).max(axis=2) + np.eye(len(chosen))
    assert gap.min() >= 0.1


def jumpy(key, k, s):
    """Calm where k_0 is between 0.4 and 0.5; elsewhere it jumps with the last digits of k_0."""
    p, q = toy.straight(k, s)
    jump = jnp.where((k[0] > 0.4) & (k[0] < 0.5), 0.0, 0.1 * jnp.sin(1e6 * k[0]))
    return p + jump * s[:, None] ** 2, q


def test_smaller_boxes_lie_where_runs_end_calmly(rng):
    model = toy.model()
    scene = scene_of(toy.problem(), model)
    system = plant(jumpy, toy.T, name=model.system)
    places = [Aim(model.domain, np.array([0.5, 0.5]))]
    probe = pilot_samples(system, scene, places, 400, KEY, rng)[0]
    assert probe.scatter > 0.09
    found = smaller_boxes(probe, scene, 0.05, rng)
    values = [value for value, _ in found]
    assert values == sorted(values, reverse=True) and values[0] > probe.margin + 0.05
    for _, place in found:
        assert (model.domain.lo <= place.box.lo).all() and (place.box.hi <= model.domain.hi).all()
        assert 0.04 < np.prod(place.box.hi - place.box.lo) <= 0.05
    best = found[0][1].box
    assert 0.4 <= best.lo[0] and best.hi[0] <= 0.5
    again = pilot_samples(system, scene, [found[0][1]], 100, KEY, rng)[0]
    assert again.scatter < 1e-9 and again.margin > probe.margin + 0.05


def test_the_room_of_runs_is_that_of_a_plan_without_a_tube(rng):
    model = toy.model()
    scene = scene_of(toy.problem(wall=0.6), model)
    runs = collect(plant(toy.still, toy.T), KEY, 40, quiet=True)
    p0 = rng.uniform(-0.2, 0.4, (2, 40, 2))
    rooms = margins_of(scene, runs, p0)
    _, reached, distance = outcomes(scene, runs, p0[1])
    # straight between knots and judged with a slack, so clear means clear
    assert rooms.shape == (2, 40)
    safe = rooms[1] > 0
    assert safe.any() and not safe.all()
    assert (reached & (distance > 0))[safe].all()


@pytest.mark.night
@pytest.mark.soundness
def test_a_plan_where_the_model_of_all_of_k_has_none(refined, narrow):
    found, said = refined
    model = toy.model()
    whole = rank_plans(scene_of(narrow, model), np.random.default_rng(0))
    assert whole.score < 0  # the global tube leaves none
    near = found.choice.near
    assert near.answer.cover.proved and found.looks.taken <= 2
    assert check_answer(answer_data(near.answer)).samples > 0
    e = verdicts(near.answer.scene, found.choice.p0[None], found.choice.k[None])
    assert e.safe.all() and near.model.domain.contains(found.choice.k)
    # delta is split over the looks, and the claim is about runs of its own
    assert near.model.claim.delta * 2 == found.looks.delta
    assert near.answer.looks is found.looks is found.choice.looks
    assert near.model.claim.evidence["seed"] != model.claim.evidence["seed"]
    assert found.stages[0].stage == "model of all of K" and len(said) >= 2
    assert found.stages[-1].margin > 0 and "claim, look" in found.stages[-1].stage
    assert "share of K" in found.table() and "(D) Near it" in found.details()
    # the tube over all of K is not the one that the plan rests on
    assert found.choice.safe_box is None
    assert "under the local tube, what is said above of S" in found.details()


@pytest.mark.night
def test_no_plan_is_no_proof(narrow):
    walled = toy.problem(wall=0.0)
    asked = {"shares": (0.05,), "centres": 2, "runs": 30, "looks": 1, "delta": 0.05}
    quick = toy.SETTINGS.replace(budget_s=300)
    found = refine(
        toy.planner().model, walled, plant(toy.gusty, toy.T), KEY, LOCAL, **asked, settings=quick
    )
    assert found.choice is None
    assert "not a proof that none exists" in found.details() and found.looks.taken == 1


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"shares": (0.01, 0.05)}, "falling shares"),
        ({"shares": ()}, "falling shares"),
        ({"runs": 3}, "20 runs"),
        ({"centres": 0}, "at least one centre and 20"),
        ({"around": ((0.1, 0.2, 0.3),)}, "around of 2 parameters each"),
        ({"looks": 0}, "looks: expected"),
    ],
)
def test_settings_that_make_no_sense(change, match, narrow):
    system = plant(toy.gusty, toy.T, name=toy.model().system)
    with pytest.raises(InputError, match=match):
        refine(toy.planner().model, narrow, system, KEY, LOCAL, **(ASKED | change))


def test_questions_that_make_no_sense(narrow):
    with pytest.raises(InputError, match="system is plant, beside other"):
        refine(toy.planner().model, narrow, plant(toy.gusty, toy.T, name="other"), KEY)
    with pytest.raises(InputError, match="refine: expected a Local"):
        refine(toy.model(), narrow, plant(toy.gusty, toy.T), KEY, 3)
