"""What is measured at the start of a manoeuvre: declared by a system, named by claims, files and
answers, and asked of every question.
"""

import json
import re
from dataclasses import replace

import jax
import numpy as np
import pytest
from claim_files import load_claim, save_claim
from toy_models import assumed, line_model, told
from toy_running import Cart, H, cart_model, settled_network

import parc_jax as pj
from parc_jax.app import live_page
from parc_jax.app.files.answer_file import load_answer
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.tube import zero_tube
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.files import save_rollouts
from parc_jax.learning.runs.law import given_of, subject_of
from parc_jax.learning.runs.loaders import load_rollouts
from parc_jax.learning.system import time_grid
from parc_jax.problem.robust.nominal import query
from parc_jax.safe_set.verdict.outline import require_fit, require_same
from parc_jax.safe_set.verdict.scene import lowered
from sims.asv.what_helps import safe_volume

ENTRY = "HIDDEN_START(given v0)"
KEY = jax.random.key(0)
GOAL = pj.box([0.2, -0.3], [0.9, 0.3])
NOBODY = "v0 is measured at the start, and drawn by nobody"
SCENE = pj.reach_avoid(GOAL, [pj.box([-0.2, 0.4], [1.2, 0.6])], 0.1)
MEASURED = SCENE.replace(uncertainty=pj.Uncertainty(given={"v0": 0.5}))
ROUGHLY = SCENE.replace(uncertainty=pj.Uncertainty(given={"v0": (0.49, 0.51)}))


@pytest.fixture(scope="module")
def claim():
    asked = dict(eps=0.1, delta=0.1, bins=(1, 1), profile_runs=50, quiet=True)
    return pj.learning.bound_error(settled_network(), Cart(), KEY, **asked)


def test_a_claim_lists_it_and_keeps_it_in_files(claim, tmp_path):
    assert ENTRY in claim.assumptions and ENTRY in claim.details()
    back = load_claim(save_claim(claim, tmp_path / "claim.json"))
    assert back.assumptions == claim.assumptions and back.hash == claim.hash
    model = pj.learning.trajectory_model(settled_network(), claim)
    model.save(tmp_path / "model.npz")
    assert pj.load(tmp_path / "model.npz").given == model.given == (0,)


@pytest.mark.slow
def test_an_answer_names_it_in_words_and_in_its_file(claim, tmp_path):
    model = pj.learning.trajectory_model(settled_network(), claim)
    settings = pj.Settings(samples=3, target=0.3)
    answer = pj.Planner(model).solve(MEASURED, KEY, settings)
    said = answer.details()
    assert ENTRY in said and "v0 = 0.5 m/s (measured)" in said
    path = answer.save(tmp_path / "answer.json")
    told = json.loads(path.read_text())["claim"]
    assert ENTRY in told["assumptions"] and ENTRY in told["statement"]
    assert ENTRY in load_answer(path).details()


@pytest.mark.night
def test_plans_are_replayed_from_what_was_measured(claim):
    """And a study compares and replays them."""
    model = pj.learning.trajectory_model(settled_network(), claim)
    settings = pj.Settings(samples=20, samples_only=True)
    answer = pj.Planner(model).solve(MEASURED, KEY, settings)
    seen = pj.replay(Cart(), answer.scene, answer.samples, KEY)
    np.testing.assert_allclose(np.diff(seen.path[:, :2, 0], axis=1), 0.5 * H, rtol=1e-9)
    assert not (seen.inside & seen.failed).any() and seen.inside.mean() > 0.8
    shares = safe_volume(model, MEASURED, KEY)
    assert 0 < shares["safe"] <= shares["reaching"]
    with pytest.raises(InputError, match=r"agree; .*K is .*points is"):
        pj.replay(Cart(), lowered(query(ROUGHLY, model).nominal()), answer.samples, KEY)


def test_runs_keep_it_in_files_and_only_those_that_have_it_name_it(tmp_path):
    runs = collect(Cart(), KEY, 30, quiet=True)
    assert runs.given == (0,)
    profile = zero_tube([(0.0, 1.0)] * 2, 4, 2, 2).with_halves(
        *[np.ones((1, 4, 2)), np.ones((1, 2))]
    )
    for given, named in ((runs.given, True), ((), False)):
        claim = calibrate(settled_network(), runs.replace(given=given), profile, eps=0.2, delta=0.2)
        assert (ENTRY in claim.assumptions) is named
    assert load_rollouts(save_rollouts(tmp_path / "runs.npz", runs)).given == (0,)
    p = runs.p.reshape(30, -1, 2)
    np.savez(tmp_path / "log.npz", k=runs.k, p=p)
    log = load_rollouts(tmp_path / "log.npz", time_grid(0.25, 1.0, 0.05), given=("k0",))
    assert log.given == (0,) and log.subject.given == (0,)
    with pytest.raises(
        InputError, match="expected no given: a file of save_rollouts knows its own"
    ):
        load_rollouts(tmp_path / "runs.npz", given=("v0",))


def test_an_update_from_logs_keeps_it(claim, tmp_path):
    """A log does not say what was measured: afterwards plans chose where the robot was going."""
    logs = []
    for seed in (5, 6, 7):
        runs = collect(Cart(), jax.random.key(seed), 50, quiet=True)
        np.savez(tmp_path / f"{seed}.npz", k=runs.k, p=runs.p)
        about = {"labels": {"k": Cart.k_labels}, "given": ("v",) if seed == 7 else ()}
        logs.append(load_rollouts(tmp_path / f"{seed}.npz", Cart.time, Cart.domain, **about))
    net, new = pj.learning.update(claim, settled_network(), *logs[:2])
    assert ENTRY in new.assumptions and pj.learning.trajectory_model(net, new).given == (0,)
    order = "ORDER_OF_K(that of the claim before; not all have names)"
    bare = [log.replace(labels=log.labels._replace(k=("k0", "k1"))) for log in logs[:2]]
    _, unnamed = pj.learning.update(claim, settled_network(), *bare)
    assert order in unnamed.assumptions and order not in new.assumptions
    assert order in unnamed.details()
    with pytest.raises(InputError, match="agree; given is 0, beside 1"):
        pj.learning.update(claim, settled_network(), *logs[1:])
    watch = pj.monitor(claim, settled_network(), share=1.0)
    with pytest.raises(InputError, match="agree; given is 0, beside 1"):
        watch.observe(logs[2])  # which says itself what was measured
    np.savez(tmp_path / "other.npz", k=runs.k[:, :1], p=runs.p)
    other = load_rollouts(tmp_path / "other.npz", Cart.time, pj.box([0], [1]))
    with pytest.raises(InputError, match=r"runs of the robot of the claim: .* that agree"):
        pj.learning.update(claim, settled_network(), logs[0], other)
    with pytest.raises(InputError, match=r"those of training: .*agree; given is none, beside 1"):
        pj.learning.bound_error(settled_network(), logs[1], None, train=logs[2], eps=0.1, delta=0.1)


def test_a_question_says_what_is_measured_or_is_refused():
    model = cart_model()
    sentence = "expected v0, which cart measures at the start; got no value"
    with pytest.raises(InputError, match=r"Say Uncertainty\(given=\{'v0': ") as advice:
        query(SCENE, model).nominal()
    other = told(line_model(), given=(1,))  # of another K than that of the cart
    with pytest.raises(InputError, match=r"Say Uncertainty\(given=\{'k1': 0\}\)"):
        query(pj.reach_avoid(pj.box([-1.0] * 3, [1.0] * 3), [], 0.05), other).nominal()
    value = float(re.search(r"'v0': (.*?)\}", str(advice.value))[1])
    asked = SCENE.replace(uncertainty=pj.Uncertainty(given={"v0": value}))
    assert query(asked, model).nominal()  # what is advised is taken
    for uncertainty in (None, pj.Uncertainty(start=0.01), pj.Uncertainty(given={"v": 0.5})):
        with pytest.raises(InputError, match=sentence):
            query(SCENE.replace(uncertainty=uncertainty), model).nominal()
    with pytest.raises(InputError, match=sentence):
        pj.Planner(model).solve_batch([MEASURED, SCENE], KEY)
    with pytest.raises(InputError, match=sentence):
        require_fit(SCENE, subject_of(Cart()))
    corners = np.array([[GOAL.lo] * 2, [GOAL.hi] * 2])
    with pytest.raises(InputError, match=sentence):
        pj.Planner(model).solve_batch(
            pj.problem.box_scenes(model, *corners, *corners + 2, 0.1), KEY
        )
    require_fit(MEASURED, subject_of(Cart()))
    for uncertainty in (
        pj.Uncertainty(given={0: (0.4, 0.6)}),
        pj.Uncertainty(unknown={"v0": (0.4, 0.6)}),
    ):
        assert query(SCENE.replace(uncertainty=uncertainty), model).nominal().model.n_k == 1


@pytest.mark.slow
def test_what_is_free_is_chosen_with_the_rest():
    model = cart_model()
    free = SCENE.replace(uncertainty=pj.Uncertainty(given={"v0": "free"}))
    assert free.uncertainty.is_nothing and query(free, model).nominal().model is model
    rough = SCENE.replace(uncertainty=pj.Uncertainty(given={"v0": "free"}, k={"v0": 0.01}))
    under = query(rough, model).nominal()
    assert under.model.n_k == 2 and under.model.given == (0,)
    assert under.uncertainty.words == "every execution with v0 off by up to 0.01 m/s"


SLOW = [pytest.param(more, marks=pytest.mark.slow) for more in ({}, {"heading": 0.01})]


@pytest.mark.parametrize("more", [{"k": {"v": 0.01}}, *SLOW], ids=str)
def test_what_is_measured_and_free_is_drawn_by_nobody_also_in_a_file(claim, more, tmp_path):
    """Also where the question copies the model, whose k it then is of."""
    model = told(pj.learning.trajectory_model(settled_network(), claim), rotation=())
    free = SCENE.replace(uncertainty=pj.Uncertainty(given={"v0": "free"}, **more))
    answer = pj.Planner(model).solve(free, KEY, pj.Settings(samples=3, target=0.1))
    again = load_answer(answer.save(tmp_path / "answer.json"))
    for one in (answer, again):
        assert one.status.found and one.model.given == (0,) and one.share_of_k() == 0
        assert one.risk().reason == NOBODY and NOBODY in one.summary()
        header = pj.exchange.write_c(one, tmp_path / "measured.h").read_text()
        said = "Measured at the start, and not to be chosen: v0."
        assert said in one.summary() and said in one.details() and header.count(said) == 1
        assert "measured_N_MEASURED 1" in header
    seen = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(live_page, "Page", lambda page, port: seen.append(page))
        pj.figures.live(answer if more else again, wait=False)
    assert seen[0].scene().model.given == (0,)


def test_a_copy_in_an_older_file_is_told_by_its_ledger(claim):
    """Which named what is measured, where the copy itself did not."""
    older = derived(claim, subject=replace(claim.subject, given=()))
    model = pj.learning.trajectory_model(settled_network(), older)
    assert model.given == (0,)
    others = model.with_labels({"k": ("u [m/s]", "load [m/s]")})
    assert others.given == (0,) and "HIDDEN_START(given u)" in others.claim.assumptions
    assert ENTRY not in others.claim.details() and others.claim.subject.given == (0,)
    lost = {"subject": replace(others.claim.subject, given=()), "assumptions": claim.assumptions}
    kept = model.replace(claim=derived(others.claim, **lost)).with_labels({})
    assert kept.given == () and ENTRY in kept.claim.assumptions
    two = ("IID", "HIDDEN_START(given load and u)", "FRESH(and so on)")
    older = {"subject": replace(others.claim.subject, given=()), "assumptions": two}
    assert others.replace(claim=derived(others.claim, **older)).given == (0, 1)


EDGES = [
    (0.0, 0.02),
    (0.25, 0.02),
    (0.5, 0.05),
    (1.0, 0.05),
    ((0.2, 0.3), 0.02),
    ((0.45, 0.5), 0.05),
    ((0.3, 0.7), 0.05),
]


@pytest.mark.parametrize(("value", "width"), EDGES)
def test_a_value_on_an_edge_and_a_box_across_one_have_the_wider_tube(value, width):
    asked = SCENE.replace(uncertainty=pj.Uncertainty(given={"v0 [m/s]": value}))
    found = query(asked, cart_model(widths=(0.02, 0.05))).nominal().model.tube
    np.testing.assert_allclose(found.interval, width, rtol=1e-8)


def test_two_values_on_edges_have_the_widest_of_four_bins():
    net = pj.learning.relu_network([np.ones((8, 3))], [np.zeros(8)])
    widths = np.array([0.01, 0.02, 0.04, 0.03]).reshape(4, 1, 1) * np.ones((4, 4, 2))
    edges = [(0.0, 0.5, 1.0)] * 2 + [(0.0, 1.0)]
    claim = assumed(net, pj.learning.tube(edges, widths, widths[:, 0]))
    model = told(pj.learning.trajectory_model(net, claim), given=(0, 1))
    for given, width in (
        ((0.5, 0.5), 0.04),
        ((0.5, 0.0), 0.04),
        ((0.0, 0.5), 0.02),
        ((1, 1), 0.03),
    ):
        asked = SCENE.replace(uncertainty=pj.Uncertainty(given=dict(enumerate(given))))
        np.testing.assert_allclose(
            query(asked, model).nominal().model.tube.interval, width, rtol=1e-8
        )


@pytest.mark.parametrize("words", ["v9", (2,), ("v0", 0), ("v0", "v"), (0.5,), 7, (True,)])
def test_what_is_no_parameter_is_refused_before_a_run(words):
    odd = type("Odd", (Cart,), {"given": words})()
    with pytest.raises(InputError, match="cart: expected given, a tuple of parameters"):
        collect(odd, KEY, 4, quiet=True)


def test_parameters_are_named_by_label_name_or_number():
    for words in (("v0 [m/s]",), ("v0",), (0,), ["v0"], "v0"):
        assert given_of(type("Named", (Cart,), {"given": words})()) == (0,)


def test_a_system_that_measures_something_else_is_another_one():
    require_same(Cart(), cart_model())
    other = type("Other", (Cart,), {"given": ("v",)})()
    with pytest.raises(InputError, match="given is 0, beside 1"):
        require_same(other, cart_model())


def test_a_claim_of_no_system_does_not_forget_what_the_tested_one_measures():
    tube, asked = cart_model().tube, ("the data sheet", settled_network(), Cart.time)
    for given in ((), ("v0",)):
        claim = pj.learning.declared_claim(tube, *asked, given=given, labels={"k": Cart.k_labels})
        model = pj.learning.trajectory_model(settled_network(), claim)
        if given:
            require_same(Cart(), model)
        else:
            with pytest.raises(InputError, match="given is none, beside 0"):
                require_same(Cart(), model)


@pytest.mark.slow
def test_a_box_of_k_around_a_plan_is_drawn_from_by_nobody(claim):
    """Neither under the tube over K nor under a local one: its v0 is what it is."""
    free = SCENE.replace(uncertainty=pj.Uncertainty(given={"v0": "free"}))
    planner = pj.Planner(pj.learning.trajectory_model(settled_network(), claim))
    plan = planner.solve(free, KEY, pj.Settings(samples=3, target=0.3)).choose()
    small = pj.drive.Local(share=0.01, eps=0.1, rollouts=60, profile_runs=60, hidden=())
    near = plan.localise(Cart(), KEY, small).near
    assert near.proved is not None and plan.safe_box is not None
    for risk in (plan.risk(), near.risk()):
        assert "drawn by nobody" in str(risk)
