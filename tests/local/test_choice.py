"""The plan that is driven: what is said of it, and that no more is said than was seen."""

import pickle
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import toy_driven as toy
from episodes import PATIENT
from synthetic_plants import plant, straight
from toy_models import line_model

import parc_jax as pj
from parc_jax.app.study.job import LOOKS, drive
from parc_jax.app.study.settings import Study
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.common.sets.box import box
from parc_jax.common.spelling import exact, rounded_up
from parc_jax.drive.local import choice as made
from parc_jax.drive.local.choice import Choice
from parc_jax.drive.local.localise import Local, LocalRuns, bounded_near
from parc_jax.drive.local.safe_box import box_around, sides_of
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.counts import NoStatement, clopper_pearson, required_runs
from parc_jax.learning.bound.settings import DISCRETE_TIME, ModelBound, SpeedBound
from parc_jax.learning.bound.start_gap import StartTrial
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.runs.law import law_of
from parc_jax.problem.problem import Span
from sims.boxes_of_k import under

pytestmark = pytest.mark.soundness

KEY = jax.random.PRNGKey(0)
SMALL = Local(share=0.01, eps=0.1, rollouts=60, profile_runs=60, hidden=())


@pytest.fixture(scope="module")
def chosen():
    return toy.answer().choose(delta=0.05, looks=4)


@pytest.fixture(scope="module")
def near(chosen):
    return chosen.localise(plant(toy.gusty, toy.T), KEY, SMALL, settings=toy.SETTINGS).near


def test_a_box_at_a_border_of_the_part_of_k_that_was_asked_for_ends_there():
    """Of a plan near such a border there was none, where one at a border of K is cut."""
    whole = toy.answer()
    lo, hi = whole.scene.k_lo, whole.scene.k_hi.copy()
    hi[0] = whole.choose().k[0]
    part = replace(whole, scene=replace(whole.scene, k_hi=hi))
    box = part.choose(np.array([0.0, 0.0, 1.0, 0.0])).safe_box
    assert (lo <= box.lo).all() and (box.hi <= hi).all()


def test_beside_a_robot_that_left_its_tube_no_plan_is_tested(chosen):
    """As none is localised; it spent a look on what is not safe any more."""
    model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(model, 0.05, leave=0.5, given=(1,), effort=PATIENT)
    other = loop.step([9.0, 9.0], [0.0], [], lambda seen: -seen.path[:, -1, 0], at=0.0).committed
    obstacles, spans = pj.drive.reserved(other, 0.0, chosen.model.time)
    far = toy.answer().problem.replace(obstacles=obstacles, spans=spans)
    one = pj.Planner(chosen.model).solve(far, KEY, toy.SETTINGS).choose()
    assert loop.step([3.0, 3.0], [0.0], [], lambda seen: -seen.path[:, -1, 0], at=0.5).left
    with pytest.raises(InputError, match="was seen outside of its tube since: stop"):
        one.test(plant(toy.gusty, toy.T), KEY, n=100)
    assert one.looks.taken == 0


def test_a_choice_and_what_is_near_it_are_printed_in_a_few_lines(chosen, near):
    """It took 130 lines of arrays."""
    for one in (chosen, near, replace(chosen, near=near)):
        assert repr(one).count("\n") < 3 and len(repr(one)) < 1000


@pytest.mark.slow
def test_without_a_system_the_jitter_is_all_that_is_said(chosen):
    fresh = toy.answer().choose()
    assert fresh.tested is None and fresh.near is None and fresh.looks.taken == 0
    share = fresh.safe_box.share
    with pytest.raises(ValueError, match="read-only"):
        fresh.safe_box.half *= 2  # told as proved throughout
    assert fresh.risk().bound == min(1, fresh.model.claim.eps / share)
    said = fresh.details()
    assert "not run since it was chosen, so no statement" in said and "Perturbation" in said
    assert "Near it" not in said and "Looks" not in said
    claim = fresh.model.claim
    assert f"which has confidence {float(1 - claim.delta):g}. Assumes: IID, " in said
    assert all(entry in said for entry in claim.assumptions)


def test_the_plan_that_is_told_is_the_plan_that_was_tested(chosen):
    """It was rounded, to a plan that the answer does not hold."""
    told = re.search(r"plan chosen: p0 = \((.*?)\), k = \((.*?)\)\.", chosen.details())
    p0, k = ([float(x) for x in part.split(", ")] for part in told.groups())
    assert p0 == list(chosen.p0) and k == list(chosen.k)


@pytest.mark.slow
def test_jitter_promises_nothing_where_k_was_not_uniform(chosen):
    claim = chosen.model.claim
    logged = derived(claim, law=replace(claim.law, k_law="logged"))
    other = replace(chosen, scene=under(chosen.scene, chosen.model.replace(claim=logged)))
    assert isinstance(other.risk(), NoStatement)


def test_a_plan_with_disturbance_is_run_as_often_as_it_takes(chosen):
    system = plant(toy.gusty, toy.T)
    seen = chosen.test(system, KEY, eps=0.1).tested
    assert seen.failures == 0
    assert seen.n == required_runs(0.1, 0.05 / 4) and seen.eps <= Fraction(1, 10)
    assert seen.eps == clopper_pearson(0, seen.n, 0.05 / 4)
    assert "0 of 42 fresh runs" in seen.details() and "look" in seen.details()
    assert "failed (missed the goal, touched something, or did not return)" in seen.details()
    assert "(D) It is of a body (point 0 grown by 0.05 m) among 1 convex" in chosen.details()
    assert "a new run of it fails in its 1 s with probability at most 0." in seen.details()
    assert law_of(system, "given by the plan").describe() in seen.details()


def test_a_study_tells_the_bound_of_the_plan_that_it_drives(near, monkeypatch, tmp_path):
    monkeypatch.setattr(Choice, "localise", lambda one, *_, **__: replace(one, near=near))
    study = Study(bound=ModelBound(eps=0.1, delta=0.05))
    told = drive(plant(toy.gusty, toy.T), toy.answer(), study, KEY, tmp_path, True)
    bound = rounded_up(clopper_pearson(told["failures"], told["runs"], 0.05 / LOOKS))
    assert told["at_most"] == bound and 0 < float(bound) <= 0.1
    assert f"fails in its 1 s with probability at most {bound}, look" in told["statement"]
    assert [x.partition("(")[0] for x in told["beside"]] == ["UNSEEN", "LOOK"]
    assert (tmp_path / "near.json").exists()


def fails_often(key, k, s):
    """Ends outside of every goal with probability 0.3."""
    p, q = straight(k, s)
    return p, q + jnp.where(jax.random.uniform(key) < 0.3, 5.0, 0.0)


def test_a_plan_outside_of_k_is_none_and_spends_no_look(chosen):
    plan = chosen.plan.copy()
    plan[chosen.model.n_p] = chosen.model.domain.hi[0] + 0.1
    with pytest.raises(InputError, match="choice: expected a plan with k in"):
        replace(chosen, plan=plan, tested=None, near=None)


def test_failures_are_counted_and_paid_for(chosen):
    seen = replace(chosen, looks=toy.answer().choose(delta=0.05).looks).test(
        plant(fails_often, toy.T), KEY, n=400
    )
    assert 80 < seen.tested.failures < 160
    assert 0.3 < seen.tested.eps == clopper_pearson(seen.tested.failures, 400, 0.05)


def test_nan_and_contact_are_failures(chosen):
    looks = toy.answer().choose(delta=0.05, looks=2).looks

    def lost(key, k, s):
        p, q = straight(k, s)
        return p, q * jnp.where(jax.random.uniform(key) < 2.0, jnp.nan, 1.0)

    def into_the_wall(key, k, s):
        p, q = straight(k, s)
        bump = 8.0 + 0 * jax.random.uniform(key)
        return p.at[:, 1].add(bump * s * (1 - s)), q

    for run in (lost, into_the_wall):
        seen = replace(chosen, looks=looks).test(plant(run, toy.T), KEY, n=20).tested
        assert seen.failures == 20 and seen.eps == 1


def often_into_the_wall(key, k, s):
    """Else without a disturbance: most runs are one run, and where it ends is where all do."""
    p, q = straight(k, s)
    bump = jnp.where(jax.random.uniform(key) < 0.3, 8.0, 0.0)
    return p.at[:, 1].add(bump * s * (1 - s)), q


def test_runs_that_are_one_again_are_judged_each_for_itself(chosen):
    looks = toy.answer().choose(delta=0.05).looks
    seen = replace(chosen, looks=looks).test(plant(often_into_the_wall, toy.T), KEY, n=600).tested
    assert 120 < seen.failures < 240


@jax.jit
def drawn_while_traced(x):
    """A number of this process: whoever asks again in it gets the same program."""
    return x * (1 + 1e-6 * np.random.default_rng().normal())


def inner_draw(key, k, s):
    """Does not use its key, and is another robot in every process."""
    p, q = straight(k, s)
    return drawn_while_traced(p), q


def rare(key, k, s):
    """A gust once in a thousand million runs."""
    p, q = straight(k, s)
    return p + jnp.where(jax.random.uniform(key) < 1e-9, 1.0, 0.0) * s[:, None], q


@pytest.mark.parametrize("run", [toy.still, inner_draw, rare])
def test_runs_that_are_alike_are_not_taken_for_certainty(run, chosen):
    looks = toy.answer().choose(delta=0.05).looks
    seen = replace(chosen, looks=looks).test(plant(run, toy.T), KEY, eps=0.1).tested
    assert seen.n == required_runs(0.1, 0.05) and seen.failures == 0
    assert seen.eps == clopper_pearson(0, seen.n, 0.05) > 0


def ends_by_the_key(key, k, s):
    p, q = toy.still(key, k, s)
    return jnp.where(jax.random.uniform(key) < 0.3, jnp.nan, p), q


@pytest.mark.parametrize("run", [toy.still, often_into_the_wall, ends_by_the_key])
def test_what_the_runs_of_the_plan_refute_is_not_assumed_of_them(run, chosen, monkeypatch):
    """Eight k of the claim showed no disturbance; two runs of this one end apart."""
    tried = StartTrial(1e-5, None, alike=8)
    monkeypatch.setattr(made, "trial_of", lambda *_: tried)
    looks = toy.answer().choose(delta=0.05).looks
    seen = replace(chosen, looks=looks).test(plant(run, toy.T), KEY, n=40).tested
    assert ("NO_DISTURBANCE(of 8 k" in seen.details()) == (run is toy.still)


def test_looks_of_one_answer_are_one_account():
    answer = toy.answer()
    system = plant(toy.gusty, toy.T)
    answer.choose(delta=0.05).test(system, KEY, n=5)
    other = answer.choose([0, 0, 1.0, 0], delta=0.05)
    with pytest.raises(InputError, match="all 1 that were declared are spent"):
        other.test(system, KEY, n=5)
    with pytest.raises(InputError, match="declared by the first choice"):
        answer.choose(delta=0.05, looks=2)


def test_a_local_claim_is_about_its_box_and_narrower_where_the_error_is(chosen, near):
    domain = near.model.domain
    assert domain.contains(chosen.k) and near.share <= Fraction(1, 100)
    assert near.model.claim.kind == "pac" and near.model.claim.eps <= Fraction(1, 10)
    assert near.model.claim.delta == Fraction(5, 100) / 4
    assert near.held == 1 and near.risk().bound == near.model.claim.eps
    assert near.answer.cover.proved and (near.answer.samples[:, 2:] >= domain.lo).all()
    # the gust grows with k_0, and the box is at most a tenth of it wide
    most = toy.GUST * domain.hi[0]
    assert near.model.tube.final[:, :2].max() < 1.6 * most
    assert "every k of a box S = N is proved safe" in near.details()
    smaller = replace(near.proved, half=near.proved.half / 2, share=Fraction(1, 4))
    told = replace(near, proved=smaller).details()
    assert f"a box S = {sides_of(near.model.labels.k, smaller)}, that takes 25 % of N is" in told
    sides = re.findall(r"in \[(\S+), (\S+)\]", near.details().split(" % of K")[0])
    assert [[float(x) for x in side] for side in zip(*sides, strict=True)] == [
        near.model.domain.lo.tolist(),
        near.model.domain.hi.tolist(),
    ]
    claim = near.model.claim
    law, lasts = claim.law.describe(), f"in its {exact(near.model.time.t_f)} s with probability"
    assert f"a new rollout drawn from {law} leaves the local tube {lasts}" in near.details()
    assert f"leaves the tube at any time {lasts}" in claim.details()
    assert f"0 failed; discards, fixed beforehand: {claim.discard}." in near.details()
    said = near.answer.details()
    assert "k uniform on N" in said and "of share s of N" in said and "on K" not in said
    assert "k uniform on K" in chosen.model.claim.details()
    assert "by a run, k drawn uniformly from all of N, confidence" in in_short(claim)


def test_a_plan_of_a_local_answer_names_its_box(near):
    """N was told as K: the share of K was a hundred times too large."""
    plan = near.answer.choose()
    said = plan.details()
    assert "% of N and proved safe" in said and "by the claim over N, which" in said
    assert "of K and proved" not in said and "claim over K" not in said
    with pytest.raises(InputError, match="expected a plan of an answer over all of K; this one"):
        plan.localise(plant(toy.gusty, toy.T), KEY, SMALL)


def test_a_local_tube_that_is_not_narrower_says_so(near):
    same = replace(near, at_end=1.01, on_the_way=0.7)
    assert not same.is_narrower and "NOT narrower" in same.details()
    assert near.is_narrower == ("NOT narrower" not in near.details())


def test_a_smaller_proved_box_costs_its_share(near):
    half = replace(near, proved=replace(near.proved, share=near.proved.share / 2))
    assert half.risk().bound == 2 * near.risk().bound
    assert "50 % of N" in half.details()


def test_without_a_proved_box_nothing_is_said_of_driving(near):
    none = replace(near, proved=None)
    assert isinstance(none.risk(), NoStatement) and "no statement" in none.details()


@pytest.mark.slow
def test_a_system_that_fails_near_the_plan_gets_no_claim(chosen):
    def breaks(key, k, s):
        p, q = straight(k, s)
        return p, q + jnp.where(jax.random.uniform(key) < 0.4, jnp.nan, 0.0)

    looks = toy.answer().choose(delta=0.05).looks
    near = replace(chosen, looks=looks).localise(plant(breaks, toy.T), KEY, SMALL).near
    assert near.answer is None and isinstance(near.risk(), NoStatement)
    assert "No claim" in near.details()


def test_runs_on_a_box_are_uniform_there_and_disjoint():
    system = plant(toy.gusty, toy.T)
    part = box([0.25, 0.5], [0.5, 0.625])
    runs = LocalRuns(system, KEY, 300, None, True, part)
    train = runs.train()
    further = next(iter(runs.further(50)))
    fresh = next(iter(runs.fresh(50)))
    assert part.contains(train.k).all() and (train.domain.lo == part.lo).all()
    share = (train.k - part.lo) / (part.hi - part.lo)
    assert (
        np.abs(share.mean(axis=0) - 0.5).max() < 0.07
        and np.abs(share.var(axis=0) * 12 - 1).max() < 0.2
    )
    drawn = np.concatenate([train.k, further.k, fresh.k])
    assert len(np.unique(drawn[:, 0])) == len(drawn)
    assert (drawn != drawn.astype(np.float32)).mean() > 0.99  # in float32 a small box has few k
    assert train.law.k_law == "uniform" and train.law.hash != fresh_law(system)
    assert (train.stage, fresh.stage) == (Stage.TRAIN, Stage.BOUND)


def fresh_law(system):
    from parc_jax.learning.runs.law import law_of

    return law_of(system).hash


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ask", "match"),
    [
        (lambda c, s: c.test(s, KEY, eps=2.0), "eps: expected a probability"),
        (lambda c, s: c.test(s, KEY, n=0), "test: n: expected a whole number >= 1"),
        (lambda c, s: c.test(s, KEY, n=1.5), "test: n: expected a whole number >= 1"),
        (lambda c, s: c.test("car", KEY), "expected a system"),
        (lambda c, s: c.localise(s, KEY, 1e-3), "localise: expected a Local"),
        (lambda c, s: c.localise(s, KEY, Local(share=0.0)), "share of K"),
        (lambda c, s: c.localise(s, KEY, Local(rollouts=3)), "at least 20"),
    ],
)
def test_bad_questions_cost_no_look(ask, match):
    fresh = toy.answer().choose()
    with pytest.raises(InputError, match=match):
        ask(fresh, plant(toy.gusty, toy.T))
    assert fresh.looks.taken == 0


def test_a_chosen_plan_is_not_written_over(chosen):
    """Moved in place it was told as tested."""
    for one in (
        chosen,
        pickle.loads(pickle.dumps(chosen)),
        replace(chosen, plan=(own := chosen.plan.copy())),
    ):
        for values in (one.plan, one.p0, one.k):
            with pytest.raises(ValueError, match="read-only"):
                values += 5.0
    own += 5.0
    assert (one.plan == chosen.plan).all()


def test_a_plan_beside_a_robot_that_left_is_not_localised_and_costs_no_look(chosen):
    """Runs and look were spent before it was refused."""
    left = SimpleNamespace(under_way=False, number=0, loop="a platform", seen_outside=())
    looks, nominal = toy.answer().choose().looks, chosen.scene.nominal
    beside = nominal.query.problem.replace(spans=[Span((0, 3), of=left)])
    nominal = replace(nominal, query=replace(nominal.query, problem=beside))
    with pytest.raises(InputError, match="made for number 0 of a robot that has left that since"):
        replace(chosen, scene=replace(chosen.scene, nominal=nominal), looks=looks).localise(
            plant(toy.gusty, toy.T), KEY, SMALL
        )
    assert looks.taken == 0


def test_a_model_of_another_system_is_refused(chosen):
    other = plant(toy.gusty, toy.T, name="other")
    looks = toy.answer().choose().looks
    for ask in (
        lambda fresh: fresh.localise(other, KEY, SMALL),
        lambda fresh: fresh.test(other, KEY),
    ):
        with pytest.raises(InputError, match=r"the system of this model, .* agree; "):
            ask(replace(chosen, looks=looks))
    assert looks.taken == 0


@pytest.mark.night
def test_the_promise_of_a_local_claim_is_kept_at_its_rate():
    """The law of the error is known: gusts are uniform, so the chance to leave a tube is exact."""
    system = plant(toy.gusty, toy.T)
    part = box_around(np.array([0.5, 0.5]), 0.2, system.domain)
    asked = Local(eps=0.05, rollouts=40, profile_runs=40, hidden=())
    delta = Fraction(1, 10)
    wrong = 0
    repeats = 80
    rng = np.random.default_rng(0)
    k = rng.uniform(part.lo, part.hi, (200_000, 2))
    push = toy.GUST * k[:, :1] * rng.uniform(-1, 1, (200_000, 2))
    for seed in range(repeats):
        runs = LocalRuns(system, jax.random.PRNGKey(seed), 40, None, True, part)
        start = StartTrial(0.0, None)
        about = delta, asked, start, DISCRETE_TIME
        claim = bounded_near(toy.NET, runs, runs.train(), *about).claim
        half = claim.tube.final[claim.tube.bin_of(k), :2]
        wrong += (np.abs(push) > half).any(axis=1).mean() > claim.eps
    assert wrong / repeats <= 0.1 + 4 * np.sqrt(0.1 * 0.9 / repeats)


@pytest.mark.slow  # programs of its own
def test_runs_near_a_plan_are_made_by_an_executor_too():
    """Its state is none of the law of these runs: the system was said to have changed."""

    def simulate(rng, k):
        return np.linspace(0.0, 1.0, 5)[:, None] * k, k[:1]

    K, time = pj.box([0.0, 0.0], [1.0, 1.0]), pj.learning.time_grid(0.25, 1.0, 0.25)
    with ThreadPoolExecutor(2) as pool:
        system = pj.python_system(simulate, K, time, name="py", n_p=2, n_q=1, executor=pool)
        part = box_around(np.array([0.5, 0.5]), 0.2, K)
        train = LocalRuns(system, KEY, 3000, None, True, part).train()
    assert train.n == 3000 and part.contains(train.k).all() and not train.failed.any()


def test_a_plan_has_as_much_room_as_the_claim_says_that_the_start_matters(chosen, monkeypatch):
    claim, scene = toy.on_the_hill().claim, under(chosen.scene, toy.on_the_hill())
    k = np.array([0.01, 0.5])  # hardly any gust
    for end, fails in (((0.4, 0.4), 0), ((0.31, 0.4), 8), ((0.4, 0.69), 8)):  # goal: 0.3 to 0.7
        plan, looks = np.append(np.array(end) - k, k), toy.answer().choose(delta=0.05).looks
        found = Choice(plan, 0.0, scene, looks).test(toy.Hill(), KEY, n=8).tested
        assert found.failures == fails, end
    assert f"Assumes: IID, {claim.assumptions[1]}, DISCRETE_TIME(h" in found.details()
    assert "UNSEEN(1 look; before it only looks told here chose sets" in found.details()
    seen = {}

    def noted(net, runs, train, delta, local, start, between):
        seen.update(declared=start.declared, between=between)
        raise NotImplementedError

    monkeypatch.setattr("parc_jax.drive.local.choice.bounded_near", noted)
    looks, nominal = toy.answer().choose(delta=0.05).looks, scene.nominal
    nominal = replace(nominal, query=nominal.query.of(toy.on_the_hill()))
    with pytest.raises(NotImplementedError):
        replace(chosen, scene=replace(scene, nominal=nominal), looks=looks).localise(
            toy.Hill(), KEY, SMALL
        )
    assert seen == {"declared": 1.01 * toy.GAP, "between": SpeedBound(1.2)}


def test_a_sentence_says_what_runs_of_a_plan_rest_on(chosen, near):
    assert near.details().endswith(f"Assumes: {', '.join(near.model.claim.assumptions)}.")
    # its answer, and so its file, its header and both checkers, say which look it was
    look = f"LOOK({near.look.number} of 4, which share one delta)"
    assert look in near.answer.model.claim.assumptions and look in near.answer.details()
    looks = toy.answer().choose(delta=0.05).looks
    said = replace(chosen, looks=looks).test(toy.again(), KEY, n=30).details()
    assert "Assumes: IID, WORKERS_LOST(20, independent of the run), TRANS" in said


def test_results_are_of_the_plan_that_was_run_in_its_scene(chosen):
    tested = replace(chosen, looks=toy.answer().choose(delta=0.05).looks).test(
        plant(toy.gusty, toy.T), KEY, n=30
    )
    assert replace(tested, value=0.0).details() == tested.details()
    scene = under(chosen.scene, chosen.model)
    for change in ({"plan": tested.plan + 1e-9}, {"scene": scene}):
        with pytest.raises(InputError, match="results of this very plan"):
            replace(tested, **change)
        assert "not run since" in replace(tested, **change, tested=None).details()
