"""Leaves against the point test: nothing in an unsafe leaf is accepted."""

import numpy as np
import pytest
from toy_models import host_outputs, model_of, random_model, random_problem

from parc_jax.checker import number
from parc_jax.common.sets.box import box
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.absence.branch_and_bound import BranchAndBound
from parc_jax.proof.absence.prove_no_plan import prove_no_plan
from parc_jax.safe_set.corridors.sampling import ends_from
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of
from tests.no_plan.test_no_plan import check

pytestmark = pytest.mark.soundness
BINS = (2, 2)  # one shape, compiled once


def leaves(plan, model):
    """(names, lo, hi) of the leaves, read from the certificate alone."""
    lo = [float(number(v)) for v in plan["z"]["lo"]] + list(model.domain.lo)
    hi = [float(number(v)) for v in plan["z"]["hi"]] + list(model.domain.hi)
    stack, names, los, his = [(lo, hi)], [], [], []
    for node in plan["tree"]:
        ((name, what),), (lo, hi) = node.get("bounded", node).items(), stack.pop()
        if name == "split":
            axis, at = what[0], float(number(what[1]))
            stack += [
                ([*lo[:axis], at, *lo[axis + 1 :]], hi),
                (lo, [*hi[:axis], at, *hi[axis + 1 :]]),
            ]
        else:
            names.append(name), los.append(lo), his.append(hi)
    assert not stack
    return np.array(names), np.array(los), np.array(his)


def crowded(rng, model):
    """A goal and start set about the mean, two boxes on mean paths: leaves of all kinds occur."""
    k = rng.uniform(model.domain.lo, model.domain.hi, (200, 2))
    y, T = host_outputs(model.net, k), model.time.n_steps
    q = y[:, 2 * T :].mean(axis=0)
    half = y[:, 2 * T :].std(axis=0) + 0.3
    end = y[:, 2 * T - 2 : 2 * T]
    at = [
        (y[:, 2 * t : 2 * t + 2] - end)[rng.integers(200)] + 0.4 * rng.normal(size=2)
        for t in (0, 1)
    ]
    start = box(-end.mean(axis=0) - 0.9, -end.mean(axis=0) + 0.9)
    goal = box([-0.5, -0.5, *(q - half)], [0.5, 0.5, *(q + half)])
    return reach_avoid(goal, [box(x - 0.2, x + 0.2) for x in at], 0.1, start)


def agree(model, problem, answer, rng, n=6000):
    """Draw over the certified box; the kinds of leaves, once the points in each are checked."""
    names, lo, hi = leaves(answer.certificate, model)
    scene = scene_of(problem, model)
    x = rng.uniform(lo.min(axis=0), hi.max(axis=0), (n, lo.shape[1]))
    # some leaves are tiny: draw in each of them too
    extra = rng.integers(0, len(lo), n)
    y = lo[extra] + rng.uniform(size=(n, lo.shape[1])) * (hi - lo)[extra]
    p = np.concatenate([x, y])
    seen = verdicts(scene, p[:, :2] - ends_from(0.0, model, p[:, 2:]), p[:, 2:])
    inside = [
        np.flatnonzero(((p >= a) & (p <= b)).all(axis=1)) for a, b in zip(lo, hi, strict=True)
    ]
    for name, which in zip(names, inside, strict=True):
        if name in ("goal", "start", "hit"):
            assert not seen.safe[which].any(), f"a {name} leaf holds a safe plan"
    return seen.safe[:n].mean(), set(names)


def divided(model, problem, max_leaves=400):
    """As many boxes as asked: no plan is tried, so none ends the search."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BranchAndBound, "_try_plans", lambda *_: None)
        return decided(model, problem, max_leaves)


def decided(model, problem, max_leaves=400):
    return prove_no_plan(scene_of(problem, model), limit=Limit(300), max_leaves=max_leaves)


@pytest.mark.night
def test_leaves_agree_with_points_and_leave_room_for_the_safe_share(rng):
    met = set()
    for _ in range(4):
        model = random_model(rng, bins=BINS, size=0.02)
        problem = crowded(rng, model)
        answer = divided(model, problem)
        assert answer.certificate is not None, "the checker refused a leaf"
        assert answer.unsafe + answer.undecided == answer.total
        share, names = agree(model, problem, answer, rng)
        noise = 4 * np.sqrt(max(share * (1 - share), 1e-4) / 6000)
        assert share <= float(answer.undecided / answer.total) + noise
        met |= names
    assert met >= {"goal", "start", "hit", "open"}


@pytest.mark.night
@pytest.mark.parametrize("seed", range(8))
def test_random_scenes_with_polygons(seed):
    """Slanted obstacles, disc and polygon bodies, start sets, bins; with few leaves, and until a
    plan is found.
    """
    rng = np.random.default_rng(seed)
    model = random_model(rng, bins=((1, 1), (2, 3))[seed % 2])
    problem = random_problem(
        rng, model, body=("disc", "polygon")[seed // 2 % 2], start=bool(seed % 2)
    )
    for search in (divided, decided):
        answer = search(model, problem)
        assert answer.certificate is not None, "the checker refused a leaf"
        share, _ = agree(model, problem, answer, rng)
        assert share <= float(answer.undecided / answer.total) + 0.03
        if answer.safe_plan is not None:
            p0, k = answer.safe_plan
            assert verdicts(scene_of(problem, model), p0[None], k[None]).safe.all()


@pytest.mark.slow
def test_tube_enters_the_hit_test_in_the_unsafe_direction(rng):
    """A wider tube never makes a box safe again: the same tree still holds, and the verdicts of
    points agree.
    """
    narrow = random_model(rng, bins=BINS, size=0.01)
    problem = crowded(rng, narrow)
    wide = model_of(
        narrow.net, narrow.domain, narrow.tube.interval + 0.1, narrow.tube.final, narrow.tube.edges
    )
    plan = decided(narrow, problem, 150).certificate
    assert check(wide, problem, plan)["unsafe"] == check(narrow, problem, plan)["unsafe"]
