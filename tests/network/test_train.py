"""Training: targets in the right order, known functions learned, the key decides, bad data
refused.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import Plant, failing, plant, straight
from turning_bar import Bar

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.labels import Labels
from parc_jax.learning.network.predict import layout_of, trajectories
from parc_jax.learning.network.relu import outputs
from parc_jax.learning.network.train import HELD, tail_of, train, training_arrays
from parc_jax.learning.runs.collect import collect

SETTINGS = {"hidden": (8,), "seeds": 2, "steps": 150}


def bent(key, k, s):
    """Straight, but the second axis bends upward where k_1 exceeds 1/2: one kink."""
    p, q = straight(k, s)
    return p + jnp.maximum(k[1] - 0.5, 0) * s[:, None] * jnp.array([[0.0, 2.0]]), q


@pytest.fixture(scope="module")
def data():
    system: Plant = plant(bent)
    return collect(system, jax.random.key(0), 600, Stage.TRAIN, quiet=True)


def test_targets_are_the_knots_time_major_then_the_goal_states(data):
    k, y = training_arrays(data)
    assert y.shape == (600, 2 * 4 + 1)
    np.testing.assert_allclose(y[:, :8].reshape(-1, 4, 2), data.p[:, 5::5], atol=1e-12)
    np.testing.assert_array_equal(y[:, 8:], data.q)
    np.testing.assert_array_equal(k, data.k)


@pytest.mark.slow
def test_a_function_with_a_kink_is_learned_in_raw_units(data):
    net = train(data, key=jax.random.key(1), **SETTINGS)
    k, y = training_arrays(data)
    error = np.abs(outputs(net, k) - y)
    assert error.max() < 0.1 and np.sqrt((error**2).mean()) < 0.02
    assert net.hidden == (8,) and net.n_in == 2 and net.n_out == 9
    held = slice(round(len(k) * (1 - HELD)), None)
    assert 0 < tail_of(net, k[held], y[held]) <= error[held].max()
    np.testing.assert_allclose(outputs(net, k[:4]), [np.asarray(net(x)) for x in k[:4]], atol=1e-12)


def test_failed_runs_are_left_out_and_too_few_are_refused(data):
    broken = collect(plant(failing), jax.random.key(0), 300, Stage.TRAIN, quiet=True)
    k, y = training_arrays(broken)
    assert 200 < len(k) < 300 and np.isfinite(y).all()
    with pytest.raises(InputError, match="at least 10 finite"):
        training_arrays(data.select(slice(0, 5)))


@pytest.mark.parametrize("noise", [0.0, 1e-9])
def test_a_parameter_that_does_not_vary_is_refused_by_its_name(data, noise):
    """Its mean, 0.8 or so, is off by a rounding, and its spread is no more than that."""
    k = np.column_stack([0.8 + noise * data.k[:, 0], data.k[:, 1]])
    still = data.replace(k=k, labels=Labels(("x", "y"), ("q",), ("speed [m/s]", "turn")))
    with pytest.raises(InputError, match=r"axis 0 \(speed \[m/s\]\) is constant\. Leave it out"):
        train(still, key=jax.random.PRNGKey(0), **SETTINGS)


@pytest.mark.parametrize("hidden", [(), (0,), (8, -1)])
def test_what_are_no_layers_is_refused(data, hidden):
    with pytest.raises(InputError, match=r"train: (hidden: )?expected"):
        train(data, hidden, key=jax.random.PRNGKey(0))


@pytest.mark.slow
def test_outputs_are_all_points_at_all_knots_but_the_first_point_at_the_start():
    runs = collect(Bar(), jax.random.PRNGKey(4), 60, quiet=True)
    k, y = training_arrays(runs)
    layout = layout_of(runs)
    assert y.shape == (60, layout.n_offsets + 1) == (60, 5 * 4 - 2 + 1)
    np.testing.assert_array_equal(y[:, :2], runs.p[:, 0, 2:])  # where the second point starts
    at_knots = runs.p[:, :: runs.time.stride]
    np.testing.assert_array_equal(y[:, 2:-1].reshape(60, 4, 4), at_knots[:, 1:])
    np.testing.assert_array_equal(y[:, -1:], runs.q)
    net = train(runs, (6,), key=jax.random.PRNGKey(0), seeds=1, steps=300)
    offsets, q = trajectories(net, layout, k)
    assert np.abs(offsets - at_knots).max() < 0.05 and np.abs(q - runs.q).max() < 0.05
