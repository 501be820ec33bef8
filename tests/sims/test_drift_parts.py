"""Drift parking piece by piece against a plain transcription of its description (drift_oracle)."""

import drift_oracle as oracle
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from parc_jax.common.errors import InputError
from parc_jax.problem.body import Disc, Polygon
from sims.drift_parking import control, line_search, params, scenario, trig, tyre, vehicle


@pytest.mark.slow
def test_trigonometry_agrees_with_the_c_library(rng):
    for size in (1.0, 10.0, 1e3, 1e6):
        x = rng.uniform(-size, size, 20_000)
        sin, cos = jax.jit(trig.sincos)(x)
        assert np.abs(sin - np.sin(x)).max() < 5e-16
        assert np.abs(cos - np.cos(x)).max() < 5e-16
    y, x = rng.normal(size=(2, 20_000)) * 10.0 ** rng.integers(-4, 4, (2, 20_000))
    assert np.abs(jax.jit(trig.arctan2)(y, x) - np.arctan2(y, x)).max() < 1e-15
    assert float(trig.arctan2(jnp.float64(0.0), jnp.float64(0.0))) == 0.0
    assert np.abs(trig.sincos(jnp.asarray([1e12, 1e20, 1e300]))).max() <= 1.0


@pytest.mark.slow
def test_tyre_force_is_the_stitched_brush_model(rng):
    alpha = np.concatenate(
        [rng.uniform(-3.5, 3.5, 2000), rng.normal(size=2000) * 0.2, [0.0, np.pi / 2, -np.pi / 2]]
    )
    fx = rng.uniform(-0.999, 0.999, alpha.size) * params.GRIP_FRONT
    capacity = tyre.lateral_capacity(params.GRIP_FRONT, fx)
    threshold = tyre.sliding_threshold(capacity, params.STIFFNESS_FRONT)
    force = tyre.lateral_force(alpha, np.tan(alpha), capacity, threshold, params.STIFFNESS_FRONT)
    want = [
        oracle.tyre(a, params.STIFFNESS_FRONT, params.GRIP_FRONT, f)
        for a, f in zip(alpha, fx, strict=True)
    ]
    np.testing.assert_allclose(force, want, atol=1e-8)  # of 5000 N
    assert min(want) < -5000 and max(want) > 5000


def test_steering_is_limited_per_evaluation():
    step, top = params.STEER_STEP, params.STEER_MAX
    cases = (
        (0.0, 1.0, step),
        (0.0, -1.0, -step),
        (0.1, 0.105, 0.105),
        (top, 2.0, top),
        (0.3, np.nan, 0.3 - step),
    )
    steer, zero = jax.jit(control.steer_into_slip), np.float64(0.0)
    for last, want, got in cases:
        z = vehicle.State(*[zero] * 5, np.float64(want), *[zero] * 2)
        assert float(steer(z, np.float64(last))) == pytest.approx(got, abs=1e-16)


def _search_cases():
    """Costs that are smooth, or have a pole in (0, 3) as a tangent has; the plain search ends in
    every possible way.
    """
    rng = np.random.default_rng(8)
    n = 3000
    slope, curve, cubic = rng.normal(size=(3, n)) * np.array([1.0, 3.0, 1.0])[:, None]
    pole = rng.uniform(0.05, 3.0, n)
    strength = np.where(rng.random(n) < 0.5, 0.0, 10.0 ** rng.uniform(-6, 0, n))

    def cost_at(e):
        return (
            100.0
            - slope * e
            + curve * e**2
            + cubic * e**3
            + strength * (np.pi / 2 / (1 - e / pole)) ** 2
        )

    return cost_at, cost_at(0.0), np.full(n, 1.0)


def _disagreements():
    cost_at, cost, expected = _search_cases()
    length, accepted = jax.jit(
        lambda: line_search.first_accepted(
            cost_at, jnp.asarray(cost), jnp.asarray(expected), cost > 0
        )
    )()
    trials = np.array([cost_at(e) for e in line_search.LENGTHS[:-1]])
    passes = (cost - trials) / (
        line_search.LENGTHS[:-1, None] * (1 + line_search.LENGTHS[:-1, None] / 2)
    ) > 0.1
    found = passes.any(axis=0)
    want = np.where(found, line_search.LENGTHS[np.argmax(passes, axis=0)], line_search.LENGTHS[-1])
    assert found.any() and not found.all() and (want[found] < 1).any() and (want[found] == 1).any()
    return int((np.asarray(accepted) != found).sum() + (np.asarray(length) != want)[found].sum())


@pytest.mark.slow
def test_skipping_search_is_the_plain_search():
    assert len(line_search.LENGTHS) == 60
    assert _disagreements() == 0


def test_scene():
    disc, decagon = scenario.problem(), scenario.problem("decagon")
    assert isinstance(disc.body, Disc) and disc.body.radius == pytest.approx(2.35369, abs=5e-6)
    assert isinstance(decagon.body, Polygon) and decagon.body.vertices.shape == (10, 2)
    edges = 0.5 * (decagon.body.vertices + np.roll(decagon.body.vertices, -1, axis=0))
    np.testing.assert_allclose(
        np.hypot(*edges.T), disc.body.radius, rtol=1e-12
    )  # faces touch the circle
    assert (
        np.abs(edges - [disc.body.radius, 0.0]).max(axis=1).min() < 1e-12
    )  # one face normal along +x
    inside = np.array([30.5, -16.0, -np.pi])
    assert disc.goal.contains(inside) and not disc.goal.contains(
        inside + np.array([0, 0, 2 * np.pi])
    )
    assert [bool(o.contains(np.array([25.0, -16.0]))) for o in disc.obstacles] == [True, False]
    with pytest.raises(InputError, match="disc"):
        scenario.problem("square")


def test_what_several_read_is_the_same_bits():
    x = np.random.default_rng(0).normal(size=256) * 10.0 ** np.arange(-128, 128)
    x[:2] = 0.0, np.nan
    np.testing.assert_array_equal(trig.once(x)[0], x)
