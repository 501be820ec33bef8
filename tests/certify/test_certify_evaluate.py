"""The pointwise verdict: prediction, bins, margins, batches."""

import jax
import numpy as np
import pytest
from toy_models import anchored_plans, host_outputs, line_model, toy_case

from parc_jax.certify import evaluate as engine
from parc_jax.certify.evaluate import CHUNK, anchor, evaluate, predict, row_margin
from parc_jax.certify.scene import scene
from parc_jax.problem import reach_avoid
from parc_jax.sets.box import box


@pytest.fixture(scope="module")
def example():
    model, problem = toy_case(40, start=True)
    return model, scene(problem, model), *anchored_plans(np.random.default_rng(5), model, CHUNK + 88)


def test_prediction_is_the_network_time_major_from_the_start(example):
    model, _, _, k = example
    offsets, q, pattern = predict(model.net, 4, 2, k[0])
    y = host_outputs(model.net, k[:1])[0]
    np.testing.assert_allclose(offsets, np.concatenate([np.zeros((1, 2)), y[:8].reshape(4, 2)]), atol=1e-13)
    np.testing.assert_allclose(q, y[8:], atol=1e-13)
    h, expected = k[0], []
    for W, b in zip(model.net.weights[:-1], model.net.biases[:-1], strict=True):
        z = W @ h + b
        expected.append(z > 0)
        h = np.maximum(z, 0)
    np.testing.assert_array_equal(pattern, np.concatenate(expected))


def test_bins_are_the_tubes_bins_and_boundaries_have_none(example):
    model, laid_out, p0, k = example
    e = evaluate(model, laid_out, p0, k)
    np.testing.assert_array_equal(e.bin, model.tube.bin_of(k))
    edge = k.copy()
    edge[:, 1] = 0.0  # where the two bins meet
    assert (evaluate(model, laid_out, p0, edge).bin == -1).all()
    outside = k + np.array([2.5, 0.0])
    got = evaluate(model, laid_out, p0, outside)
    assert (got.bin == -1).all() and not got.safe.any() and not got.reaches.any()


def test_margins_of_goal_and_start_are_those_of_the_rows(example):
    model, laid_out, p0, k = example
    e = evaluate(model, laid_out, p0, k)
    y = host_outputs(model.net, k)
    end = np.concatenate([p0 + y[:, 6:8], y[:, 8:]], axis=1)
    final = model.tube.final[model.tube.bin_of(k)]
    A, b = laid_out.goal_A, laid_out.goal_b
    np.testing.assert_allclose(e.goal, (b - final @ np.abs(A).T - end @ A.T).min(axis=1), atol=1e-11)
    np.testing.assert_allclose(e.start, (laid_out.start_b - p0 @ laid_out.start_A.T).min(axis=1), atol=1e-11)
    assert (e.safe == ((e.goal >= 0) & (e.start >= 0) & (e.bin >= 0) & (e.clearance > 0))).all()
    assert 0 < e.safe.sum() < len(k)


@pytest.mark.parametrize("n", [0, 1, CHUNK - 1, CHUNK, CHUNK + 1])
def test_any_batch_size_gives_the_same_rows(example, n):
    model, laid_out, p0, k = example
    whole, part = evaluate(model, laid_out, p0, k), evaluate(model, laid_out, p0[:n], k[:n])
    for a, b in zip(whole, part, strict=True):
        assert len(b) == n
        np.testing.assert_array_equal(a[:n], b)


def test_nothing_undefined_is_safe(example):
    model, laid_out, p0, k = example
    e = evaluate(model, laid_out, p0, k)
    assert e.safe.any()
    for bad in (np.nan, np.inf, -np.inf):
        assert not evaluate(model, laid_out, p0 + np.array([bad, 0]), k).safe.any()
        assert not evaluate(model, laid_out, p0, k + np.array([0, bad])).safe.any()
    for broken in (laid_out.replace(slack=np.float64(np.nan)), laid_out.replace(slack=np.float64(np.inf))):
        assert not evaluate(model, broken, p0, k).safe.any()
    holes = laid_out.obstacles.replace(corner=laid_out.obstacles.corner * np.nan)
    assert not evaluate(model, laid_out.replace(obstacles=holes), p0, k).safe.any()


def test_comparing_the_wrong_way_round_would_let_nan_pass(example, monkeypatch):
    model, laid_out, p0, k = example
    monkeypatch.setattr(engine.Evaluation, "safe", property(lambda e: ~(e.clearance <= 0) & ~(e.goal < 0)))
    assert evaluate(model, laid_out, p0 + np.array([np.nan, 0]), k).safe.any()


def test_anchored_starts_end_where_they_were_asked_to(example, rng):
    model, laid_out, _, k = example
    z = rng.uniform(-0.4, 0.4, k.shape)
    p0, reaches = anchor(model, laid_out, z, k)
    e = evaluate(model, laid_out, p0, k)
    np.testing.assert_allclose(e.path[:, -1], z, atol=1e-12)
    np.testing.assert_array_equal(reaches, e.reaches)


def test_verdicts_do_not_depend_on_the_users_flags(example):
    model, laid_out, p0, k = example
    expected = evaluate(model, laid_out, p0, k)
    with jax.enable_x64(False):
        got = evaluate(model, laid_out, p0, k)
    assert got.clearance.dtype == np.float64
    np.testing.assert_array_equal(got.clearance, expected.clearance)


def test_a_scene_without_obstacles_is_all_clear():
    model = line_model(4, 0.01)
    laid_out = scene(reach_avoid(box([-1, -1, -1], [1, 1, 1]), [], 0.3), model)
    e = evaluate(model, laid_out, np.zeros((3, 2)), np.zeros((3, 2)))
    assert np.isposinf(e.clearance).all() and e.safe.all()


def test_row_margins_pay_the_slack_by_the_size_of_the_row():
    A, b = np.array([[2.0, -1.0], [0.0, 0.0]]), np.array([5.0, 1.0])
    assert float(row_margin(A, b * 10, np.array([1.0, 1.0]), 0.5)) == 10.0  # the padding row costs nothing
    assert float(row_margin(A[:1], b[:1], np.array([1.0, 1.0]), 0.5)) == 2.5
