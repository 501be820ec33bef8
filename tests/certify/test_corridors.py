"""Corridors: who keeps to one is safe, whatever the cell; the quick tests agree with plain loops; what a cover says of
them holds for fresh plans.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from dense_oracle import DEPTH, knots_of, smallest_distance
from scipy.stats import binom
from toy_models import line_model, toy_case

from parc_jax import checker
from parc_jax.arrays import x64
from parc_jax.certify import corridor as corridor_stage
from parc_jax.certify import grow as growing
from parc_jax.certify.certificate import network_part, problem_part, tube_part
from parc_jax.certify.cover import ARMED, Judge
from parc_jax.certify.draw import draw
from parc_jax.certify.evaluate import anchor, evaluate
from parc_jax.certify.grower import Grower, greedy
from parc_jax.certify.pieces import Pieces
from parc_jax.certify.scene import scene
from parc_jax.planner import Planner
from parc_jax.problem import reach_avoid
from parc_jax.sets.box import box

SCENES = (2, 4, 8)


@pytest.fixture(scope="module", params=SCENES)
def answer(request):
    model, problem = toy_case(request.param)
    return Planner(model).solve(problem, jax.random.key(request.param), target=0.05, n_samples=10, budget_s=300)


def plans(answer, rng, n):
    """Plans that reach the goal, safe or not: p0, k, path, bin."""
    k = rng.uniform(answer.model.domain.lo, answer.model.domain.hi, (n, answer.model.n_k))
    p0, _ = anchor(answer.model, answer.scene, rng.uniform(answer.scene.z_lo, answer.scene.z_hi, (n, 2)), k)
    e = evaluate(answer.model, answer.scene, p0, k)
    reaches = e.reaches
    return p0[reaches], k[reaches], e.path[reaches], e.bin[reaches]


def kept_by_hand(answer, path, number) -> np.ndarray:
    """(b, c) margins: smallest of w . p - reach - |w| . e over obstacles, intervals and both knots, in plain loops."""
    out = np.full((len(path), len(answer.corridors)), np.inf)
    for j, c in enumerate(answer.corridors):
        for o, t in np.argwhere(np.isfinite(c.reach)):
            w, e = c.w[o, t], answer.model.tube.interval[number, t]
            for knot in (t, t + 1):
                out[:, j] = np.minimum(out[:, j], path[:, knot] @ w - c.reach[o, t] - e @ np.abs(w))
    return out


def test_who_keeps_is_found_as_by_hand(answer, rng):
    _, _, path, number = plans(answer, rng, 700)
    corridors = corridor_stage.Corridors(answer.model.tube.interval, answer.corridors)
    margin = kept_by_hand(answer, path, number)
    clear = np.abs(margin) > 1e-5  # the quick look is in float32
    kept = corridors.kept(path, number)
    assert (kept == (margin > 0))[clear].all() and not kept[margin < -1e-12].any() and kept.any() and not kept.all()
    first = corridors.first(path, number)
    found = first >= 0
    assert (margin[found, first[found]] > 0).all() and not (margin[~found] > 1e-5).any()
    allowed = rng.random(kept.shape) < 0.3
    first = corridors.first(path, number, allowed)
    found = first >= 0
    assert allowed[found, first[found]].all() and (margin[found, first[found]] > 0).all()
    assert not ((margin > 1e-5) & allowed)[~found].any()


def test_whoever_keeps_is_safe_whatever_the_cell(answer, rng):
    p0, k, path, number = plans(answer, rng, 12_000)
    corridors = corridor_stage.Corridors(answer.model.tube.interval, answer.corridors)
    kept = corridors.first(path, number) >= 0
    assert kept.sum() > 1000
    p0, k = p0[kept], k[kept]
    assert evaluate(answer.model, answer.scene, p0, k).safe.all() and answer.keeps(p0, k).all()
    knots, _ = knots_of(answer.model.net, answer.model.time.n_steps, p0[:3000], k[:3000])
    errors = answer.model.tube.interval[answer.model.tube.bin_of(k[:3000])]
    assert (smallest_distance(answer.problem, knots, errors, n_points=51)[0] > -DEPTH).all()


def test_members_pass_the_exact_check_with_the_directions_of_the_corridor(answer, rng):
    context = checker.Context(
        problem_part(answer.problem, answer.model), network_part(answer.model.net), tube_part(answer.model.tube)
    )
    parts = answer.to_json()["corridors"]
    assert len(parts) == len(answer.corridors) > 0 and answer.refused == 0
    for part in parts:
        context.check_sample(part)
    p0, k, path, number = plans(answer, rng, 300)
    margin = kept_by_hand(answer, path, number)
    for i, j in np.argwhere(margin > 1e-6)[:200]:
        member = {"p0": [v.hex() for v in p0[i]], "k": [v.hex() for v in k[i]], "sep": parts[j]["sep"]}
        context.check_sample(member)
    strangers = np.argwhere(margin < -1e-6)[:50]
    for i, j in strangers:
        with pytest.raises(checker.Rejected):
            context.check_sample({"p0": [v.hex() for v in p0[i]], "k": [v.hex() for v in k[i]], "sep": parts[j]["sep"]})
    assert len(strangers) == 50


def test_a_test_that_forgets_the_tube_is_noticed(answer, rng):
    _, _, path, number = plans(answer, rng, 6000)
    careless = corridor_stage.Corridors(answer.model.tube.interval * 0, answer.corridors)
    assert (careless.kept(path, number) & (kept_by_hand(answer, path, number) < -1e-9)).any()


def test_the_polytopes_are_corridors_in_cells(answer, rng):
    for polytope, piece in zip(answer.safe_sets, answer.pieces, strict=True):
        inner = np.concatenate([piece.p0, piece.k])
        assert (polytope.A @ inner < polytope.b).all()
    p0, k, path, number = plans(answer, rng, 3000)
    used = corridor_stage.Corridors(answer.model.tube.interval, [piece.corridor for piece in answer.pieces])
    assert (used.first(path, number) >= 0)[answer.contains(p0, k)].all()
    assert (answer.keeps(p0, k) == answer.contains(p0, k))[answer.keeps(p0, k)].mean() > 0.9


@pytest.mark.parametrize("n_obstacles", [0, 1, 5, 7])
def test_any_number_of_obstacles_is_covered_and_proved(n_obstacles):
    """Scenes are padded to few numbers of obstacles; what only pads must not reach a certificate."""
    blocks = [box([2, 0.5 + i], [3, 0.9 + i]) for i in range(n_obstacles)]
    problem = reach_avoid(box([3.0, -0.5, -1.0], [4.0, 0.5, 1.0]), blocks, 0.1)
    answer = Planner(line_model(e=0.05)).solve(problem, jax.random.key(0), n_samples=5, target=0.1, budget_s=300)
    assert answer.refused == 0 and answer.pieces and answer.corridors
    assert min(answer.coverage.at_least, answer.corridor_coverage.at_least) >= 0.9


def test_corridors_alone_are_certified_without_polytopes(rng):
    model, problem = toy_case(4)
    options = {"n_samples": 5, "target": 0.02, "budget_s": 300}
    answer = Planner(model).solve(problem, jax.random.key(0), polytopes=False, **options)
    assert not answer.pieces and answer.coverage.at_least == 0 and answer.corridor_coverage.at_least >= 0.98
    assert 0 < answer.timings["corridors_s"] <= answer.timings["cover_s"]
    assert all(look.polytopes == look.inside == 0 for look in answer.history)
    fresh = draw(model, answer.scene, rng, 40_000).safe
    kept = int(answer.keeps(fresh.p0, fresh.k).sum())
    assert binom.cdf(kept, len(fresh.k), 0.98) > 1e-6
    both = Planner(model).solve(problem, jax.random.key(0), **options)
    assert both.corridor_coverage.at_least >= 0.98 and both.coverage.at_least >= 0.98
    assert [look.kept >= look.inside for look in both.history] == [True] * len(both.history)


def seed_and_mates(model, problem, rng):
    """Paths and errors of one seed with 63 mates, and the grown directions for them."""
    laid_out = scene(problem, model)
    seen = draw(model, laid_out, rng, 20_000).safe.at(slice(0, growing.POINTS))
    path, error = seen.path.astype(np.float32), model.tube.interval[seen.bin].astype(np.float32)
    with x64():
        growth = jax.device_get(growing.grow_batch(laid_out.arrays, path[None], error[None]))
    return laid_out, path, error, growth


def test_words_say_which_plans_a_direction_separates(rng):
    model, problem = toy_case(4)
    laid_out, path, error, _ = seed_and_mates(model, problem, rng)
    grown, table = laid_out.obstacles, laid_out.directions
    with x64():
        _, words = growing._words(
            grown.corner[0], grown.sign[0], grown.active[0], table.w[0], table.reach[0], grown.radius, laid_out.slack,
            jnp.asarray(path, float), jnp.asarray(error, float),
        )  # fmt: skip
    words = np.asarray(words)
    for t, d, b in zip(*(rng.integers(0, n, 400) for n in (len(words), table.w.shape[1], len(path))), strict=True):
        w = table.w[0, d]
        room = min(path[b, t] @ w, path[b, t + 1] @ w) - table.reach[0, d] - error[b, t] @ np.abs(w)
        if abs(room) > 1e-6:
            assert bool(words[t, d] >> np.uint64(b) & np.uint64(1)) == (room > 0 or not grown.active[0, t])


def test_the_seed_is_inside_of_what_grows_around_it_and_most_mates_are(rng):
    model, problem = toy_case(4)
    laid_out, _, _, growth = seed_and_mates(model, problem, rng)
    assert growth.kept.all()
    grower = Grower(model, problem, laid_out, rng)
    seen = draw(model, laid_out, rng, 20_000).safe.at(slice(0, 400))
    seeds = np.arange(0, 400, 40)
    grown = corridor_stage.Corridors(model.tube.interval, grower._grown(seen, seeds))
    kept = grown.kept(seen.path, seen.bin)
    assert kept[seeds, np.arange(len(seeds))].all() and kept.sum(axis=0).max() > 100


def test_plans_that_no_short_direction_separates_are_given_up(rng, monkeypatch):
    model, problem = toy_case(4)
    grower = Grower(model, problem, scene(problem, model), rng)
    monkeypatch.setattr(grower, "_spelled_out", lambda growth: [
        corridor_stage.Corridor(
            np.ones((*growth.choice.shape[1:], 2)), np.full(growth.choice.shape[1:], 1e3), None, None, None
        )
        for _ in growth.choice
    ])  # fmt: skip
    assert not grower.keep(draw(model, grower.scene, rng, 2000).safe).any()
    waiting = len(grower.waiting.k)
    for _ in grower.grow():
        assert len(grower.waiting.k) < waiting  # an endless search would be the price of hope
        waiting = len(grower.waiting.k)
    assert waiting == 0 and not grower.corridors.all


def test_polytopes_hold_the_plans_they_were_cut_around(rng):
    model, problem = toy_case(8)
    laid_out = scene(problem, model)
    pieces = Pieces(Grower(model, problem, laid_out, rng))
    seen = draw(model, laid_out, rng, 6000).safe
    assert not pieces.inside(seen).any()
    kept = pieces.grower.keep(seen)
    for _ in pieces.grower.grow():
        pass
    pieces.add(seen)
    kept = pieces.corridors.first(seen.path, seen.bin) >= 0
    assert kept.mean() > 0.95 and (pieces.inside(seen) == kept).all()
    for piece in pieces.all():
        inner = np.concatenate([piece.p0, piece.k])
        assert (piece.polytope.A @ inner < piece.polytope.b).all()
    before = len(pieces)
    pieces.add(seen.at(slice(0, 0)))
    assert len(pieces) == before


def test_greedy_takes_the_column_that_adds_most():
    kept = np.array([[1, 0, 1], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]], bool)
    assert list(greedy(kept)) == [0, 1, 2] and list(greedy(kept, worth=0.5)) == [0]
    assert list(greedy(kept[:0])) == [] and list(greedy(kept[:, :0])) == []


def test_a_judge_is_satisfied_by_announced_looks_only_and_pays_for_each(rng):
    judge, good = Judge(0.1, 0.99), np.arange(1000) >= 20
    judge.look(good)
    assert judge.coverage.at_least > 0.9 and not judge.satisfied  # nothing had announced it
    judge.look(good)
    assert judge.satisfied
    judge = Judge(0.1, 0.99)
    bounds = []
    for _ in range(5):
        judge.look(np.arange(1000) >= 0.1 * ARMED * 1000 - 1)  # announces, and never satisfies
        bounds.append(judge.coverage.at_least)
    assert bounds == sorted(bounds, reverse=True) and bounds[-1] < bounds[1]
    judge.look(np.zeros(10, bool))
    assert judge.coverage.share == judge.coverage.at_least == 0


def wrong_judgements(repeats, confidence, share, rng):
    """How often a judge is satisfied by a cover that leaves a little more than its target, asked again and again."""
    wrong = 0
    for _ in range(repeats):
        judge = Judge(0.1, confidence)
        for _ in range(30):
            judge.look(rng.random(300) < share)
        wrong += judge.satisfied
    return wrong


def test_looking_often_does_not_help_a_bad_cover(rng, monkeypatch):
    assert wrong_judgements(300, 0.8, 0.899, rng) <= binom.ppf(0.9999, 300, 0.2)
    monkeypatch.setattr(Judge, "_worst", lambda self, n, out: float(binom.ppf(0.8, n, out / n)) / n)
    assert wrong_judgements(300, 0.8, 0.899, rng) > binom.ppf(0.9999, 300, 0.2)  # no part for each look: caught
