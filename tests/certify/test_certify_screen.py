"""The quick test of many points gives the verdicts of the exact one; a screen that trusts too much is caught."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_models import line_model, random_model, random_problem, toy_case

from parc_jax.arrays import x64
from parc_jax.certify import draw as drawing
from parc_jax.certify import screen as screening
from parc_jax.certify.draw import draw, near
from parc_jax.certify.evaluate import anchor, evaluate
from parc_jax.certify.scene import scene
from parc_jax.certify.screen import CHUNK, screen
from parc_jax.problem import reach_avoid
from parc_jax.sets.box import box


def both(model, laid_out, z, k):
    """Which points are safe: by the screen, and one by one."""
    reached, safe, _ = screen(model, laid_out, z, k)
    p0, reaches = anchor(model, laid_out, z, k)
    assert reached == reaches.sum()
    return safe, np.flatnonzero(evaluate(model, laid_out, p0, k).safe)


def proposals(model, laid_out, rng, n):
    z = rng.uniform(laid_out.z_lo, laid_out.z_hi, (n, model.n_p))
    return z, rng.uniform(laid_out.k_lo, laid_out.k_hi, (n, model.n_k))


@pytest.mark.parametrize("seed", [2, 4, 8])
def test_same_verdicts_as_the_exact_test(seed, rng):
    model, problem = toy_case(seed)
    laid_out = scene(problem, model)
    quick, exact = both(model, laid_out, *proposals(model, laid_out, rng, 3 * CHUNK + 17))
    assert len(exact) > 100
    np.testing.assert_array_equal(quick, exact)


@pytest.mark.parametrize("n", [1, CHUNK, CHUNK + 1])
def test_any_number_of_points(n, rng):
    model, problem = toy_case(2)
    laid_out = scene(problem, model)
    np.testing.assert_array_equal(*both(model, laid_out, *proposals(model, laid_out, rng, n)))


def test_what_is_safe_comes_back_as_the_network_says(rng):
    model, problem = toy_case(4)
    laid_out = scene(problem, model)
    z, k = proposals(model, laid_out, rng, 2000)
    _, safe, (p0, path, pattern, number) = screen(model, laid_out, z, k)
    e = evaluate(model, laid_out, p0, k[safe])
    assert e.safe.all()
    np.testing.assert_array_equal(path, e.path)
    np.testing.assert_array_equal(pattern, e.pattern)
    np.testing.assert_array_equal(number, e.bin)


@pytest.mark.parametrize("body", ["disc", "polygon"])
def test_a_glance_loses_no_safe_plan_and_most_of_the_others(body, rng):
    model = random_model(rng)
    problem = random_problem(rng, model, n_obstacles=3, body=body)
    laid_out = scene(problem, model)
    z, k = proposals(model, laid_out, rng, 4000)
    few, knots = screening._few_outputs(model)
    with x64():
        reaches, outside = screening._glances(few, knots, model.tube, laid_out.arrays, z, k)
    p0, expected = anchor(model, laid_out, z, k)
    e = evaluate(model, laid_out, p0, k)
    np.testing.assert_array_equal(reaches, expected)
    assert not (e.safe & ~np.asarray(outside)).any()
    unsafe = expected & ~e.safe
    assert (unsafe & np.asarray(outside)).sum() < 0.5 * unsafe.sum()


@pytest.mark.parametrize("size", [[0.0, 0.0], [0.0, 0.4], [0.3, 0.0]])
def test_a_pole_or_a_wall_has_no_inside(size, rng):
    model = line_model(4, 0.0)
    thin = box([1.8, 1.2], np.add([1.8, 1.2], size))
    laid_out = scene(reach_avoid(box([2.0, 1, -9], [2.5, 2, 9]), [thin], 0.1), model)
    quick, exact = both(model, laid_out, *proposals(model, laid_out, rng, 1500))
    assert 0 < len(exact) < 1500
    np.testing.assert_array_equal(quick, exact)


def test_a_glance_that_strikes_too_much_is_caught(rng, monkeypatch):
    model, problem = toy_case(4)
    laid_out = scene(problem, model)
    right = screening._struck
    wide = lambda corner, sign, radius, p, error: right(corner, sign, radius + 0.05, p, error)  # noqa: E731
    monkeypatch.setattr(screening, "_struck", wide)
    monkeypatch.setattr(screening, "_glances", jax.jit(jax.vmap(screening.glance, (None, None, None, None, 0, 0))))
    quick, exact = both(model, laid_out, *proposals(model, laid_out, rng, 3 * CHUNK))
    assert len(np.setdiff1d(exact, quick)) > 0


def test_without_obstacles_all_that_reaches_is_safe(rng):
    model = line_model(4, 0.0)
    laid_out = scene(reach_avoid(box([-0.5, 1, -9], [0.5, 2, 9]), [], 0.1), model)
    reached, safe, _ = screen(model, laid_out, *proposals(model, laid_out, rng, 300))
    assert reached == len(safe) == 300


def test_points_close_by_are_safe_and_close(rng):
    model, problem = toy_case(4)
    laid_out = scene(problem, model)
    seen = draw(model, laid_out, rng, 500).safe.at(slice(0, 3))
    found = near(model, laid_out, rng, seen, 4000)
    assert len(found.k) > 100 and evaluate(model, laid_out, found.p0, found.k).safe.all()
    span = laid_out.k_hi - laid_out.k_lo
    distance = (np.abs(found.k[:, None] - seen.k[None]) / span).max(axis=2).min(axis=1)
    assert np.median(distance) < 0.1


def test_no_point_close_by_may_be_inside_of_the_domain(rng, monkeypatch):
    model, problem = toy_case(4)
    laid_out = scene(problem, model)
    seen = draw(model, laid_out, rng, 500).safe
    monkeypatch.setattr(drawing, "NEAREST", 1e6)
    monkeypatch.setattr(drawing, "FARTHEST", 1e7)
    assert len(near(model, laid_out, rng, seen, 20).k) == 0


def test_a_screen_that_trusts_its_first_look_is_caught(rng, monkeypatch):
    model, problem = toy_case(4)
    laid_out = scene(problem, model)
    monkeypatch.setattr(screening, "_aparts", lambda *items: jnp.ones(len(items[-1]), bool))
    quick, exact = both(model, laid_out, *proposals(model, laid_out, rng, 6 * CHUNK))
    assert len(np.setdiff1d(quick, exact)) > 0
