"""Plans that are executed roughly, and parameters that are given or unknown, against the truth in
exact arithmetic at corners and inside of the uncertainty.
"""

import json
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import jax
import numpy as np
import pytest
import toy_driven
import toy_query
from claim_files import load_claim, save_claim
from exact_oracle import exact_safe
from toy_models import anchored_plans, fold_model, random_network, toy_case
from uncertain import NEARLY, corners_and_inside

import parc_jax as pj
from parc_jax import checker
from parc_jax.app.plot.shapes import corners_of
from parc_jax.checker.claim import BOX, arithmetic_of, stated_premises, words_of
from parc_jax.common.errors import InputError
from parc_jax.learning.bound import claim as claim_module
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.labels import labels
from parc_jax.learning.network.relu import outputs
from parc_jax.planner import Planner
from parc_jax.problem.robust.bend import bend, bend_by_bin
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.robust.realisations import executions_of, words
from parc_jax.problem.robust.vertex_model import axis_of
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.proof.certificate.write import question_parts
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

KEY = jax.random.PRNGKey(0)
SMALL = Settings(samples=8, target=0.3, budget_s=300)
ROUGH = Uncertainty(start=0.01, k=[0.05, 0.02])


def verdicts_under(problem, model, p0, k):
    asked = query(problem, model).nominal()
    return verdicts(scene_of(asked.problem, asked.model), p0, k)


@pytest.mark.slow
def test_plans_withstand_rough_execution(rng):
    model, problem = toy_case(0, start=True)
    p0, k = anchored_plans(rng, model, 400)
    inside = (np.abs(k) < [0.95, 0.98]).all(axis=1)
    p0, k = p0[inside], k[inside]
    safe = verdicts_under(problem.replace(uncertainty=ROUGH), model, p0, k).safe
    before = verdicts(scene_of(problem, model), p0, k).safe
    assert (before | ~safe).all() and 10 < safe.sum() < before.sum()
    for i in np.flatnonzero(safe)[:6]:
        for _ in range(6):
            off = 0.01 * corners_and_inside(rng, 2)
            rough = np.array([0.05, 0.02]) * corners_and_inside(rng, 2)
            assert exact_safe(problem, model, p0[i] + off, k[i] + rough)


@pytest.mark.slow
def test_no_plan_under_copies_says_what_it_means():
    """The hull of the copies holds more than all executions. A proof that another test made too."""
    answer = toy_query.answer(wall=True)
    assert answer.status is pj.types.Status.NO_PLAN
    uncertainties = (
        (Uncertainty(k=[0.05, 0.02]), True),
        (Uncertainty(start=0.01), False),
        (Uncertainty(given={0: 0}), True),  # boxes for faces, and the wider one where bins meet
    )
    for uncertainty, said in uncertainties:
        nominal = query(
            toy_query.gap().replace(uncertainty=uncertainty), toy_query.planner().model
        ).nominal()
        known = nominal.uncertainty
        answer = replace(answer, absence=answer.absence._replace(uncertainty=known))
        assert ("a plan that this method cannot show to withstand" in answer.details()) == said
        assert f"Safe means here: safe for {known.words}." in answer.details()


@pytest.mark.night
def test_no_plan_in_space_under_obstacles_that_grow_says_what_it_means():
    """An obstacle and its error set are roofs across each other: what has the rows of both is
    larger than their sum, whose top is flat, and touches plans that withstand every error."""
    time = pj.learning.time_grid(dt=0.5, t_f=1.0, dt_record=0.5)
    rise = np.kron([[0.5], [1.0]], np.array([[0.0], [0.0], [0.001]]))
    net = pj.learning.relu_network([rise], [np.zeros(6)])
    tube = pj.learning.tube([[0.9, 1.1]], np.full((1, 2, 3), 1e-4), np.full((1, 3), 1e-4))
    lift = pj.learning.trajectory_model(net, pj.learning.declared_claim(tube, "a test", net, time))
    roof = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 1], [0, -1, 1], [0, 0, -1]], float)
    obstacle, error = (pj.hpolytope(a, [1, 1, 0, 0, 1]) for a in (roof, roof[:, [1, 0, 2]]))
    above = pj.box([-0.05, -0.05, 0.15], [0.05, 0.05, 0.25])
    start = pj.box([-0.02, -0.02, 0.18], [0.02, 0.02, 0.22])
    moved = [pj.hpolytope(roof, obstacle.b + roof @ e) for e in corners_of(error)]
    planner = Planner(lift)
    each = planner.solve(pj.reach_avoid(above, moved, 0.01, start=start), KEY, SMALL)
    assert each.status.found  # wherever the error moves it, convex as both are
    asked = pj.reach_avoid(above, [obstacle], 0.01, start=start)
    told = planner.solve(asked.replace(uncertainty=Uncertainty(obstacles=error)), KEY, SMALL)
    assert told.status is pj.types.Status.NO_PLAN
    assert "a plan that this method cannot show to withstand" in told.details()
    assert "none shown to withstand what is uncertain" in told.summary()
    here = asked.replace(start=None, uncertainty=Uncertainty(start=0.03))
    for at, said in ((np.array([0.0, 0.0, 0.2]), True), (None, False)):
        meaning = query(here, lift, at=at).nominal().uncertainty.meaning
        assert ("cannot show to withstand" in meaning) == said


def test_no_plan_under_uncertainty_says_what_it_is_about():
    """This question has safe plans; that none is safe is said of those that withstand the
    uncertainty."""
    asked = toy_query.gap().replace(uncertainty=Uncertainty(goal=0.249))
    answer = toy_query.planner().solve(asked, KEY, SMALL)
    none, summary = answer.absence, answer.summary()
    said = none.details()
    assert "Robust to" not in summary and summary.count("Safe means here: safe for every goal") == 1
    assert none.kind == "proved" and "Safe means here: safe for every goal moved by up to" in said
    assert "Safe means" not in toy_query.answer(wall=True).details()


@pytest.mark.night
def test_samples_are_boxes_of_doubt_of_the_question_as_it_was_asked():
    """The checker looks at every vertex of every cell in the box: another proof, without copies."""
    model, problem = toy_case(0, start=True)
    few = SMALL.replace(samples=40)
    answer = Planner(model).solve(problem.replace(uncertainty=ROUGH), KEY, few)
    assert answer.cover.proved and len(answer.certificates) and answer.corridors
    context = checker.Context(*question_parts(problem, model))
    room = {"room": {"p0": ["0.01"] * 2, "k": ["0.05", "0.02"]}}
    for part in answer.certificates[:4]:
        checker.check_doubt(context, part | room)
    wide = {"room": {"p0": ["0.01"] * 2, "k": ["0.9", "0.9"]}}
    with pytest.raises(checker.Rejected):
        checker.check_doubt(context, answer.certificates[0] | wide)
    plans = answer.samples
    rng = np.random.default_rng(0)
    rough = np.array([[0.05, 0.02] * corners_and_inside(rng, 2) for _ in plans])
    scene = scene_of(problem, model)
    assert verdicts(scene, plans[:, :2], plans[:, 2:] + rough).safe.all()
    assert "k0 off by up to 0.05, k1 off by up to 0.02" in answer.details()


@pytest.mark.night
def test_little_is_lost_to_the_copies(rng):
    """Of plans that are safe at a fine grid of executions most are shown to be."""
    model, problem = toy_case(0)
    p0, k = anchored_plans(rng, model, 300)
    inside = (np.abs(k) < 0.9).all(axis=1)
    p0, k = p0[inside], k[inside]
    uncertainty = Uncertainty(k=[0.05, 0.05])
    shown = verdicts_under(problem.replace(uncertainty=uncertainty), model, p0, k).safe
    every = np.ones(len(k), bool)
    scene = scene_of(problem, model)
    for x in np.linspace(-0.05, 0.05, 5):
        for y in np.linspace(-0.05, 0.05, 5):
            every &= verdicts(scene, p0, k + np.array([x, y])).safe
    assert (every | ~shown).all()
    assert shown.sum() >= 0.75 * every.sum() > 0


@pytest.mark.night
def test_rougher_execution_never_adds_plans(rng):
    """On these plans: the bins of two tolerances differ, so it is seen and not shown."""
    model, problem = toy_case(0, start=True)
    p0, k = anchored_plans(rng, model, 600)
    before = verdicts(scene_of(problem, model), p0, k).safe
    for size in (0.005, 0.02, 0.05):
        uncertainty = Uncertainty(start=0.01, k=[size, size])
        safe = verdicts_under(problem.replace(uncertainty=uncertainty), model, p0, k).safe
        assert (before | ~safe).all() and safe.sum() < before.sum()
        before = safe


@pytest.mark.parametrize("hidden", [(7,), (6, 5), (5, 4, 6)])
def test_what_a_mixture_misses_is_bounded(hidden, rng):
    net = random_network(rng, 3, hidden)
    for half in ([0.3, 0.1], [0.2, 0.0], [0.02, 0.03]):
        width = 2 * np.array(half)
        middle = rng.uniform(-0.5, 0.5, (8, 2))
        size = rng.uniform(0, 0.3, (8, 2)) + half
        bound = bend(net, middle - size, middle + size, width)
        corners = np.array([[i, j] for i in (0.0, 1.0) for j in (0.0, 1.0)])
        worst = np.zeros_like(bound)
        for _ in range(300):
            at = middle + rng.uniform(-1, 1, (8, 2)) * (size - half)
            share = rng.random((8, 2))
            weights = np.where(corners, share[:, None], 1 - share[:, None]).prod(axis=2)
            ends = (at - half)[:, None] + corners * width
            mixed = (weights[..., None] * outputs(net, ends.reshape(-1, 2)).reshape(8, 4, -1)).sum(
                1
            )
            worst = np.maximum(worst, np.abs(outputs(net, at - half + share * width) - mixed))
        assert (worst <= bound + 1e-12).all()
    assert bend(net, middle, middle, np.zeros(2)).max() < 1e-9


def test_a_bin_is_looked_at_in_parts(rng):
    """No less than what is missed anywhere in the bin, and no more than for the whole bin."""
    net = random_network(rng, 3, (6, 5))
    lo, hi, width = np.array([[-0.6, -0.5]]), np.array([[0.4, 0.7]]), np.array([0.1, 0.06])
    by_parts, whole = bend_by_bin(net, lo, hi, width), bend(net, lo, hi, width)
    assert (by_parts <= whole * (1 + 1e-9)).all() and by_parts.max() < 0.8 * whole.max()
    worst = np.zeros_like(whole)
    for _ in range(60):
        first = lo + rng.random((200, 2)) * (hi - lo - width)
        middle = outputs(net, first + width / 2)
        ends = [outputs(net, first + [x, y] * width) for x in (0, 1) for y in (0, 1)]
        worst = np.maximum(worst, np.abs(middle - sum(ends) / 4).max(axis=0))
    assert (worst <= by_parts + 1e-12).all()
    straight = np.array([0.1, 0.0])
    assert (bend_by_bin(net, lo, hi, straight) <= bend(net, lo, hi, straight) + 1e-9).all()


def test_one_kink_is_bounded_by_what_it_misses():
    net = fold_model(T=2).net
    bound = bend(net, np.array([[-0.1, -0.1]]), np.array([[0.1, 0.1]]), np.array([0.2, 0.2]))
    # |k_1| is at most 0.1 below the chord, the first axis is straight but has two neurons
    assert 0.1 <= bound[0, 3] < 0.101 and bound[0, 1] == pytest.approx(bound[0, 3] / 2)
    away = bend(net, np.array([[0.2, 0.2]]), np.array([[0.5, 0.5]]), np.array([0.2, 0.2]))
    assert away.max() == 0


@pytest.mark.parametrize(
    ("tolerance", "edges", "met"),
    [
        (0.0, [0.0, 1.0, 2.0, 3.0], [(0, 0), (1, 1), (2, 2)]),
        (0.25, [0.25, 0.75, 1.25, 1.75, 2.25, 2.75], [(0, 0), (0, 1), (1, 1), (1, 2), (2, 2)]),
        (0.625, [0.625, 1.375, 1.625, 2.375], [(0, 1), (0, 2), (1, 2)]),
        (1.25, [1.25, 1.75], [(0, 2)]),
    ],
)
def test_bins_of_plans_hold_the_bins_of_their_executions(tolerance, edges, met):
    axis = axis_of(np.array([0.0, 1.0, 2.0, 3.0]), -tolerance, tolerance, True)
    assert axis.edges.tolist() == edges and axis.met == met


def test_values_between_bins_meet_both():
    edges = np.array([0.0, 1.0, 2.0])
    assert axis_of(edges, 1.0, 1.0, False).met == [(0, 1)]
    assert axis_of(edges, 0.5, 0.9, False).met == [(0, 0)]
    assert len(axis_of(edges, -1e-30, 1e-30, True, 2e-30).met) < 400  # not one for each such width
    assert axis_of(edges, 0.5, 1.5, False).met == [(0, 1)]
    assert axis_of(edges, 0.5, 1.0, False).met == [(0, 1)]
    assert axis_of(edges, 0.0, 0.0, False).met == [(0, 0)]


def test_a_given_parameter_is_a_model_of_the_others(rng):
    model, problem = toy_case(0)
    asked = problem.replace(uncertainty=Uncertainty(given={"k1": 0.3}))
    found = query(asked, model).nominal()
    assert found.model.n_k == 1 and found.model.net.hidden == model.net.hidden
    assert found.model.points == model.points and found.problem.body == problem.body
    # both checkers print the value, which the file holds nowhere else
    assert found.model.claim.premises["not drawn"] == "k1 = 0.3 (measured)"
    p0, k = anchored_plans(rng, model, 300)
    k[:, 1] = 0.3
    whole = verdicts(scene_of(problem, model), p0, k)
    few = verdicts(scene_of(found.problem, found.model), p0, k[:, :1])
    assert (whole.safe == few.safe).mean() > 0.99 and whole.safe.any()
    assert np.abs(whole.path - few.path).max() < 1e-12


@pytest.fixture(scope="module")
def unknown():
    """Answer to a question with a rough and an unknown parameter."""
    model, problem = toy_case(0)
    uncertainty = Uncertainty(unknown={1: (0.1, 0.25)}, k={"k0": 0.02})
    return Planner(model).solve(problem.replace(uncertainty=uncertainty), KEY, SMALL)


@pytest.mark.night
def test_unknown_parameters_may_have_any_value_of_their_box(unknown, rng):
    model, problem = toy_case(0)
    assert unknown.cover.proved and len(unknown.samples) and unknown.samples.shape[1] == 3
    for plan in unknown.samples[:5]:
        for _ in range(5):
            k = [plan[2] + 0.02 * corners_and_inside(rng, 1)[0], rng.uniform(0.1, 0.25)]
            assert exact_safe(problem, model, plan[:2], k)
    drawn = unknown.sample(KEY, 40)
    p0, k = drawn[:, :2], np.stack([drawn[:, 2], rng.uniform(0.1, 0.25, 40)], axis=1)
    k[:, 0] += 0.02 * corners_and_inside(rng, 40)
    assert verdicts(scene_of(problem, model), p0, k).safe.all()
    assert "every k1 from 0.1 to 0.25 (unknown)" in unknown.details()
    assert "no statement" in unknown.details()


@pytest.mark.night
def test_answers_about_executions_can_be_kept(unknown, tmp_path):
    again = pj.load_answer(unknown.save(tmp_path / "answer.json"))
    assert (
        again.details().startswith(unknown.details()) and (again.samples == unknown.samples).all()
    )


@pytest.mark.slow
def test_a_measured_parameter_may_be_executed_roughly_too(rng):
    """The two uncertainties add, in the box that is solved and in the words; else a run at k1 that
    is off as was said may drive through a wall.
    """
    model, problem = toy_case(0)
    both = Uncertainty(k={"k0": 0.02, 1: 0.3}, given={"k1": (0.15, 0.25)})
    asked = query(problem.replace(uncertainty=both), model).nominal()
    answer = Planner(model).solve(problem.replace(uncertainty=both), KEY, SMALL)
    assert answer.cover.proved and len(answer.samples)
    for plan in answer.samples:
        for k1 in (0.25 + 0.3 * NEARLY, 0.15 - 0.3 * NEARLY, *rng.uniform(-0.15, 0.55, 3)):
            k0 = plan[2] + 0.02 * corners_and_inside(rng, 1)[0]
            assert exact_safe(problem, model, plan[:2], [k0, k1])
    said = "every k1 within ±0.3 of what is from 0.15 to 0.25 (measured, executed roughly)"
    assert said in answer.details() and "k0 off by up to 0.02" in answer.details()
    known = executions_of(both, model).parameters[1]
    low, high = (Fraction(x) for x in known.box)
    assert low <= Fraction(0.15) - Fraction(0.3) and high >= Fraction(0.25) + Fraction(0.3)
    given = problem.replace(uncertainty=Uncertainty(k={"k0": 0.02}, given={"k1": (low, high)}))
    assert query(given, model).nominal().model.net.hash == asked.model.net.hash


def test_the_words_name_all_of_it():
    """And are those of the executions that were solved."""
    named = labels(2, 0, 5, k=("speed [m/s]", "angle [rad]", "load [t]", "wind [m/s]", "grip"))
    K = pj.box([-9] * 5, [9] * 5)
    model = SimpleNamespace(labels=named, domain=K, n_k=5, rotation=())
    uncertainty = Uncertainty(
        start=[0.1, 0.2],
        heading=0.05,
        k={1: 0.5, "load": 0.25},
        goal=0.3,
        obstacles=pj.box([-0.1] * 2, [0.1] * 2),
        given={"load": 5, "wind": (1, 2), "grip": 0.123456789},
        unknown={0: (3, 4)},
    )
    text = words(uncertainty, executions_of(uncertainty, model), model, True)
    for part in (
        "every start within ±0.1, ±0.2 m",
        "every heading within ±0.05 rad of the one asked about;",
        "every execution with angle off by up to 0.5 rad;",
        "every goal moved by up to ±0.3 m;",
        "every obstacle moved by an error of its set, which lies within -0.1 to 0.1, -0.1 to 0.1 m",
        "every load within ±0.25 t of 5 t (measured, executed roughly)",
        "every wind from 1 to 2 m/s (measured)",
        "grip = 0.123456789 (measured)",
        "every speed from 3 to 4 m/s (unknown)",
    ):
        assert part in text


@pytest.mark.parametrize("value", [0.0, -1.0, 1.0, np.nextafter(0, 1), np.nextafter(-1, 0)])
def test_a_value_on_an_edge_has_plans_that_hold_for_all_bins_of_it(value, rng):
    """Between two bins, at both ends of K, and next to them: errors of the worse bin."""
    model, problem = toy_case(0)
    asked = problem.replace(uncertainty=Uncertainty(given={"k1": value}))
    p0, k = anchored_plans(rng, model, 300)
    k[:, 1] = value
    found = query(asked, model).nominal()
    safe = verdicts_under(asked, model, p0, k[:, :1]).safe
    assert safe.sum() > 10
    for i in np.flatnonzero(safe)[:5]:
        assert exact_safe(problem, model, p0[i], k[i])
    bins = model.tube.bins_of(k[:1])[0]
    assert len(bins) == (2 if value == 0 else 1)
    assert (found.model.tube.interval >= model.tube.interval[bins]).all()
    assert (found.model.tube.interval <= model.tube.interval[bins].max(axis=0) * 1.001).all()


REFUSED = {
    "model .k0, k1., each once; got 'load'": Uncertainty(unknown={"load": (0, 1)}),
    r"uncertainty of k1: expected a box within K, \[-1, 1\]; got \[0, 3\]": Uncertainty(
        unknown={"k1": (0, 3)}
    ),
    r"of k1: expected a box within K, \[-1, 1\]; got \[1.0000000000000002,": Uncertainty(
        given={1: np.nextafter(1, 2)}
    ),
    r"got \[0.5, 0.5\] .measured, executed within ±0.75.": Uncertainty(
        given={1: 0.5}, k={"k1": 0.75}
    ),
    "at least one parameter to choose": Uncertainty(given={0: 0, 1: 0}),
    "given or unknown; k1 is both": Uncertainty(given={"k1": 0}, unknown={1: (0, 1)}),
    "uncertainty k: expected .*, each once; got 1 and 'k1'": Uncertainty(k={1: 0.5, "k1": 0.001}),
    "uncertainty given: expected .*, each once; got": Uncertainty(given={"k0": 0.5, 0: 0.001}),
    "uncertainty k of k0: expected less than half of the range of K, 1; got 1": Uncertainty(
        k=[1.0, 0]
    ),
    "k: expected a list of 2 half widths, one per parameter .k0, k1., .* got 1": Uncertainty(
        k=[0.02]
    ),
    "one per parameter .k0, k1., or some by name; got 1": replace(Uncertainty(), k=(0.02,)),
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_what_does_not_fit_the_model_is_refused(sentence):
    model, problem = toy_case(0)
    with pytest.raises(InputError, match=sentence):
        query(problem.replace(uncertainty=REFUSED[sentence]), model).nominal()


@pytest.mark.soundness
def test_a_claim_of_a_part_of_K_says_of_what_its_runs_were_drawn(tmp_path):
    """Plans choose from less than K; its runs did not, so a share of the part is no probability."""
    model = toy_driven.model()
    scene = replace(toy_driven.problem(), uncertainty=pj.Uncertainty(k=(0.3, 0.2)))
    claim = query(scene, model).nominal().model.claim
    said = claim.details()
    assert "(k by a uniform draw on [0, 1] x [0, 1], of which K is a part; " in said
    assert "K = [0.3, 0.7] x [0.2, 0.8]" in said and "set of share s of K" not in said
    short = in_short(claim)  # no probability of runs with k in K alone
    assert "by a run, k by a uniform draw on [0, 1] x [0, 1], of which K is a part, conf" in short
    assert claim.law.is_even and model.claim.law.is_even
    law = replace(model.claim.law, parameters=(*model.claim.law.parameters, (BOX, "N")))
    about = words_of(model.claim.facts() | {"law": law.__dict__}, law.__dict__)[0]
    near = model.replace(claim=claim_module.derived(model.claim, law=law, quantifier=about))
    local = query(scene, near).nominal().model.claim.details()  # as of a model of a small box
    assert "K, a part of N, = [0.3, 0.7] x [0.2, 0.8]." in local and " N = " not in local
    seen = dict((name, value) for name, _, value in stated_premises(claim.facts()))
    assert seen["k"].startswith("by a uniform draw on [0, 1]") and seen["law"] in said
    data = json.loads(save_claim(claim, tmp_path / "claim.json").read_text())
    assert load_claim(tmp_path / "claim.json").details() == said
    silent = replace(claim, law=model.claim.law)
    with pytest.raises(checker.Rejected, match="the law of the claim is about another K"):
        stated_premises(silent.facts())
    with pytest.raises(pj.InputError, match=r"expected K = .* to be that of the law of its runs"):
        forged = silent.facts() | {"statement": said, "hash": claim_module._hash(silent)}
        (tmp_path / "claim.json").write_text(json.dumps(data | {"claim": forged}))
        load_claim(tmp_path / "claim.json")


@pytest.mark.soundness
def test_a_claim_per_bin_stays_one_of_the_bins_that_were_counted(tmp_path):
    """In a finer bin of the question nobody counted: runs may leave there at any rate."""
    model = toy_driven.model(claims=("bins",))
    assert "in each claimed bin of K" in model.claim.details()
    assert "of 1 block in which runs were counted" in model.claim.details()
    scene = replace(toy_driven.problem(), uncertainty=pj.Uncertainty(k=(0.01, 0.0)))
    claim = query(scene, model).nominal().model.claim
    said = claim.details()
    assert claim.tube.n_bins > 9 and "in each claimed block of bins of K" in said
    assert "of 1 block of the model's claim, of whose tube this one is made" in said
    assert "how probable this bin is" in str(claim.risk(share=0.01, bin=0))
    assert load_claim(save_claim(claim, tmp_path / "claim.json")).details() == said
    known = arithmetic_of(claim.facts(), claim.tube.n_bins)["says"]
    assert known.startswith(f"in 1 block with {claim.tube.n_bins} of {claim.tube.n_bins} bins ")


def test_of_the_tube_of_a_given_value_no_probability_is_said():
    """Nobody drew such runs: all of them may leave it, though few of all K leave theirs."""
    scene = replace(toy_driven.problem(), uncertainty=pj.Uncertainty(given={0: 0.5}))
    claim = query(scene, toy_driven.model()).nominal().model.claim
    said = claim.details()
    assert "leaves the tube of the model's claim about all its parameters at any time" in said
    assert "Of this tube, which is of runs with k0 = 0.5 (measured), which nobody drew" in said
    assert in_short(claim) == "of runs that nobody drew, not shown"


@pytest.mark.parametrize("known", [{"k": [0.2, 0.0]}, {"given": {0: 0.5}}])
def test_the_model_of_an_answer_under_uncertainty_is_not_asked_again(known, tmp_path):
    """Asked of it without, a plan's risk was told of its small K, as if runs were drawn there."""
    problem, sure = toy_driven.problem(), Uncertainty(goal=0.01)
    nominal = query(problem.replace(uncertainty=Uncertainty(**known)), toy_driven.model()).nominal()
    nominal.model.save(tmp_path / "model.npz")
    planner = Planner(pj.load(tmp_path / "model.npz"))
    for again in (nominal.problem, nominal.problem.replace(uncertainty=sure)):
        for ask in (planner.prepare, lambda one: planner.solve_batch([one], KEY)):
            with pytest.raises(InputError, match="expected the learned one; got that of an answer"):
                ask(again)
    # of start and goal alone the model is the learned one, with a wider tube
    moved = query(problem.replace(uncertainty=Uncertainty(start=0.01)), toy_driven.model())
    assert Planner(moved.nominal().model).prepare(problem)


@pytest.mark.slow
def test_a_risk_says_that_errors_of_execution_must_not_depend_on_the_plan():
    """Else an execution that snaps to one value has any density there."""
    rough = toy_driven.problem().replace(uncertainty=Uncertainty(k=[0.01, 0.01]))
    said = toy_driven.planner().solve(rough, KEY, toy_driven.SETTINGS)
    assert "Risk: a plan drawn by `sample`" in said.details()
    for text in (said.details(), said.summary()):
        assert "Errors of its execution, if any, must not depend on the plan." in text
    assert "Errors of its" not in toy_driven.answer().details()
