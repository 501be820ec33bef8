"""The CommonRoad BMW: what is compiled is the package's own code, the outline is rigid; and a scene
that asks something.
"""

import importlib.util
import math

import jax
import numpy as np
import pytest

import sims
from parc_jax.common.errors import InputError
from sims.foreign.kerb import params as c

NEEDED = pytest.mark.needs("vehiclemodels")
K = (7.0, 0.34)
EVERY = round(c.RECORD / c.STEP)  # steps from record to record


@pytest.mark.night
@NEEDED
def test_compiled_code_gives_the_bits_of_the_package_itself(monkeypatch):
    """Where numba is absent the same code runs as Python: nothing of it is compiled here."""
    from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb

    from sims.foreign.kerb import drive, model

    p = model.standard()
    start = model.rolling(np.zeros(2), 0.0, K[0], p)
    orders = drive.Orders(*K, 0.0, 1.0)
    fast = drive.drives()(model.right_hand_side(), start, orders, p, 400, EVERY)
    monkeypatch.setattr(drive, "compiler", lambda: lambda function: function)
    drive_in_python = drive.drives.__wrapped__()
    slow = drive_in_python(vehicle_dynamics_mb, start, orders, p, 400, EVERY)
    np.testing.assert_array_equal(fast, slow)


@pytest.mark.night
@NEEDED
def test_the_outline_is_rigid_and_of_the_true_size():
    from sims.foreign.kerb.system import drive

    p, q = drive(np.random.default_rng(4), K)
    front_left, rear_left, rear_right, front_right = np.moveaxis(p[:, 1:], 1, 0)
    np.testing.assert_allclose(np.linalg.norm(front_left - rear_left, axis=1), 4.508, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(front_left - front_right, axis=1), 1.61, atol=1e-12)
    ahead = front_right - rear_right
    assert math.atan2(ahead[-1, 1], ahead[-1, 0]) == pytest.approx(q[0], abs=1e-12)


@pytest.mark.night
@NEEDED
def test_runs_through_the_public_door_have_their_points():
    import parc_jax as pj

    runs = pj.learning.collect(sims.load("kerb", workers=0), jax.random.PRNGKey(1), n=3, quiet=True)
    assert runs.p.shape == (3, 201, 10) and not runs.failed.any()
    assert len(np.unique(runs.q)) == 3
    assert (runs.p[:, 0, :2] == 0).all()


def test_the_bay_is_between_the_cars_and_the_kerb():
    scene = sims.kerb.problem()
    assert len(scene.obstacles) == 3 and scene.goal.n == 11
    names = ("centre", "front left", "rear left", "rear right", "front right")
    assert sims.rectangle.POINTS == names


def test_without_the_package_the_line_that_installs_it_is_said(monkeypatch):
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "vehiclemodels" else real(name)
    )
    with pytest.raises(InputError, match=r"pip install 'parc_jax\[cars\]'"):
        sims.load("kerb")
