"""Drift parking piece by piece against a plain transcription of its description (drift_oracle)."""

import drift_oracle as oracle
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from parc_jax.common.errors import InputError
from parc_jax.problem.body import Disc, Polygon
from sims.drift_parking import control, ilqr, line_search, params, scenario, trig, tyre, vehicle
from sims.drift_parking.plan import reference_plan
from sims.drift_parking.plant_ode import newton_euler


def test_constants_are_those_of_the_description():
    assert params.STEER_MAX == 0.6632251157578453
    assert params.STEER_STEP == 0.017453292519943295
    np.testing.assert_allclose(
        [
            params.GRIP_FRONT,
            params.GRIP_REAR,
            params.BRAKE_MAX,
            params.DRIVE_MAX,
            params.FRONT_ARM,
            params.REAR_ARM,
        ],
        [5163.4935, 10483.4565, 5162.4935, 7684.0, 1.608, 0.792],
        rtol=1e-14,
    )


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


@pytest.mark.parametrize("brake", [0.0, -params.BRAKE_MAX])
def test_rates_of_the_state(rng, brake):
    n = 400
    z = rng.uniform(-1, 1, (8, n)) * np.array([30, 10, 3, 2, 10, 1.5, 12, 6])[:, None]
    z[6, :50] = -np.abs(z[6, :50])  # some roll backwards
    steer = rng.uniform(-1, 1, n) * params.STEER_MAX
    drive = rng.uniform(0, 1, n) * params.DRIVE_MAX if brake == 0.0 else np.zeros(n)
    rate, slip = jax.jit(
        lambda z, s, d: vehicle.rates(
            newton_euler, vehicle.State(*z), s, *([d] if brake == 0.0 else []), brake=brake
        )
    )(z, steer, drive)
    want = [oracle.rates(z[:, i], drive[i], brake, steer[i]) for i in range(n)]
    np.testing.assert_allclose(
        np.stack(rate, axis=1), np.array([w[0] for w in want]), rtol=1e-9, atol=1e-9
    )
    np.testing.assert_allclose(slip.rear, [w[1] for w in want], atol=1e-15)
    np.testing.assert_allclose(np.broadcast_to(slip.threshold, n), [w[2] for w in want], atol=1e-15)


def test_plan_of_the_description():
    plan = jax.jit(reference_plan)(jnp.float64(10.0))
    table = {
        18: (6.895, 0.0, 0.0, 8.0, 5.0, 0.0),
        19: (7.695, 0.0, 0.0, 8.5, 5.0, 0.663225116),
        20: (8.545, 0.0, 0.276705326, 9.0, 5.0, -0.242856906),
        21: (9.410764650, 0.245869011, 0.183800267, 9.5, 5.0, -0.229848073),
        30: (19.251483614, -1.867425737, -0.642294701, 14.0, 5.0, -0.154741700),
        58: (-0.040805125, -41.951195797, -3.162381507, 28.0, 5.0, -0.076427136),
        63: (-0.040805125, -41.951195797, -3.162381507, 28.0, 5.0, -0.076427136),
    }
    for i, row in table.items():
        np.testing.assert_allclose([field[i] for field in plan], row, atol=6e-10)


@pytest.mark.slow
def test_plan_is_elementwise_over_lanes():
    v = np.linspace(9, 11, 5)
    plan = reference_plan(jnp.asarray(v))
    for lane, speed in enumerate(v):
        states, inputs = oracle.plan(speed)
        np.testing.assert_allclose(
            np.stack([f[:, lane] for f in plan[:4]], axis=1), states, atol=1e-12
        )
        np.testing.assert_allclose(
            np.stack([f[:, lane] for f in plan[4:]], axis=1), inputs, atol=1e-12
        )


def test_start_from_rest():
    state, law = control.after_start()
    row = (0.000088322, 0, 0, -0.001923703, 0.126496552, -0.141322338, 0.026496552, -0.014132234)
    np.testing.assert_allclose(state, row, atol=6e-10)
    assert law == (0.0, params.DRIVE_MAX / params.MASS, True)


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


def _driven(v, rng):
    """38 solves of the plain controller for a car that lags behind its commands: poses, commands,
    one gain.
    """
    controller, pose = oracle.Controller(v), np.array([0.0, 0.0, 0.0, 0.1])
    command, rows = controller.U[0], []
    for j in range(1, 39):
        applied = (
            command * [0.8, 1.0]
            if abs(command[1]) < 0.5
            else [0.8 * command[0], 0.5 * np.sign(command[1])]
        )
        pose = oracle.kinematic(pose, applied) + 0.01 * rng.normal(size=4)
        command = controller.solve(j, pose)
        rows.append((*pose, *command, controller.K[2][1, 2]))
    return np.array(rows)


@pytest.mark.night
def test_controller_solves_as_described(rng):
    """The same command and gains after each of 38 warm-started solves, six cars side by side."""
    v = rng.uniform(9, 11, 6)
    want = np.stack([_driven(speed, rng) for speed in v], axis=-1)  # (38, 7, lanes)
    plan = reference_plan(jnp.asarray(v))

    def follow(memory, step):
        j, pose = step
        memory = ilqr.solve(memory, plan, j, ilqr.Pose(*pose))
        return memory, jnp.stack([*memory.command, memory.gains.steer.yaw[2]])

    steps = jnp.arange(1, 39), jnp.asarray(want[:, :4])
    _, got = jax.jit(lambda steps: jax.lax.scan(follow, ilqr.first(plan), steps))(steps)
    np.testing.assert_allclose(got, want[:, 4:], rtol=1e-8, atol=1e-8)
    assert np.abs(want[:, 5]).max() > 0.2  # it did steer


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


@pytest.mark.slow
def test_skipping_without_a_margin_would_be_noticed(monkeypatch):
    monkeypatch.setattr(line_search, "MARGIN", 0.0)
    assert _disagreements() > 0


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
