"""Changes that must not change the verdict, and changes that may only change it one way.

The margins of the pointwise test are exact distances, so equal problems give equal margins up to
rounding.
"""

import numpy as np
import pytest
from toy_models import TRIANGLE, anchored_plans, model_of, toy_case

from parc_jax.common.sets.hpolytope import HPolytope, hpolytope
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.body import Disc, Polygon
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = pytest.mark.soundness

T = 4
SEEDS = (0, pytest.param(1, marks=pytest.mark.night), pytest.param(3, marks=pytest.mark.night))
CLOSE = 1e-11  # [m] rounding of these scenes


def example(seed, body="disc"):
    model, problem = toy_case(40 + seed, {"disc": 0.08, "polygon": TRIANGLE}[body], start=True)
    return (
        model,
        problem.replace(spans=((0, 2), None)),
        *anchored_plans(np.random.default_rng(seed), model, 400),
    )


def margins(model, problem, p0, k):
    """(bin >= 0, goal, start, clearance) of every plan, as columns."""
    e = verdicts(scene_of(problem, model), p0, k)
    return np.stack([e.bin >= 0, e.goal, e.start, e.clearance], axis=1).astype(float)


def same(first, second, close=CLOSE):
    known = first[:, 0] > 0
    assert known.mean() > 0.9 and (known == (second[:, 0] > 0)).all()
    assert 5 < (first[known][:, 1:] > 0).all(axis=1).sum()
    inside = first[:, 3] > 1e-6  # below zero the clearance is only a sign
    np.testing.assert_allclose(second[known, 1:3], first[known, 1:3], atol=close, rtol=1e-11)
    np.testing.assert_allclose(
        second[known & inside, 3], first[known & inside, 3], atol=close, rtol=1e-11
    )
    assert ((first[known, 3] > 0) == (second[known, 3] > 0))[np.abs(first[known, 3]) > 1e-6].all()


def moved(poly: HPolytope, M, shift) -> HPolytope:
    """The image of a polytope under x -> M x + shift; M is diagonal, orthogonal up to scale."""
    A = poly.A @ np.linalg.inv(M)
    return hpolytope(A, poly.b + A @ shift)


def image(model, problem, p0, M, shift, unit=1.0):
    """World x -> M x + shift, M diagonal with entries +-`unit`; network, tube, problem and starts
    moved.
    """
    n_q = model.n_q
    W, b = [list(part) for part in (model.net.weights, model.net.biases)]
    big = np.kron(np.eye(T), M)
    W[-1] = np.concatenate([big @ W[-1][: 2 * T], W[-1][2 * T :]])
    b[-1] = np.concatenate([big @ b[-1][: 2 * T], b[-1][2 * T :]])
    final = np.concatenate([model.tube.final[:, :2] * unit, model.tube.final[:, 2:]], axis=1)
    new = model_of(
        relu_network(W, b), model.domain, model.tube.interval * unit, final, model.tube.edges
    )
    M3 = np.eye(2 + n_q)
    M3[:2, :2] = M
    body = problem.body
    body = Disc(body.radius * unit) if isinstance(body, Disc) else Polygon(body.vertices @ M.T)
    parts = reach_avoid(
        moved(problem.goal, M3, np.concatenate([shift, np.zeros(n_q)])),
        [moved(o, M, shift) for o in problem.obstacles],
        body,
        moved(problem.start, M, shift),
        problem.spans,
    )
    return new, parts, p0 @ M.T + shift


@pytest.mark.parametrize("body", ["disc", "polygon"])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_world_may_be_translated_reflected_and_turned_by_a_right_angle(seed, body):
    model, problem, p0, k = example(seed, body)
    before = margins(model, problem, p0, k)
    shift = np.array([17.0, -4.0])
    for M in (np.eye(2), np.diag([1.0, -1]), np.diag([-1.0, 1]), -np.eye(2)):
        new_model, new_problem, new_p0 = image(model, problem, p0, M, shift)
        same(before, margins(new_model, new_problem, new_p0, k), 1e-10)


@pytest.mark.parametrize("seed", SEEDS)
def test_metres_may_be_millimetres(seed):
    model, problem, p0, k = example(seed)
    before = margins(model, problem, p0, k)
    for unit in (1e3, 1e-3):
        after = margins(
            *[x for x in image(model, problem, p0, unit * np.eye(2), np.zeros(2), unit)], k
        )
        after[:, 3] /= unit
        assert ((before > 0) == (after > 0))[(np.abs(before) > 1e-8) & (np.abs(after) > 1e-8)].all()
        clear = before[:, 3] > 1e-6
        np.testing.assert_allclose(after[clear, 3], before[clear, 3], rtol=1e-8, atol=1e-9)


def refined(model, problem):
    """Every interval halved: midpoints by linear interpolation, the same widths, twice the
    steps.
    """
    W, b = [list(part) for part in (model.net.weights, model.net.biases)]
    half = np.zeros((2 * T, T))
    for t in range(T):
        half[2 * t + 1, t] = 1.0
        half[2 * t, t] = 0.5
        if t:
            half[2 * t, t - 1] = 0.5
    big = np.kron(half, np.eye(2))
    W[-1] = np.concatenate([big @ W[-1][: 2 * T], W[-1][2 * T :]])
    b[-1] = np.concatenate([big @ b[-1][: 2 * T], b[-1][2 * T :]])
    new = model_of(
        relu_network(W, b),
        model.domain,
        model.tube.interval.repeat(2, axis=1),
        model.tube.final,
        model.tube.edges,
    )
    steps = tuple(None if s is None else (2 * s[0], 2 * s[1] + 1) for s in problem.spans)
    return new, problem.replace(spans=steps)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_time_may_be_refined(seed):
    model, problem, p0, k = example(seed)
    same(margins(model, problem, p0, k), margins(*refined(model, problem), p0, k))


@pytest.mark.parametrize("body", ["disc", "polygon"])
@pytest.mark.parametrize("seed", SEEDS)
def test_rows_may_be_reordered_rescaled_and_repeated_and_obstacles_swapped(seed, body):
    model, problem, p0, k = example(seed, body)
    before = margins(model, problem, p0, k)
    rng = np.random.default_rng(seed)
    obstacles = []
    for o in problem.obstacles:
        order, size = rng.permutation(len(o.b)), 2.0 ** rng.integers(-20, 20, len(o.b))
        obstacles.append(hpolytope(o.A[order] * size[:, None], o.b[order] * size))
    other = problem.replace(obstacles=tuple(obstacles), spans=problem.spans)
    same(before, margins(model, other, p0, k))
    swapped = problem.replace(obstacles=problem.obstacles[::-1], spans=problem.spans[::-1])
    same(before, margins(model, swapped, p0, k))
    twice = problem.replace(obstacles=problem.obstacles * 2, spans=problem.spans * 2)
    same(before, margins(model, twice, p0, k))
    extra = tuple(  # a row that cuts nothing
        hpolytope(np.concatenate([o.A, [[1.0, 0.5]]]), np.append(o.b, 1e3))
        for o in problem.obstacles
    )
    same(before, margins(model, problem.replace(obstacles=extra, spans=problem.spans), p0, k))


def test_the_order_and_the_company_of_plans_do_not_matter(rng):
    model, problem, p0, k = example(1)
    before = margins(model, problem, p0, k)
    order = rng.permutation(len(k))
    np.testing.assert_array_equal(margins(model, problem, p0[order], k[order]), before[order])
    np.testing.assert_allclose(margins(model, problem, p0[:3], k[:3]), before[:3], atol=CLOSE)


def tightened(model, problem, rng):
    """Changes that can only help: a smaller tube, body, obstacles, a later absence; a bigger goal
    and start set.
    """
    tube = model.tube
    less = rng.uniform(0.3, 0.9)
    yield (
        "smaller tube",
        model_of(model.net, model.domain, tube.interval * less, tube.final * less, tube.edges),
        problem,
    )
    if isinstance(problem.body, Disc):
        yield "smaller disc", model, problem.replace(body=Disc(problem.body.radius * less))
    else:
        yield "smaller body", model, problem.replace(body=Polygon(problem.body.vertices[:-1]))
    smaller = tuple(
        o.replace(b=o.b - rng.uniform(0, 0.02) * np.linalg.norm(o.A, axis=1))
        for o in problem.obstacles
    )
    yield "smaller obstacles", model, problem.replace(obstacles=smaller, spans=problem.spans)
    yield (
        "one obstacle fewer",
        model,
        problem.replace(obstacles=problem.obstacles[1:], spans=problem.spans[1:]),
    )
    yield "shorter presence", model, problem.replace(spans=((1, 2), (0, 2)))
    wider = problem.goal.replace(b=problem.goal.b + 0.05)
    yield "bigger goal", model, problem.replace(goal=wider)
    yield (
        "bigger start",
        model,
        problem.replace(start=problem.start.replace(b=problem.start.b + 0.1)),
    )
    yield "any start", model, problem.replace(start=None)


@pytest.mark.slow
@pytest.mark.parametrize("body", ["disc", "polygon"])
@pytest.mark.parametrize("seed", SEEDS)
def test_tightening_never_turns_accept_into_reject(seed, body):
    model, problem, p0, k = example(seed, body)
    before = verdicts(scene_of(problem, model), p0, k)
    clear = before.safe & (np.minimum(before.goal, before.clearance) > 1e-9)
    assert clear.sum() > 5
    gained = 0
    for name, new_model, new_problem in tightened(model, problem, np.random.default_rng(seed)):
        after = verdicts(scene_of(new_problem, new_model), p0, k)
        assert after.safe[clear].all(), name
        gained += int((after.safe & ~before.safe).sum())
    assert gained > 0
    # and the other way round something is lost, so the comparison can fail
    wider = model_of(
        model.net,
        model.domain,
        model.tube.interval * 3 + 0.05,
        model.tube.final * 2,
        model.tube.edges,
    )
    assert not verdicts(scene_of(problem, wider), p0, k).safe[clear].all()
