"""Corridors: who keeps to one is safe, whatever the cell; the quick tests agree with plain loops;
no question changes the next answer.
"""

import jax
import numpy as np
import pytest
from dense_oracle import DEPTH, knots_of, smallest_distance
from toy_models import toy_case

from parc_jax import checker
from parc_jax.answer.answer import answer_data
from parc_jax.planner import Planner
from parc_jax.proof.certificate.write import network_part, problem_part, tube_part
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import anchor, verdicts

SCENES = (2, 4, 8)


@pytest.fixture(scope="module", params=SCENES)
def answer(request):
    model, problem = toy_case(request.param)
    return Planner(model).solve(
        problem,
        jax.random.key(request.param),
        Settings(target=0.05, samples=10, budget_s=300),
    )


def plans(answer, rng, n):
    """Plans that reach the goal, safe or not: p0, k, path, bin."""
    k = rng.uniform(answer.model.domain.lo, answer.model.domain.hi, (n, answer.model.n_k))
    p0, _ = anchor(answer.scene, rng.uniform(answer.scene.z_lo, answer.scene.z_hi, (n, 2)), k)
    e = verdicts(answer.scene, p0, k)
    reaches = e.reaches
    return p0[reaches], k[reaches], e.path[reaches], e.bin[reaches]


def kept_by_hand(answer, path, bins) -> np.ndarray:
    """(b, c) margins: smallest of w . p - support - |w| . e over obstacles, intervals and both
    knots, in plain loops.
    """
    out = np.full((len(path), len(answer.corridors)), np.inf)
    for j, c in enumerate(answer.corridors):
        for o, t in np.argwhere(np.isfinite(c.support)):
            w, e = c.w[o, t], answer.model.tube.interval[bins, t]
            for knot in (t, t + 1):
                out[:, j] = np.minimum(
                    out[:, j], path[:, knot] @ w - c.support[o, t] - e @ np.abs(w)
                )
    return out


def test_who_keeps_is_found_as_by_hand(answer, rng):
    _, _, path, bins = plans(answer, rng, 700)
    corridors = Corridors(answer.model.tube, answer.corridors)
    margin = kept_by_hand(answer, path, bins)
    clear = np.abs(margin) > 1e-5  # the quick look is in float32
    kept = corridors.kept(path, bins)
    assert (
        (kept == (margin > 0))[clear].all()
        and not kept[margin < -1e-12].any()
        and kept.any()
        and not kept.all()
    )
    first = corridors.first(path, bins)
    found = first >= 0
    assert (margin[found, first[found]] > 0).all() and not (margin[~found] > 1e-5).any()


def test_whoever_keeps_is_safe_whatever_the_cell(answer, rng):
    p0, k, path, bins = plans(answer, rng, 12_000)
    corridors = Corridors(answer.model.tube, answer.corridors)
    kept = corridors.first(path, bins) >= 0
    assert kept.sum() > 1000
    p0, k = p0[kept], k[kept]
    assert verdicts(answer.scene, p0, k).safe.all() and answer.contains(p0, k).all()
    knots, _ = knots_of(answer.model.net, answer.model.time.n_steps, p0[:3000], k[:3000])
    errors = answer.model.tube.interval[answer.model.tube.bin_of(k[:3000])]
    assert (smallest_distance(answer.problem, knots, errors, n_points=51)[0] > -DEPTH).all()


def test_members_pass_the_exact_check_with_the_directions_of_the_corridor(answer, rng):
    context = checker.Context(
        problem_part(answer.problem, answer.model),
        network_part(answer.model.net),
        tube_part(answer.model.tube),
    )
    parts = answer_data(answer)["corridors"]
    assert len(parts) == len(answer.corridors) > 0 and answer.cover.refused == 0
    for part in parts:
        context.check_sample(part)
    p0, k, path, bins = plans(answer, rng, 300)
    margin = kept_by_hand(answer, path, bins)
    for i, j in np.argwhere(margin > 1e-6)[:200]:
        member = {
            "p0": [v.hex() for v in p0[i]],
            "k": [v.hex() for v in k[i]],
            "sep": parts[j]["sep"],
        }
        context.check_sample(member)
    strangers = np.argwhere(margin < -1e-6)[:50]
    for i, j in strangers:
        with pytest.raises(checker.Rejected):
            context.check_sample(
                {
                    "p0": [v.hex() for v in p0[i]],
                    "k": [v.hex() for v in k[i]],
                    "sep": parts[j]["sep"],
                }
            )
    assert len(strangers) == 50


def test_the_polytopes_are_corridors_in_cells(answer, rng):
    cut = answer.polytopes(jax.random.key(1), 4000)
    for rows, polytope in zip(cut.sets, cut.all, strict=True):
        inner = np.concatenate([polytope.p0, polytope.k])
        assert (rows.A @ inner < rows.b).all()
    p0, k, path, bins = plans(answer, rng, 3000)
    used = Corridors(answer.model.tube, [polytope.corridor for polytope in cut])
    inside = cut.contains(p0, k)
    assert (used.first(path, bins) >= 0)[inside].all() and answer.contains(p0, k)[inside].all()
    assert inside[answer.contains(p0, k)].mean() > 0.8


def test_no_question_changes_the_next_answer(answer, rng):
    """The order in which corridors are asked is an argument, and decides which one is named, never
    whether one is.
    """
    _, _, path, bins = plans(answer, rng, 2000)
    corridors = Corridors(answer.model.tube, answer.corridors)
    before = corridors.first(path, bins)
    backward = np.arange(len(corridors))[::-1]
    other = corridors.first(path, bins, backward)
    np.testing.assert_array_equal(before >= 0, other >= 0)
    np.testing.assert_array_equal(before, corridors.first(path, bins))
    np.testing.assert_array_equal(other, corridors.first(path, bins, backward))
    assert (before != other).any()
    more = corridors.with_more(answer.corridors[:1])
    assert len(more) == len(corridors) + 1 and len(corridors.all) == len(answer.corridors)
