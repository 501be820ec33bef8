"""A question asked again under a local claim is the same question, and its looks one account."""

from unittest.mock import patch

import jax
import numpy as np
import pytest
import toy_driven as toy
from synthetic_plants import Plant, plant
from toy_models import told

import parc_jax as pj
from parc_jax.answer.answer import answer_data
from parc_jax.answer.looks import Looks
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.drive.local.choice import Choice
from parc_jax.learning.system import STAYS
from parc_jax.problem.robust.nominal import query
from parc_jax.safe_set.verdict.scene import pruned_scene

pytestmark = pytest.mark.soundness

KEY = jax.random.PRNGKey(0)
P0 = pj.box([0.0, -0.1], [0.1, 0.1])


def chosen(at=None):
    """A plan in the middle of the goal, from the start set of its scene, or from where we are."""
    model = told(toy.model(), rotation=(STAYS,))
    asked = query(toy.problem().replace(start=from_box(P0)), model, at).nominal()
    p0 = np.array([0.05, 0.0]) if asked.at is None else asked.at
    plan = np.concatenate([p0, [0.45, 0.5]])
    looks = Looks().declare(0.05, 2)
    return Choice(plan, 0.0, pruned_scene(asked), looks)


def near(choice):
    """Its local claim and answer, where the claim is that of all of K once more."""
    again = told(choice.model)
    system = turning() if again.rotation else plant(toy.gusty, toy.T)
    where = "parc_jax.drive.local.choice."
    with patch(f"{where}fit"), patch(f"{where}bounded_near", lambda *_: again):
        return choice.localise(system, KEY, settings=toy.SETTINGS).near


class Turning(Plant):
    """The gusty plant, of which somebody says that its runs turn with the heading."""

    rotation = (STAYS,)


def turning():
    """It, made anew."""
    base = plant(toy.gusty, toy.T)
    return Turning(base.domain, base.time, base.run)


@pytest.mark.slow
def test_the_start_set_is_asked_for_again():
    choice = chosen()
    found = near(choice)
    assert found.answer.cover.proved and P0.contains(found.answer.samples[:, :2]).all()
    assert found.answer.problem.start is not None and found.proved is not None
    assert found.answer.looks is choice.looks


@pytest.mark.slow
@pytest.mark.parametrize("at", [(0.05, 0.0), (0.05, 0.0, 0.1)])
def test_the_pose_is_asked_for_again(at, tmp_path):
    choice = chosen(at)
    found = near(choice)
    assert found.answer.cover.proved and found.proved is not None
    assert (found.answer.samples[:, :2] == choice.p0).all()
    # its sentences, its file and its header speak of the pose
    assert "Here: all plans start at (0.05, 0) m" in found.answer.details()
    assert ("with heading 0.1 rad" in found.answer.details()) == (len(at) == 3)
    assert "Here: all plans start at (0.05, 0) m" in choice.details()
    heading = "0.1" if len(at) == 3 else None
    assert answer_data(found.answer)["meta"]["pose"] == ["0.05", "0.0", heading]
    with pytest.raises(InputError, match="told from one pose"):
        pj.exchange.write_c(found.answer, tmp_path / "near.h")


@pytest.mark.slow
def test_a_claim_near_a_pose_is_told_from_it():
    choice = chosen((0.05, 0.0, 0.1))
    small = pj.drive.Local(share=0.01, eps=0.1, rollouts=60, profile_runs=60)
    with pytest.raises(InputError, match="agree; rotation is "):
        choice.localise(plant(toy.gusty, toy.T), KEY, small)
    assert choice.looks.taken == 0
    found = choice.localise(turning(), KEY, small, settings=toy.SETTINGS).near
    assert found.answer.scene.nominal.pose.heading == 0.1 and found.model.rotation == (STAYS,)
    assert (found.answer.samples[:, :2] == 0).all() and found.held > 0.9


def test_a_file_in_the_frame_of_the_robot_is_not_asked_again(tmp_path):
    there = near(chosen((0.05, 0.0, 0.1))).answer
    loaded = pj.load_answer(there.save(tmp_path / "answer.json"))
    assert loaded.scene.nominal.query is None and loaded.scene.nominal.pose.heading == 0.1
    again = loaded.choose(delta=0.05, looks=2)
    with pytest.raises(InputError, match="an answer that knows its question"):
        again.localise(turning(), KEY)
    assert again.looks.taken == 1


def test_uncertainty_goes_along_and_nothing_is_chosen_under_it(tmp_path):
    problem = toy.problem().replace(uncertainty=pj.Uncertainty(start=0.01))
    asked = query(problem, toy.model())
    again = asked.of(told(toy.model(), rotation=(STAYS,)))
    assert (
        again.problem is problem
        and again.nominal().uncertainty == asked.nominal().uncertainty is not None
    )
    answer = toy.planner().solve(problem, KEY, toy.SETTINGS)
    for one in (answer, pj.load_answer(answer.save(tmp_path / "answer.json"))):
        with pytest.raises(InputError, match="choose: expected an answer without uncertainty"):
            one.choose()


def test_a_model_without_rotation_is_not_asked_from_a_heading():
    with pytest.raises(InputError, match="a planar system that declares rotation"):
        chosen((0.05, 0.0, 0.1)).scene.nominal.query.of(toy.model())


def test_what_is_derived_from_an_answer_shares_its_looks():
    answer = toy.answer()
    first, second = answer.choose(delta=0.05), answer.choose(delta=0.05)
    first.looks.take()
    for other in (first, second):
        with pytest.raises(InputError, match="all 1 that were declared are spent"):
            other.test(plant(toy.gusty, toy.T), KEY, n=5)
    with pytest.raises(InputError, match="declared by the first choice"):
        answer.choose(delta=0.05, looks=2)


def test_a_loaded_answer_goes_on_with_its_looks(tmp_path):
    answer = toy.answer()
    answer.choose(delta=0.05, looks=2).looks.take()
    loaded = pj.load_answer(answer.save(tmp_path / "answer.json"))
    with pytest.raises(InputError, match=r"declared by the first choice, .*1 of 2 taken"):
        loaded.choose(delta=0.05, looks=3)
    assert loaded.choose().looks.take().number == 2
    with pytest.raises(InputError, match="all 2 that were declared are spent"):
        loaded.choose(delta=0.05, looks=2).looks.take()
    fresh = pj.load_answer(toy.answer().save(tmp_path / "other.json"))
    assert fresh.looks.delta is None and fresh.scene.nominal.query is not None
    assert near(fresh.choose()).answer.cover.proved
    assert fresh.looks.taken == fresh.looks.planned == 1
