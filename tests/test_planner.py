"""The planner's doors: what it takes, what it refuses in a sentence, what it says at the end."""

import jax
import numpy as np
import pytest
import toy_query

import parc_jax as pj
from benchmarks.neuralparc import Published

KEY = jax.random.PRNGKey(0)
PLANNER = toy_query.planner
WRONG = {
    "a path for a model": (
        lambda: pj.Planner("boat.npz"),
        r"Planner: expected a TrajectoryModel; got 'boat.npz'. Try pj.load\(path\)",
    ),
    "a path for a problem": (
        lambda: PLANNER().solve("boat.toml", KEY),
        r"Planner: expected a problem; got 'boat.toml'. Try pj.exchange.load_problem\(path\)",
    ),
    "a seed for a key": (
        lambda: PLANNER().solve(toy_query.gap(), 3),
        r"key: expected a random key; got 3. Try jax.random.PRNGKey\(3\)",
    ),
    "options in a dict": (
        lambda: PLANNER().solve(toy_query.gap(), KEY, {"samples": 3}),
        r"solve: expected Settings; got dict. Try pj.Settings\(samples=10\)",
    ),
    "one problem for a batch": (
        lambda: PLANNER().solve_batch(toy_query.gap(), KEY),
        r"solve_batch: expected several problems; got one",
    ),
    "a seed for a batch": (
        lambda: PLANNER().solve_batch([toy_query.gap()], 0),
        r"key: expected a random key; got 0",
    ),
    "a number for a batch's settings": (
        lambda: PLANNER().solve_batch([toy_query.gap()], KEY, 10),
        r"solve_batch: expected Settings; got 10",
    ),
    "an answer for a model": (
        lambda: pj.load("runs/answer.json"),
        r"expected a model .* Try pj.load_answer\(path\), pj.exchange.load_problem\(path\) or",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_types_are_told_what_was_expected(name):
    call, words = WRONG[name]
    with pytest.raises(pj.InputError, match=words):
        call()


@pytest.mark.slow
def test_both_kinds_of_keys_are_keys():
    settings = pj.Settings.fast()
    for key in (jax.random.PRNGKey(1), jax.random.key(1), np.array([0, 1], np.uint32)):
        assert PLANNER().solve(toy_query.gap(), key, settings).status.found


@pytest.mark.slow
def test_the_status_says_what_is_known():
    proved = toy_query.answer()
    assert proved.status is pj.types.Status.PROVED and proved.status.found
    assert "exact-proved" in repr(proved) and f"{len(proved.corridors)} corridors" in repr(proved)
    assert "<li>(C)" in proved._repr_html_() and "<script" not in proved._repr_html_()
    bounded = PLANNER().solve(toy_query.gap(), KEY, pj.Settings.fast())
    assert bounded.status is pj.types.Status.BOUNDED and len(bounded.samples) >= 1
    absent = toy_query.answer(wall=True)
    assert absent.status is pj.types.Status.NO_PLAN and not absent.status.found
    assert "no-plan" in repr(absent)
    unknown = PLANNER().solve(toy_query.gap(wall=True), KEY, pj.Settings.fast())
    assert unknown.status is pj.types.Status.NOT_FOUND
    assert "proves nothing" in unknown.status.text


@pytest.mark.slow
def test_a_batch_has_a_status_for_every_problem():
    problems = [toy_query.gap(), toy_query.gap(wall=True)]
    plain = PLANNER().solve_batch(problems, KEY)
    assert plain.status.tolist() == [pj.types.Status.BOUNDED, pj.types.Status.NOT_FOUND]
    proved = PLANNER().solve_batch(problems, KEY, pj.Settings.fast().replace(proof=True))
    assert proved.status.tolist() == [pj.types.Status.PROVED, pj.types.Status.NOT_FOUND]
    assert repr(proved) == "<BatchAnswer: 1 of 2 found, 1 proved under an assumed tube>"


@pytest.mark.night
def test_warming_up_takes_no_numbers_from_the_query_after_it():
    settings = pj.Settings(samples=5, target=0.3, budget_s=300)
    before = PLANNER().solve(toy_query.gap(), KEY, settings.replace(samples_only=True))
    cold = PLANNER().warm_up(toy_query.gap(), settings)
    assert cold.cover.timings["first_sample_s"] > 0 and cold.status is pj.types.Status.BOUNDED
    after = PLANNER().solve(toy_query.gap(), KEY, settings.replace(samples_only=True))
    assert (before.samples == after.samples).all()


def test_problems_and_planners_say_what_they_are_in_a_line():
    shown = repr(toy_query.gap())
    assert shown.startswith("<Problem: goal") and "1 obstacle" in shown
    for thing in (toy_query.gap(), PLANNER(), PLANNER().model, toy_query.answer()):
        assert len(repr(thing)) < 300 and "\n" not in repr(thing)


@pytest.mark.slow
def test_the_exact_method_may_be_named_and_the_published_one_is_an_object_too():
    settings = pj.Settings(samples=3, samples_only=True)
    plain = PLANNER().solve(toy_query.gap(), KEY, settings)
    named = PLANNER().solve(toy_query.gap(), KEY, settings.replace(method=pj.types.Exact()))
    assert (plain.samples == named.samples).all()
    published = PLANNER().solve(toy_query.gap(), KEY, settings.replace(method=Published()))
    assert published.status is pj.types.Status.PROVED and not published.corridors


@pytest.mark.night
def test_a_batch_takes_both_kinds_of_keys_and_they_say_the_same():
    problems = [toy_query.gap()]
    old = PLANNER().solve_batch(problems, jax.random.PRNGKey(5))
    new = PLANNER().solve_batch(problems, jax.random.key(5))
    again = PLANNER().solve_batch(problems, jax.random.key(5), warm=new)
    assert (old.plans == new.plans).all() and again.found.all()
