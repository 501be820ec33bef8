"""Validated sets: what the tests of a scene show, and that no more is said than was tested."""

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import toy_driven as toy
from scipy.stats import binom, ks_2samp
from synthetic_plants import plant
from toy_file import hashed

import parc_jax as pj
from parc_jax.answer.looks import Looks, looks_of_json
from parc_jax.app.cli.scene import as_json, code_of, verdict
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.study.job import run_study
from parc_jax.app.study.report import VALIDATED_SET, explained
from parc_jax.app.study.settings import Study
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.common.spelling import exact, rounded_down
from parc_jax.drive.local import validate as module
from parc_jax.drive.local.nested import first_set, fixed_sequence, level, nested_sets
from parc_jax.drive.local.trials import run_once
from parc_jax.drive.local.validate import validated
from parc_jax.drive.local.validation import Step, Validate, Validation
from parc_jax.learning.bound.claim import check_claim, derived
from parc_jax.learning.bound.counts import NoStatement, required_runs
from parc_jax.learning.bound.declared import stand_in
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.fresh import SEEN, ledger_of, used_by
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.bound.tube import fitted_tube
from parc_jax.learning.runs.collect import collect
from parc_jax.method import Exact, FirstProved
from parc_jax.problem.problem import Span
from parc_jax.problem.robust.nominal import query
from parc_jax.proof.certificate.write import part_hash
from sims.recorded import replay_recorded

pytestmark = pytest.mark.soundness

KEY = jax.random.PRNGKey(5)
SYSTEM = plant(toy.gusty, toy.T)


def asked_of(**changes):
    """A test of its own account."""
    about = {"risk": 0.05, "delta": 0.1, "tests": 600, "scales": (1.0, 0.7, 0.4, 0.1)}
    return Validate(**({"source": SYSTEM} | about | changes))


ASKED = asked_of()
REPEATS, WRONG = 500, 0.1  # delta of the repetitions


@pytest.fixture(scope="module")
def answer():
    """A wall that plans under a narrower tube pass closer: some of them fail."""
    return toy.planner().solve(toy.problem(0.62), KEY, toy.SETTINGS, validate=ASKED)


def test_recorded_runs_in_a_validated_set_are_told_its_risk(answer):
    """ "shown to be safe" of a set whose runs may leave the tube."""
    runs = collect(SYSTEM, KEY, n=20, quiet=True)
    said = replay_recorded(answer.validation.answer, runs).details()
    risk = "(risk of a plan of its law at most 0.05, confidence 0.9)"
    assert f"safe under a tube that runs may leave {risk}; of" in said


def repetitions(accepts, widths, failing, seed, tests=300):
    """How often a set is accepted whose plans fail more often than the risk asked for. Plans are
    uniform on [0, 1], the sets are [0, w], and a plan x fails with probability failing(x).
    """
    asked = Validate(SYSTEM, risk=0.05, delta=WRONG, tests=tests, scales=tuple(1 - 0.5 * widths))
    grid = (np.arange(4000) + 0.5) / 4000
    risk = [failing(grid[grid <= w]).mean() for w in widths]
    wrong = 0
    for i in range(REPEATS):
        rng = np.random.default_rng((seed, i))
        x = rng.uniform(size=asked.tests)
        failed = rng.uniform(size=asked.tests) < failing(x)
        # the share of each set is known, so where to begin is settled before any plan is drawn
        first = int((tests * widths >= 2 * required_runs(0.05, WRONG)).argmax())
        inside = np.array([x <= w for w in widths])
        chosen = accepts(asked, inside, inside & failed, first)
        wrong += chosen is not None and risk[chosen] > 0.05
    return wrong


def in_sequence(asked, inside, failed, first):
    steps, passed = fixed_sequence(asked, inside, failed, first)
    return None if not passed else asked.scales.index(steps[passed - 1].scale)


def best_of_all(asked, inside, failed, first):
    """The fault: every set is tested, and the largest that passes is taken."""
    for j in range(first, len(inside))[::-1]:
        n, x = int(inside[j].sum()), int(failed[j].sum())
        if binom.cdf(x, n, float(asked.risk)) <= float(asked.delta):
            return j
    return None


def of_disjoint_trials(accepts):
    """Sets so different in size that their tests are nearly independent; all but none fail."""
    widths = 1.6 ** np.arange(-9.0, 1.0)
    return repetitions(accepts, widths, lambda x: np.full(len(x), 0.0501), seed=3, tests=4000)


def test_a_wrong_set_is_as_rare_as_the_theorem_says():
    most = binom.ppf(0.999, REPEATS, WRONG)
    for widths, slope in ((np.linspace(0.3, 1.0, 8), 0.14), (np.linspace(0.5, 1.0, 5), 0.11)):
        found = repetitions(in_sequence, widths, lambda x, slope=slope: slope * x, seed=2)
        assert found <= most
    assert of_disjoint_trials(in_sequence) <= most


def test_a_test_out_of_order_would_be_noticed():
    assert of_disjoint_trials(best_of_all) > binom.ppf(0.999, REPEATS, WRONG)


def in_cells(tests_with):
    """How often plans are accepted in the cells that no run of a design failed in, where all plans
    alike fail more often than the risk asked for. tests_with: runs of design and test -> those that
    are tested with.
    """
    asked = Validate(SYSTEM, risk=0.05, delta=WRONG, tests=300, scales=(1.0,))
    accepted = 0
    for i in range(REPEATS):
        rng = np.random.default_rng((7, i))
        cell, failed = rng.integers(20, size=(2, 300)), rng.uniform(size=(2, 300)) < 0.06
        clean = ~np.isin(np.arange(20), cell[0][failed[0]])
        cell, failed = tests_with(cell, failed)
        inside = clean[cell][None]
        accepted += fixed_sequence(asked, inside, inside & failed, 0)[1]
    return accepted


def test_runs_of_the_design_that_test_again_are_noticed():
    most = binom.ppf(0.999, REPEATS, WRONG)
    assert in_cells(lambda cell, failed: (cell[1], failed[1])) <= most
    assert in_cells(lambda cell, failed: (cell[0], failed[0])) > most


def test_counting_only_runs_that_return_would_be_noticed():
    """Half of the failed runs do not return."""

    def of_those_that_return(asked, inside, failed, first):
        returned = np.random.default_rng(failed.sum()).uniform(size=failed.shape[1]) < 0.5
        return in_sequence(asked, inside & (returned | ~failed), failed & returned, first)

    widths = np.linspace(0.3, 1.0, 8)
    found = repetitions(of_those_that_return, widths, lambda x: 0.14 * x, seed=2)
    assert found > binom.ppf(0.999, REPEATS, WRONG)


def test_the_sequence_ends_with_the_first_test_that_does_not_pass():
    inside = np.array([[True] * 20 + [False] * 280, [True] * 100 + [False] * 200, [True] * 300])
    asked = Validate(SYSTEM, risk=0.05, delta=WRONG, tests=300, scales=(1.0, 0.5, 0.2))
    failed = np.zeros((3, 300), bool)
    steps, passed = fixed_sequence(asked, inside, failed, 1)
    assert [step.n for step in steps] == [100, 300] and passed == 2
    steps, passed = fixed_sequence(asked, inside, failed, 0)  # the first holds too few
    assert [step.n for step in steps] == [20] and passed == 0
    failed[:, :20] = True
    steps, passed = fixed_sequence(asked, inside, failed, 1)
    assert [step.n for step in steps] == [100] and passed == 0  # a later one may not rescue it


def test_the_sequence_begins_where_other_draws_expect_enough():
    levels = np.repeat([0, 1, 2, 3], [10, 40, 30, 20])  # of three sets, and of none
    assert [first_set(levels, 3, n, 20) for n in (400, 399, 80, 79)] == [0, 1, 1, 2]
    assert first_set(levels, 3, 1, 20) == 2


def test_the_set_is_larger_and_its_risk_is_what_it_says(answer):
    validated = answer.validation.answer
    assert validated.share.at_least > 1.2 * answer.share.at_most
    plans = answer.sample(KEY, 500)
    assert validated.contains(plans[:, :2], plans[:, 2:]).mean() > 0.97  # but for thin corridors
    drawn = validated.sample(jax.random.PRNGKey(9), 4000)
    runs = collect(SYSTEM, jax.random.PRNGKey(8), 4000, Stage.REPLAY, k=drawn[:, 2:], quiet=True)
    path = drawn[:, None, :2] + np.asarray(runs.p)
    touched = (path[:, :, 1] + 0.05 >= 0.62).any(axis=1)
    missed = (np.abs(path[:, -1] - 0.5) > 0.2).any(axis=1)
    failed = int((touched | missed).sum())
    assert binom.sf(failed - 1, 4000, 0.05) > 1e-3  # no evidence against the promise
    assert answer.validation.steps[-1].failed > 0  # and the sequence went as far as plans that fail
    assert validated.risk().bound == Fraction(1, 20)


def test_tests_and_draws_have_one_law(answer, monkeypatch):
    """Who is tested in a set is drawn as `sample` draws from it."""
    seen = {}
    real = module.fixed_sequence

    def noted(asked, inside, failed, first):
        seen["inside"] = inside
        return real(asked, inside, failed, first)

    def run(system, scene, key, stage, plans, *rest):
        seen["plans"] = plans
        return run_once(system, scene, key, stage, plans, *rest)

    monkeypatch.setattr(module, "fixed_sequence", noted)
    monkeypatch.setattr(module, "run_once", run)
    asked = asked_of()
    again = toy.planner().solve(toy.problem(0.62), KEY, toy.SETTINGS, validate=asked)
    last = ASKED.scales.index(float(again.validation.answer.model.claim.evidence["scale"]))
    of_tests = seen["plans"][seen["inside"][last]]  # starts and parameters
    of_draws = again.validation.answer.sample(jax.random.PRNGKey(4), 600)
    assert min(ks_2samp(a, b).pvalue for a, b in zip(of_tests.T, of_draws.T, strict=True)) > 1e-4


def test_the_sentence_has_its_numbers_and_its_limits(answer, tmp_path):
    validation = answer.validation
    validated, step = validation.answer, validation.steps[-1]
    said = validation.details()
    assert (
        validation.sentence in answer.details()
        and "(V) With confidence 0.9, a plan drawn uniformly" in said
    )
    lasts = f"in its {exact(answer.model.time.t_f)} s"
    assert f"touches something {lasts}, or does not return" in said
    assert f" fails {lasts} with probability at most" in answer.summary()
    assert "by plant (k by a uniform draw from the set" in said
    assert " of 600 plans drawn" in said and "runs may leave it" in said
    accepted = validated.model.claim
    assert in_short(accepted) == "of a validated set: runs may leave it"
    assert "% of the model's safe set under a tube that runs may leave" in repr(validated)
    assert "may leave" not in repr(answer)
    short = validated.summary()  # which had neither a scene nor a confidence
    assert "fails with probability at most 0.05 in this scene, confidence 0.9: (V)" in short
    assert "Safe under a tube that runs may leave: " in short
    assert f"at most 0.05: {accepted.n:,} of" in said and f"{accepted.discard:,} of their" in said
    assert step.n >= accepted.n and "picked by hand or by a search, of another scene" in said
    assert "% of the plans whose first point ends in the goal" in validation.summary()
    assert validation.summary() in answer.summary()
    step = pj.learning.time_grid(0.1, 1.2, 0.05)
    with pytest.raises(InputError, match="expected a claim about all of K; this one is about one"):
        pj.problem.mover_obstacles(validated.model, [], 0.4, step, 0.0)  # took it for a tube
    with pytest.raises(InputError, match="expected a claim about all of K; this one is about one"):
        validated.model.save(tmp_path / "validated.npz")  # nobody could read it
    assert not (tmp_path / "validated.npz").exists()
    again = load_answer(validated.save(tmp_path / "validated.json"))
    assert (
        again.details().startswith(validated.details()) and again.model.claim.hash == accepted.hash
    )
    plans = validated.sample(KEY, 50)
    assert again.contains(plans[:, :2], plans[:, 2:]).all() and again.risk() == validated.risk()


def promised(found):
    """The answer in its scene, whose obstacle is told of for some of the plan by a promise."""
    span = Span((0, 2), said="That it is there rests on a promise")
    told = replace(found.scene.nominal, problem=found.problem.replace(spans=[span]))
    return replace(found, scene=found.scene.replace(nominal=told))


def test_the_shell_names_the_file_of_a_validated_set(answer):
    """The answer's own file has not the sentence (V), and its exit code was that of no plans."""
    alone = replace(answer, validation=None)
    told = json.loads(as_json(answer, Path("a.json"), None))
    assert told["validated"]["answer"] == "a.validated.json" and told["frame"] == "world"
    named = "The validated set: parc-jax explain a.validated.json; parc-jax check a.validated.json"
    said, of_alone = (verdict(one, Path("a.json")) for one in (answer, alone))
    assert named in said and named not in of_alone
    none = replace(answer, samples=answer.samples[:0], cover=answer.cover._replace(corridors=[]))
    assert (code_of(none), code_of(replace(none, validation=None))) == (0, 1)


def test_what_its_obstacles_rest_on_is_said_beside_a_set_and_once(answer):
    tested = replace(answer.validation, answer=promised(answer.validation.answer))
    found = replace(promised(answer), validation=tested)
    said = "1 obstacle of 1 is told of for some of the 4 intervals"
    for words in (found.validation.details(), found.details()):
        assert words.count(said) == words.count("rests on a promise") == 1
    assert found.validation.details().startswith(found.validation.sentence)


def test_settings_that_look_for_no_set_spend_no_look():
    asked = asked_of()
    with pytest.raises(InputError, match="validate: expected settings of sets; got samples_only"):
        toy.planner().solve(toy.problem(), KEY, pj.Settings.fast(), validate=asked)
    assert asked.looks.taken == 0


def test_from_one_start_its_share_is_of_k_and_its_plans_start_there(tmp_path):
    asked = asked_of()
    here = toy.planner().solve(toy.problem(0.62), KEY, toy.SETTINGS, at=(0.05, 0.0), validate=asked)
    validated = here.validation.answer
    share, held = validated.share, validated.coverage
    least = rounded_down(100 * Fraction(share.at_least) * Fraction(held.at_least), 3)
    assert f"at least {least} % of all k in K, with conf" in here.validation.summary()
    drawn = validated.sample(KEY, 20)
    assert (drawn[:, :2] == [0.05, 0.0]).all() and "start at (0.05, 0) m" in validated.details()
    # the set that was tested is of this start alone, also where the file tells of none
    assert "(k by a uniform draw from the set, all from (0.05, 0)" in here.validation.details()
    again = load_answer(validated.save(tmp_path / "here.json"))
    assert again.contains(drawn[:, :2], drawn[:, 2:]).all()
    data = json.loads((tmp_path / "here.json").read_text())
    for name in ("at", "pose", "hash"):
        del data["meta"][name]
    data["meta"]["hash"] = part_hash(data["meta"])
    (tmp_path / "anywhere.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="draws from another place, or start, of which"):
        load_answer(tmp_path / "anywhere.json")


def test_a_validated_set_is_of_its_scene_and_of_draws_alone(answer, tmp_path):
    validated = answer.validation.answer
    with pytest.raises(InputError, match="one set of plans in one scene"):
        pj.Planner(validated.model)
    for pick in (validated.choose, validated.best):
        with pytest.raises(InputError, match="a plan that is chosen is not drawn"):
            pick()
    claim, net = validated.model.claim, validated.model.net
    assert isinstance(claim.risk(share=0.5), NoStatement)
    runs = collect(SYSTEM, KEY, 10, quiet=True)
    for refused in (
        lambda: pj.exchange.write_c(validated, tmp_path / "set.h"),
        lambda: pj.drive.Loop(validated.model, 0.05, leave=0.5),
        lambda: pj.monitor(claim, net),
        lambda: pj.learning.update(claim, net, runs, runs),
        lambda: pj.learning.trajectory_model(net, claim),
    ):
        with pytest.raises(InputError, match="one set"):
            refused()
    assert list(tmp_path.iterdir()) == []


def test_a_file_with_other_corridors_or_draws_is_not_the_set(answer, tmp_path):
    validated = answer.validation.answer
    whole = validated.save(tmp_path / "validated.json")
    assert load_answer(load_answer(whole).save(tmp_path / "again.json")).risk() == validated.risk()
    assert "lay in this one (1 corridor; " in validated.model.claim.details()
    narrower = answer.save(tmp_path / "answer.json")
    for change in (
        {"corridors": json.loads(narrower.read_text())["corridors"]},
        {"meta": hashed(json.loads(whole.read_text())["meta"] | {"within": [["0x0p+0"] * 4] * 2})},
    ):
        other = tmp_path / "other.json"
        other.write_text(json.dumps(json.loads(whole.read_text()) | change))
        with pytest.raises(InputError, match=r"set .*was tested"):
            load_answer(other)


def test_a_set_of_another_scene_is_not_explained_beside_an_answer(answer, tmp_path):
    answer.validation.answer.save(tmp_path / VALIDATED_SET)
    answer.save(tmp_path / "answer.json")
    assert "The validated set:" in explained(tmp_path)
    other = answer.model.replace(claim=derived(answer.model.claim, evidence={"bound": "anew"}))
    scene, at = toy.problem(0.62), np.array([0.05, 0.0])
    for changed in (
        toy.planner().solve(toy.problem(0.7), KEY, toy.SETTINGS),
        pj.Planner(other).solve(scene, KEY, toy.SETTINGS),
        toy.planner().solve(scene, KEY, toy.SETTINGS, at=at),
    ):
        changed.save(tmp_path / "answer.json")
        with pytest.raises(InputError, match=r"json: expected a set of the claim, problem and"):
            explained(tmp_path)


def test_every_number_of_the_claim_is_in_its_hash(answer):
    claim, other = answer.validation.answer.model.claim, Fraction(1, 99)
    for change in ({"n": 9}, {"discard": 0}, {"eps": other}, {"delta": other}, {"evidence": {}}):
        with pytest.raises(InputError, match="it was made about"):
            check_claim(replace(claim, **change))


def test_its_runs_decide_as_often_as_was_declared_however_a_scene_is_spelled():
    planner, scene, wall = toy.planner(), toy.problem(0.62), toy.problem(0.62).obstacles
    halves = [pj.box([-1.0, 0.62], [0.4, 1.62]), pj.box([0.3, 0.62], [2.0, 1.62])]
    beyond = pj.box([-1.0, 0.9], [2.0, 1.62])
    same = [(*wall, *wall), halves, halves[::-1], (*wall, beyond)]
    asked, made = asked_of(looks=2), []
    for other, number in ((scene, 1), (scene.replace(obstacles=same[1]), 2)):
        found = planner.solve(other, KEY, toy.SETTINGS, validate=asked).validation
        made.append(found.answer.model.claim.evidence[SEEN][-1])
        assert found.asked.delta == ASKED.delta / 2
        assert f"LOOK({number} of 2, which share one delta)" in found.details()
    with pytest.raises(InputError, match="all 1 that were declared are spent"):
        found.asked.looks.take()  # in another scene, say: it was as new
    # what the first look saw may have chosen what the second one tests: other disturbances
    assert made[0] != made[1]
    for obstacles in same:
        with pytest.raises(InputError, match="all 2 that were declared are spent"):
            planner.solve(scene.replace(obstacles=obstacles), KEY, toy.SETTINGS, validate=asked)
    with pytest.raises(InputError, match="all 2 that were declared are spent"):
        planner.solve(scene, KEY, toy.SETTINGS, validate=replace(asked, tests=700))


def test_sets_and_plans_may_share_one_account():
    answer = toy.answer()
    chosen, asked = answer.choose(delta=0.1, looks=2), asked_of(delta=None, looks=answer.looks)
    assert asked.delta == ASKED.delta
    found = toy.planner().solve(toy.problem(0.62), KEY, toy.SETTINGS, validate=asked).validation
    assert found.asked.delta == ASKED.delta / 2
    tested = chosen.test(SYSTEM, KEY, n=30)
    assert tested.tested.look == (2, 2, ASKED.delta / 2, ()) and "LOOK(2 of 2" in tested.details()
    with pytest.raises(InputError, match="all 2 that were declared are spent"):
        chosen.test(SYSTEM, KEY, n=30)
    with pytest.raises(InputError, match="expected those declared by the first choice"):
        asked_of(delta=0.2, looks=answer.looks)


def test_accounts_of_one_scene_tell_of_each_other():
    planner, asked = toy.planner(), asked_of(looks=2)
    found = planner.solve(toy.problem(0.62), KEY, toy.SETTINGS, validate=asked)
    assert "another delta" not in found.validation.details()
    assert repr(found.looks) == "Looks(none declared; 1 look of other accounts)"
    again = looks_of_json(found.looks.to_json())
    for looks in (found.looks, again):  # also of a file
        tested = replace(found, looks=looks).choose(delta=0.001).test(SYSTEM, KEY, n=30)
        assert "LOOK(after 1 look of another delta, 0.05)" in tested.details()
    after = validated(found, KEY, toy.SETTINGS, asked)  # once more, after its plan
    told = [f"after 1 look of another delta, {delta}" for delta in (0.05, 0.001)]
    said = "; ".join(["2 of 2, which share one delta", *told])
    assert f"LOOK({said})" in after.validation.details()


def test_sets_are_nested_and_found_by_halving(answer):
    sets = nested_sets(
        query(toy.problem(0.62), toy.model()), KEY, np.random.default_rng(1), toy.SETTINGS, ASKED
    )
    p0, k = np.split(sets[-1].sample(np.random.default_rng(2), 800), [2], axis=1)
    inside = np.array([one.contains(p0, k) for one in sets])
    assert (np.diff(inside.astype(int), axis=0) >= 0).all() and 0 < inside[0].mean() < 1
    levels = level(sets, p0, k)
    assert np.array_equal(levels <= np.arange(len(sets))[:, None], inside)
    assert (level(sets, p0 + 9, k) == len(sets)).all()


def test_errors_on_the_way_are_scaled_by_a_part(answer):
    validated, whole = answer.validation.answer, answer.model.tube
    scale, tube = float(validated.model.claim.evidence["scale"]), validated.model.tube
    np.testing.assert_allclose(tube.final, scale * whole.final)
    np.testing.assert_allclose(tube.interval, 0.65 * scale * whole.interval)
    said = f"scaled by {scale}, on the way by 0.65 of that; runs may leave it"
    assert said in answer.validation.details()


def test_narrower_tubes_lie_about_what_most_runs_do():
    """Where errors are all on one side a part of them about their middle holds no usual run."""
    model = toy.model()
    corner = np.concatenate([np.eye(3), -np.eye(3)])
    at_end = faces(corner[None], 0.05 * corner.sum(axis=1)[None], np.full((1, 6), 0.05), True)
    sides = np.broadcast_to(np.eye(2), (1, toy.T, 1, 2, 2))
    during = faces(sides, *np.full((2, 1, toy.T, 1, 2), 0.05))
    skewed = model.replace(
        claim=stand_in(model.claim, fitted_tube(model.tube.edges, during, at_end))
    )
    about = KEY, np.random.default_rng(1), toy.SETTINGS, ASKED
    for one in nested_sets(query(toy.problem(0.7), skewed), *about):
        assert all(part.allow_none.all() for part in one.scene.model.tube.templates)


def test_runs_that_do_not_return_have_failed():
    def lost(key, k, s):
        p, q = toy.gusty(key, k, s)
        return jnp.where(k[0] > 0.55, jnp.nan, p), q

    found = toy.planner().solve(
        toy.problem(), KEY, toy.SETTINGS, validate=asked_of(source=plant(lost, toy.T))
    )
    assert found.validation.answer is None and found.validation.steps[0].failed > 30
    said = found.validation.details()
    assert "No set was validated" in said and "Allow more risk" in said


def test_runs_that_mostly_fail_are_said_to_be_unlike_those_of_the_model():
    none = Validation(None, (Step(1.0, 1000, 501),), ASKED)
    assert "compare units, the order of k, and the robot" in none.sentence
    assert "Allow more risk" not in none.sentence
    few = replace(none, steps=(Step(1.0, 1000, int(1000 * ASKED.risk) - 1),))
    assert few.sentence.endswith("Allow more risk. Or more tests (recordings): these are few.")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"risk": 0.001, "tests": 600}, "expected at least 2,302"),
        ({"risk": 0}, "risk: expected a probability"),
        ({"scales": (0.5, 1.0)}, "scales: expected falling positive numbers"),
        ({"scales": (np.inf, 1.0)}, "scales: expected falling positive numbers"),
        ({"scales": ()}, "scales: expected falling"),
        ({"way": 0}, "way: expected a positive number"),
        ({"way": float("nan")}, "way: expected a positive number"),
        ({"tests": 0}, "tests: expected"),
        ({"source": 3}, "expected"),
    ],
)
def test_bad_input_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        asked_of(**changes)


class Everywhere(Exact):
    """Draws from all plans, however few of them a search found."""

    def search(self, scene, key, settings):
        cover, no_plan = super().search(scene, key, settings)
        return cover._replace(within=None), no_plan


def test_of_a_set_without_volume_it_is_said_that_no_draw_met_it():
    start, flat = pj.box([0.05, 0.0], [0.0501, 1e-7]), pj.box([0.5, 0.3, -1.0], [0.5, 0.7, 2.0])
    for scene, method in (
        (toy.problem().replace(start=start), Everywhere()),  # corridors that none of 50,000 meets
        (toy.problem(), FirstProved()),  # a plan without corridors
        (toy.problem().replace(goal=flat), None),  # no end that lies in it for all errors
    ):
        settings = toy.SETTINGS.replace(method=method)
        found = toy.planner().solve(scene, KEY, settings, validate=asked_of())
        assert found.validation.answer is None and "No set was validated: no draw met" in (
            found.details() if found.status.found else found.validation.details()
        )
    assert found.share is None and "(V) No set was validated: no draw" in found.summary()


def test_of_a_place_that_a_search_found_the_share_is_told_as_one_of_all():
    scene = toy.problem().replace(start=pj.box([0.05, -1e-5], [0.0501, 1e-5]))
    found = toy.planner().solve(scene, KEY, toy.SETTINGS, validate=asked_of())
    said = "0.98, counting only those around what a search found. A plan drawn from them"
    assert said in found.validation.summary()


def test_what_has_no_law_is_refused():
    uncertain = toy.problem().replace(uncertainty=pj.Uncertainty(start=(0.01, 0.01)))
    with pytest.raises(InputError, match=r"without uncertainty .* without validate=, --validate"):
        toy.planner().solve(uncertain, KEY, toy.SETTINGS, validate=ASKED)
    other = plant(toy.gusty, toy.T + 1)
    with pytest.raises(InputError):
        toy.planner().solve(toy.problem(), KEY, toy.SETTINGS, validate=asked_of(source=other))
    # refused before any run is made: this one cannot run
    larger = replace(plant(None, toy.T), domain=pj.box([0, 0], [2, 2]))
    with pytest.raises(InputError, match="a system with the K of the model"):
        toy.planner().solve(toy.problem(), KEY, toy.SETTINGS, validate=asked_of(source=larger))


def test_a_set_keeps_its_promise_where_the_start_matters():
    """Runs are made from the origin: each is to succeed wherever the start may have put it."""
    scene = toy.problem()
    asked = asked_of(source=toy.Hill())
    planner = pj.Planner(toy.on_the_hill())
    found = planner.solve(scene, KEY, toy.SETTINGS, validate=asked).validation
    plans = found.answer.sample(jax.random.PRNGKey(4), 2000)
    keys = jax.random.split(jax.random.PRNGKey(9), len(plans))
    run = jax.vmap(toy.Hill().rollout_from)(keys, plans[:, 2:], plans[:, :2])
    path = plans[:, None, :2] + np.asarray(run.p)
    missed = (np.abs(path[:, -1] - 0.5) > 0.2).any(axis=1)
    assert (missed | (path[:, :, 1] + 0.05 >= 0.95).any(axis=1)).mean() <= 0.05
    assumed = found.answer.model.claim.assumptions
    assert "TRANSLATION_INVARIANCE(within 0.0303; 0.03" in found.details()
    assert "DISCRETE_TIME(h = 0.05 s)" in assumed and "INTERSAMPLE" not in str(assumed)


class Level(toy.Hill):
    """The gusty plant, which may begin anywhere."""

    def rollout_from(self, key, k, p0):
        s = jnp.linspace(0.0, 1.0, self.time.n_record + 1)
        return pj.Trajectory(*toy.gusty(key, k, s))


def test_a_start_that_matters_is_seen_where_the_claim_did_not_look():
    """Of a declared tube 0 of 7,598 runs had failed, and from the plan's start all did."""
    tube, time = toy.model().tube, toy.Hill.time
    claim = pj.learning.declared_claim(tube, "an analysis says so", toy.NET, time, system="plant")
    planner = pj.Planner(pj.learning.trajectory_model(toy.NET, claim))
    found = planner.solve(toy.problem(), KEY, toy.SETTINGS)
    plan, asked = found.choose(), asked_of(source=toy.Hill())
    refused = "do not depend on where they start by more than 1e-05; moving the start"
    with pytest.raises(InputError, match=refused):
        plan.test(toy.Hill(), KEY, n=30)
    with pytest.raises(InputError, match=refused):
        planner.solve(toy.problem(), KEY, toy.SETTINGS, validate=asked)
    assert plan.looks.taken == asked.looks.taken == 0
    for system, seen in ((Level(), "0 seen from 8 starts"), (SYSTEM, "not measured")):
        said = f"TRANSLATION_INVARIANCE(within 1e-05; {seen})"
        assert said in found.choose().test(system, KEY, n=30).tested.assumed
        asked = asked_of(source=system)
        sets = planner.solve(toy.problem(), KEY, toy.SETTINGS, validate=asked).validation
        assert said in sets.answer.model.claim.assumptions
        assert sets.answer.model.claim.premises  # its numbers are those of the evidence
        found = replace(found, looks=Looks())


class Hall(toy.Hill):
    """Level on one plant, a hill on the other."""

    def __init__(self, plant):
        self.plant = plant

    def rollout_from(self, key, k, p0):
        floor = Level if self.plant == "level" else toy.Hill
        return floor.rollout_from(self, key, k, p0)


class Low(toy.Hill):
    """A hill for the k of a model alone, of a plant that takes many more."""

    domain, plant = pj.box([0.0, 0.0], [1e3, 1.0]), "low"

    def rollout_from(self, key, k, p0):
        return super().rollout_from(key, k, jnp.where(k[0] <= 1.0, p0, 0.0))


def test_a_start_tried_on_one_plant_is_told_of_no_other(tmp_path):
    level, hill = Hall("level"), Hall("hill")
    options = {"eps": 0.1, "delta": 0.05, "bins": (1, 1), "profile_runs": 100, "quiet": True}
    train = collect(level, KEY, 100, quiet=True)
    claim = pj.learning.bound_error(toy.NET, level, KEY, train=train, **options)
    model = pj.learning.trajectory_model(toy.NET, claim)
    found = pj.Planner(model).solve(toy.problem(), KEY, toy.SETTINGS)
    plan, asked = found.choose(), asked_of(source=hill)
    for refused in (
        lambda: plan.test(hill, KEY, n=30),
        lambda: pj.Planner(model).solve(toy.problem(), KEY, toy.SETTINGS, validate=asked),
        lambda: run_study(hill, toy.problem(), Study(), tmp_path, 0, model),
        lambda: run_study(hill, toy.problem(), Study(), tmp_path, 0, learn_from=level),
    ):
        with pytest.raises(InputError, match="more than 1e-05; moving the start"):
            refused()
    assert plan.looks.taken == asked.looks.taken == 0 and not list(tmp_path.iterdir())
    for system, seen in ((level, "0 seen from 8 starts"), (SYSTEM, "not measured")):
        said = f"TRANSLATION_INVARIANCE(within 1e-05; {seen})"
        plan = replace(found, looks=Looks()).choose()
        assert said in plan.test(system, KEY, n=30).tested.assumed
    with pytest.raises(InputError, match="more than 1e-05; moving the start"):
        found.choose().test(Low(), KEY, n=30)  # tried where the model has its k


def test_tests_that_were_made_again_are_counted():
    asked = asked_of(source=toy.again(), tests=90, scales=(1.0,))
    found = toy.planner().solve(toy.problem(), KEY, toy.SETTINGS, validate=asked).validation
    assert "WORKERS_LOST(60, independent of the run)" in found.details()


def test_a_set_names_all_runs_behind_it(answer):
    claim = answer.validation.answer.model.claim
    tests = collect(SYSTEM, KEY, 10, Stage.SCENE, quiet=True)
    assert set(used_by(claim, tests)) == {"validation"}
    known = [entry for entry in ledger_of(claim) if entry[0] != "validation"]
    assert known == ledger_of(answer.model.claim) and known
