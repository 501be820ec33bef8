"""Corridors and polytopes: every member passes the point test, the dense oracle and the exact
checker; nothing is lost between floats and proofs; coverage, volumes and draws are what they say.
"""

import json

import jax
import numpy as np
import pytest
from dense_oracle import DEPTH, knots_of, row_room, smallest_distance
from rows_of_sets import set_rows
from scipy.spatial import HalfspaceIntersection
from scipy.stats import beta, binom
from toy_models import model_of, toy_case

from parc_jax import checker
from parc_jax.answer.answer import answer_data
from parc_jax.checker.exact import dot
from parc_jax.common.status import Status
from parc_jax.learning.network.relu import relu_network
from parc_jax.planner import Planner
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import (
    network_part,
    polytope_part,
    problem_part,
    sample_part,
    tube_part,
)
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import anchor, verdicts
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = pytest.mark.soundness

SCENES = (2, 4, 8)


@pytest.fixture(scope="module")
def answers():
    """Exact-proved answers of a few scenes of one compiled shape."""
    out = {}
    for number in SCENES:
        model, problem = toy_case(number)
        out[number] = Planner(model).solve(
            problem,
            jax.random.key(number),
            Settings(target=0.1, samples=30, budget_s=300),
        )
    return out


@pytest.fixture(scope="module")
def cuts(answers):
    """The polytopes of these answers, around enough plans that nearly all is covered."""
    return {n: one.polytopes(jax.random.key(50 + n), 4000) for n, one in answers.items()}


def context_of(answer):
    return checker.Context(
        problem_part(answer.problem, answer.model),
        network_part(answer.model.net),
        tube_part(answer.model.tube),
    )


def certificates(answer, p0, k):
    e = verdicts(answer.scene, p0, k)
    given = answer.scene, answer.model.tube
    return [sample_part(*given, p0[i], k[i], e.path[i]) for i in range(len(k))]


def members(cut, rng, n):
    """n points (n, 4) of the polytopes as their rows say, by our own vertices; a tenth of them
    vertices themselves.
    """
    out = []
    for outer, polytope in zip(cut.sets, cut.all, strict=True):
        inner = np.concatenate([polytope.p0, polytope.k])
        vertices = HalfspaceIntersection(np.column_stack([outer.A, -outer.b]), inner).intersections
        per_polytope = n // len(cut) + 1
        weights = rng.dirichlet(np.full(len(vertices), 0.1), per_polytope)
        x = weights @ vertices
        x[: per_polytope // 10] = vertices[rng.integers(len(vertices), size=per_polytope // 10)]
        out.append(x + 1e-9 * (inner - x))  # off the very boundary, by less than the oracle sees
    return np.concatenate(out)


def oracle_accepts(answer, p0, k):
    """Nothing is touched deeper than the oracle can tell, goal and start are met: (n,) bool."""
    knots, q = knots_of(answer.model.net, answer.model.time.n_steps, p0, k)
    bins = answer.model.tube.bin_of(k)
    gap, _ = smallest_distance(answer.problem, knots, answer.model.tube.interval[bins], n_points=51)
    return (gap > -DEPTH) & (
        row_room(answer.problem, knots, q, answer.model.tube.final[bins]) > -DEPTH
    )


def test_answers_are_exact_proved_and_nothing_was_refused(answers, cuts):
    for number, answer in answers.items():
        assert answer.status is Status.PROVED and answer.cover.refused == 0
        cut = cuts[number]
        assert cut.proved and cut.refused == 0
        assert len(cut) > 3 and len(answer.samples) == 30


def test_ten_thousand_members_pass_the_point_test_and_the_oracle(answers, cuts, rng):
    for number, answer in answers.items():
        x = members(cuts[number], rng, 10_000 // len(SCENES))
        p0, k = x[:, :2], x[:, 2:]
        assert verdicts(answer.scene, p0, k).safe.all()
        assert cuts[number].contains(p0, k).all()
        assert answer.contains(p0, k).mean() > 0.9  # corridors are tested in float32 first
        assert oracle_accepts(answer, p0[::4], k[::4]).all()


def test_members_pass_the_exact_sample_check(answers, cuts, rng):
    for number, answer in answers.items():
        x = members(cuts[number], rng, 60)[:60]
        check = context_of(answer).check_sample
        deep = (
            verdicts(answer.scene, x[:, :2], x[:, 2:]).clearance > 1e-6
        )  # short fractions separate
        assert deep.sum() > 30
        for part in certificates(answer, x[deep, :2], x[deep, 2:]):
            check(part)


def test_vertices_of_the_float_polytopes_satisfy_the_exact_rows(answers, cuts):
    for number, answer in answers.items():
        context, cut = context_of(answer), cuts[number]
        for outer, polytope in list(zip(cut.sets, cut.all, strict=True))[:12]:
            inner = np.concatenate([polytope.p0, polytope.k])
            vertices = HalfspaceIntersection(
                np.column_stack([outer.A, -outer.b]), inner
            ).intersections
            rows = set_rows(context, polytope_part(polytope))
            for x in vertices:
                point, scale = checker.integers([checker.number(float(v).hex()) for v in x])
                worst = min(
                    (dot(a, point) + c * scale) / scale / max(sum(map(abs, a)), 1)
                    for _, strict, a, c in rows
                    if any(a)
                )
                assert worst > -1e-12  # vertices are rounded by our geometry


def with_tube(model, interval, final):
    return model_of(model.net, model.domain, interval, final, model.tube.edges)


def with_output(model, change):
    W, b = list(model.net.weights), list(model.net.biases)
    W[-1], b[-1] = change(W[-1]), change(b[-1])
    return model_of(
        relu_network(W, b), model.domain, model.tube.interval, model.tube.final, model.tube.edges
    )


def space_major(rows):
    return np.concatenate(
        [rows[:8].reshape(4, 2, -1).swapaxes(0, 1).reshape(rows[:8].shape), rows[8:]]
    )


def first_bias_lost(model):
    net = relu_network(model.net.weights, [model.net.biases[0] * 0, *model.net.biases[1:]])
    return model_of(net, model.domain, model.tube.interval, model.tube.final, model.tube.edges)


def rounded_weights(model):
    net = relu_network(
        [w.astype(np.float16).astype(float) for w in model.net.weights], model.net.biases
    )
    return model_of(net, model.domain, model.tube.interval, model.tube.final, model.tube.edges)


WRONG = {  # what a broken engine would have solved instead: (model, problem) -> (model, problem)
    "no tube": lambda m, p: (with_tube(m, m.tube.interval * 0, m.tube.final), p),
    "error of the next interval": lambda m, p: (
        with_tube(m, np.roll(m.tube.interval, -1, axis=1), m.tube.final),
        p,
    ),
    "tube of the other bin": lambda m, p: (
        with_tube(m, m.tube.interval[::-1], m.tube.final[::-1]),
        p,
    ),
    "goal not shrunk": lambda m, p: (with_tube(m, m.tube.interval, m.tube.final * 0), p),
    "disc dropped": lambda m, p: (m, p.replace(body=p.body.replace(radius=0.0))),
    "obstacle forgotten at the end": lambda m, p: (m, p.replace(spans=((0, 2), (0, 2)))),
    "obstacles mirrored": lambda m, p: (
        m,
        p.replace(obstacles=tuple(o.replace(A=-o.A) for o in p.obstacles), spans=p.spans),
    ),
    "outputs read space-major": lambda m, p: (with_output(m, space_major), p),
    "a bias lost": lambda m, p: (first_bias_lost(m), p),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", WRONG)
def test_what_a_broken_engine_finds_is_refused_unless_it_is_true(fault):
    wrong_any = 0
    for number in (5, 8):
        model, problem = toy_case(number)
        model = with_tube(model, model.tube.interval * 3, model.tube.final * 3)
        answer = Planner(WRONG[fault](model, problem)[0]).solve(
            WRONG[fault](model, problem)[1],
            jax.random.key(0),
            Settings(target=0.5, samples=150, proof=False, budget_s=300),
        )
        samples, corridors, _ = prove(problem, model, answer.certificates, answer.corridors)
        assert not (samples.all() and corridors.all())
        x = answer.samples
        right = verdicts(scene_of(problem, model), x[:, :2], x[:, 2:])
        assert not samples[(right.clearance < -1e-6) | (right.goal < -1e-6)].any()
        wrong_any += (~right.safe).sum()
    assert wrong_any > 0


def test_low_precision_in_the_search_is_found_out_or_harmless():
    model, problem = toy_case(8)
    answer = Planner(rounded_weights(model)).solve(
        problem,
        jax.random.key(0),
        Settings(target=0.5, samples=150, proof=False, budget_s=300),
    )
    samples, *_ = prove(problem, model, answer.certificates)
    x = answer.samples
    right = verdicts(scene_of(problem, model), x[:, :2], x[:, 2:])
    assert not samples[right.clearance < -1e-6].any() and samples.mean() > 0.9


def test_samples_are_safe_and_proved_one_by_one(answers):
    for answer in answers.values():
        p0, k = answer.samples[:, :2], answer.samples[:, 2:]
        assert verdicts(answer.scene, p0, k).safe.all()
        assert oracle_accepts(answer, p0, k).all()
        check = context_of(answer).check_sample
        for part, x in zip(answer.certificates, answer.samples, strict=True):
            check(part)
            assert [float.fromhex(v) for v in part["p0"] + part["k"]] == x.tolist()


def test_same_key_same_answer_other_key_other_answer():
    model, problem = toy_case(4)
    one, two, three = (
        Planner(model).solve(
            problem,
            jax.random.key(s),
            Settings(target=0.2, samples=10, proof=False, budget_s=300),
        )
        for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.samples, two.samples)
    assert not np.array_equal(one.samples, three.samples)
    assert json.dumps(answer_data(one)) == json.dumps(answer_data(two))


def test_volume_interval_and_share_hold_the_truth(answers, cuts, rng):
    for number, answer in answers.items():
        seen = draw(answer.scene, rng, 60_000)
        whole = seen.volume
        share = len(seen.safe.k) / seen.drawn
        _, low, high = answer.cover.safe_volume(0.9999)
        error = 4 * np.sqrt(share / seen.drawn) * whole
        assert low - error < share * whole < high + error
        kept = len(seen.safe.k) / seen.reaching
        said = answer.share
        assert said.share / said.reaching == pytest.approx(kept, abs=0.05)
        inside = cuts[number].contains(seen.safe.p0, seen.safe.k).mean() * share * whole
        volumes = cuts[number].volumes
        assert volumes.max() < inside + error and volumes.sum() > inside - error


def honest_looks(repeats, confidence, target, fresh):
    """How many of `repeats` answers cover less of a fresh draw than they state."""
    model, problem = toy_case(4)
    wrong = 0
    for seed in range(repeats):
        answer = Planner(model).solve(
            problem,
            jax.random.key(100 + seed),
            Settings(
                target=target,
                confidence=confidence,
                samples=1,
                proof=False,
                budget_s=300,
            ),
        )
        seen = draw(answer.scene, np.random.default_rng(seed), fresh).safe
        inside = int(answer.contains(seen.p0, seen.k).sum())
        # a failure only when fresh points could not come from a cover as good as stated
        wrong += beta.ppf(0.999, inside + 1, len(seen.k) - inside) < answer.coverage.at_least
    return wrong


def test_coverage_statement_is_honest():
    wrong = honest_looks(repeats=6, confidence=0.9, target=0.15, fresh=20_000)
    assert wrong <= binom.ppf(0.9999, 6, 0.1)


@pytest.mark.night
def test_coverage_statement_is_honest_over_many_repeats():
    wrong = honest_looks(repeats=200, confidence=0.8, target=0.08, fresh=60_000)
    assert wrong <= binom.ppf(0.9999, 200, 0.2)


def test_share_of_k_is_not_too_large(answers, rng):
    for answer in answers.values():
        k = rng.uniform(-1, 1, (800, 2))
        z = np.stack(np.meshgrid(*[np.linspace(-0.49, 0.49, 15)] * 2), axis=-1).reshape(-1, 2)
        starts, ks = np.tile(z, (len(k), 1)), k.repeat(len(z), axis=0)
        p0, _ = anchor(answer.scene, starts, ks)
        some = answer.contains(p0, ks).reshape(len(k), -1).any(axis=1)
        assert 0 < answer.share_of_k() <= some.mean() + 4 * np.sqrt(0.25 / len(k))


def test_statements_say_what_is_shown_and_what_is_assumed(answers):
    answer = answers[2]
    text = answer.details()
    assert (
        text.startswith("(C) For each of the 30 samples") and "proved in exact arithmetic" in text
    )
    assert "ASSUMED, not shown" in text and "Risk: no statement" in text
    model, problem = toy_case(2)
    floats = Planner(model).solve(
        problem,
        jax.random.key(0),
        Settings(target=0.3, samples=3, proof=False, budget_s=300),
    )
    assert (
        floats.status is Status.BOUNDED
        and "shown in float64 with a rounding margin" in floats.details()
    )


def test_the_ball_around_the_centre_is_safe(cuts, rng):
    for answer in cuts.values():
        centre, radius = answer.centre()
        assert radius > 0
        way = rng.normal(size=(500, 4))
        x = centre + way / np.linalg.norm(way, axis=1, keepdims=True) * radius * (1 - 1e-9)
        assert answer.contains(x[:, :2], x[:, 2:]).all()


def test_best_plans_are_inside_and_hardly_a_sample_beats_the_linear_best(answers, rng):
    answer = answers[8]
    x = answer.sample(jax.random.key(3), 3000)
    for objective in (np.array([1.0, 0, 0, 0]), rng.normal(size=4)):
        plan, value = answer.best(objective)
        assert answer.contains(plan[:2], plan[2:])[0]
        assert value == pytest.approx(plan @ objective) and value >= (x @ objective).max() - 0.02
    plan, value = answer.best("clearance", jax.random.key(0))
    e = verdicts(answer.scene, x[:, :2], x[:, 2:])
    assert answer.contains(plan[:2], plan[2:])[0]
    assert value >= e.clearance.max() - 1e-3


def test_projections_hold_every_sample(cuts):
    answer = cuts[4]
    x = answer.sample(jax.random.key(0), 500)
    polygons = answer.project([0, 1])
    lo, hi = np.concatenate(polygons).min(axis=0), np.concatenate(polygons).max(axis=0)
    assert ((x[:, :2] >= lo - 1e-9) & (x[:, :2] <= hi + 1e-9)).all()


def test_random_scenes_lose_nothing_between_floats_and_proofs():
    for number in range(20, 24):
        model, problem = toy_case(number)
        answer = Planner(model).solve(
            problem,
            jax.random.key(number),
            Settings(target=0.3, samples=40, budget_s=300),
        )
        shallow = 0
        if answer.cover.refused:  # allowed only for what short fractions cannot separate
            e = verdicts(answer.scene, answer.cover.points.p0, answer.cover.points.k)
            shallow = int((e.clearance[e.safe] < 1e-6).sum())
        assert answer.cover.refused <= shallow
