"""The pointwise verdict: prediction, bins, margins, batches."""

import jax
import numpy as np
import pytest
from toy_bodies import points_model, points_problem
from toy_models import anchored_plans, host_outputs, line_model, model_of, toy_case

from parc_jax.common.sets.box import box
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.verdict import pointwise as engine
from parc_jax.safe_set.verdict.pointwise import (
    CHUNK,
    Verdicts,
    anchor,
    predictions,
    row_margin,
    verdicts,
)
from parc_jax.safe_set.verdict.scene import scene_of


@pytest.fixture(scope="module")
def example():
    model, problem = toy_case(40, start=True)
    return (
        model,
        scene_of(problem, model),
        *anchored_plans(np.random.default_rng(5), model, CHUNK + 88),
    )


def test_bins_are_the_tubes_bins_and_none_is_outside_of_k(example):
    model, scene, p0, k = example
    e = verdicts(scene, p0, k)
    np.testing.assert_array_equal(e.bin, model.tube.bin_of(k))
    outside = k + np.array([2.5, 0.0])
    got = verdicts(scene, p0, outside)
    assert (got.bin == -1).all() and not got.safe.any() and not got.reaches.any()


def test_a_k_that_is_outside_by_a_subnormal_number_is_outside():
    """A processor that takes it for zero sees it on the border, which belongs to K."""
    lo, hi = np.array([0.0, -1.0]), np.array([1.0, -0.0])
    net = relu_network([np.zeros((2, 2))], [np.zeros(2)])
    still = model_of(net, box(lo, hi), np.full((1, 1, 2), 0.01), np.full((1, 2), 0.01))
    scene = scene_of(reach_avoid(box([-1, -1], [1, 1]), [], 0.1), still)
    tiny = np.array([-1e-310, -5e-324, -0.0, 0.0, 5e-324, 1e-310])
    k = np.stack([np.r_[tiny, np.full(6, 0.5)], np.r_[np.full(6, -0.5), tiny]], axis=1)
    p0, inside = np.zeros(k.shape), still.domain.contains(k)
    assert inside.tolist() == 2 * [False] + 8 * [True] + 2 * [False]
    for seen in (verdicts(scene, p0, k), predictions(scene, p0, k)):
        np.testing.assert_array_equal(seen.reaches, inside)
    np.testing.assert_array_equal(anchor(scene, p0, k)[1], inside)


@pytest.mark.parametrize("fitted", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_on_an_edge_the_margins_are_the_least_of_those_beside_it(fitted, rng):
    """Where bins meet the errors of each count; mixed with plans that are on none. [T28]"""
    model = points_model(rng, bins=(2, 2), fitted=fitted)
    scene = scene_of(points_problem(rng, model), model)
    k = rng.uniform(-1, 1, (40, 2))
    k[:10], k[10:20, 0], k[20:30, 1] = 0.0, 0.0, 0.0
    p0 = rng.uniform(-2.5, -1.5, (40, 2))
    e = verdicts(scene, p0, k)
    away = 1e-12 * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
    beside = [verdicts(scene, p0, k + by) for by in away]
    for name in ("goal", "clearance"):
        least = np.min([getattr(b, name) for b in beside], axis=0)
        np.testing.assert_allclose(getattr(e, name), least, atol=1e-8)
    assert (e.bin == np.min([b.bin for b in beside], axis=0)).all()
    assert 0 < e.safe[:30].sum() < 30


def test_margins_of_goal_and_start_are_those_of_the_rows(example):
    model, scene, p0, k = example
    e = verdicts(scene, p0, k)
    y = host_outputs(model.net, k)
    end = np.concatenate([p0 + y[:, 6:8], y[:, 8:]], axis=1)
    final = model.tube.final[model.tube.bin_of(k)]
    A, b = scene.goal_A, scene.goal_b
    np.testing.assert_allclose(
        e.goal, (b - final @ np.abs(A).T - end @ A.T).min(axis=1), atol=1e-11
    )
    np.testing.assert_allclose(
        e.start, (scene.start_b - p0 @ scene.start_A.T).min(axis=1), atol=1e-11
    )
    assert (e.safe == ((e.goal >= 0) & (e.start >= 0) & (e.bin >= 0) & (e.clearance > 0))).all()
    assert 0 < e.safe.sum() < len(k)


@pytest.mark.parametrize("n", [0, 1, CHUNK - 1, CHUNK, CHUNK + 1])
def test_any_batch_size_gives_the_same_rows(example, n):
    _, scene, p0, k = example
    whole, part = verdicts(scene, p0, k), verdicts(scene, p0[:n], k[:n])
    for a, b in zip(whole, part, strict=True):
        assert len(b) == n
        np.testing.assert_array_equal(a[:n], b)


def test_nothing_undefined_is_safe(example):
    _, scene, p0, k = example
    e = verdicts(scene, p0, k)
    assert e.safe.any()
    for bad in (np.nan, np.inf, -np.inf):
        assert not verdicts(scene, p0 + np.array([bad, 0]), k).safe.any()
        assert not verdicts(scene, p0, k + np.array([0, bad])).safe.any()
    for broken in (
        scene.replace(slack=np.float64(np.nan)),
        scene.replace(slack=np.float64(np.inf)),
    ):
        assert not verdicts(broken, p0, k).safe.any()
    holes = scene.obstacles.replace(vertices=scene.obstacles.vertices * np.nan)
    assert not verdicts(scene.replace(obstacles=holes), p0, k).safe.any()


def test_anchored_starts_end_where_they_were_asked_to(example, rng):
    _, scene, _, k = example
    z = rng.uniform(-0.4, 0.4, k.shape)
    p0, reaches = anchor(scene, z, k)
    e = verdicts(scene, p0, k)
    np.testing.assert_allclose(e.path[:, -1], z, atol=1e-12)
    np.testing.assert_array_equal(reaches, e.reaches)


def test_verdicts_do_not_depend_on_the_users_flags(example):
    _, scene, p0, k = example
    expected = verdicts(scene, p0, k)
    with jax.enable_x64(False):
        got = verdicts(scene, p0, k)
    assert got.clearance.dtype == np.float64
    np.testing.assert_array_equal(got.clearance, expected.clearance)


def test_a_scene_without_obstacles_is_all_clear():
    model = line_model(4, 0.01)
    scene = scene_of(reach_avoid(box([-1, -1, -1], [1, 1, 1]), [], 0.3), model)
    e = verdicts(scene, np.zeros((3, 2)), np.zeros((3, 2)))
    assert np.isposinf(e.clearance).all() and e.safe.all()


def test_row_margins_pay_the_slack_by_the_size_of_the_row():
    A, b = np.array([[2.0, -1.0], [0.0, 0.0]]), np.array([5.0, 1.0])
    margin, x = jax.jit(row_margin), np.array([1.0, 1.0])
    assert float(margin(A, b * 10, x, 0.5)) == 10.0  # the padding row costs nothing
    assert float(margin(A[:1], b[:1], x, 0.5)) == 2.5


def test_the_clearance_pays_the_slack(example):
    _, scene, p0, k = example
    free = verdicts(scene.replace(slack=np.float64(0.0)), p0, k).clearance
    paid = free - verdicts(scene.replace(slack=np.float64(1e-3)), p0, k).clearance
    assert (paid > 0.999e-3).all() and (paid < 1.4143e-3).all()  # slack times |w|_1


@pytest.mark.parametrize("t", range(4))
def test_every_interval_has_its_own_widths(t):
    """Standing still beside a wall that is there in one interval only."""
    net, domain = line_model(4).net, line_model(4).domain
    widths = 0.01 * np.arange(1.0, 5.0)[None, :, None] * np.ones(2)
    model = model_of(net, domain, widths, np.zeros((1, 3)), [[-1, 1], [-1, 1]])
    wall = box([1.0, -9.0], [2.0, 9.0])
    problem = reach_avoid(box([-1, -1, -1], [1, 1, 1]), [wall], 0.1, spans=[(t, t)])
    e = verdicts(scene_of(problem, model), np.zeros((1, 2)), np.zeros((1, 2)))
    assert e.clearance[0] == pytest.approx(1 - 0.1 - 0.01 * (t + 1), abs=1e-9)


def test_a_clearance_of_nothing_is_not_safe():
    none = np.zeros((1, 2, 2)), np.zeros((1, 1)), np.zeros((1, 3), bool), np.zeros(1, int)
    touching = Verdicts(*none, goal=np.zeros(1), start=np.zeros(1), clearance=np.zeros(1))
    assert touching.reaches.all() and not touching.safe.any()
    assert touching._replace(clearance=np.full(1, 1e-300)).safe.all()


def test_every_product_of_a_verdict_keeps_full_precision(example):
    """Accelerators round the inputs of products unless told not to; no CPU test would notice."""
    model, scene, p0, k = example
    sample = (model.net, model.tube, scene.arrays, p0[0], k[0])
    seen = list(precisions(jax.make_jaxpr(engine.verdict)(*sample).jaxpr))
    assert len(seen) >= 4
    assert all(given == (jax.lax.Precision.HIGHEST,) * 2 for given in seen)


def precisions(jaxpr):
    """Of all products in a program and in the programs that it calls."""
    for equation in jaxpr.eqns:
        if equation.primitive.name == "dot_general":
            yield equation.params["precision"]
        for inner in jax.tree.leaves(equation.params, is_leaf=lambda x: hasattr(x, "eqns")):
            inner = getattr(inner, "jaxpr", inner)
            if hasattr(inner, "eqns"):
                yield from precisions(inner)
