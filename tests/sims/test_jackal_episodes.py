"""The Jackal of episodes: its thinking time is a part of the run, and the model that comes along is
of the robot as it is now.
"""

import jax
import numpy as np
import pytest
from drawn_keys import drawn_keys

import parc_jax as pj
import sims
from parc_jax.common.keys import Stage, key_of
from parc_jax.learning.bound.measure import allowance, score_arrays
from parc_jax.learning.runs.collect import simulate_rows
from parc_jax.learning.runs.law import law_of
from parc_jax.safe_set.verdict.outline import require_same
from sims.barn import learn as clutter
from sims.barn.driver import MODEL
from sims.jackal import Driven, learn, params
from sims.jackal.before import before
from sims.jackal.floor import draw


@pytest.fixture(scope="module")
def robot():
    return learn.robot()


def test_the_command_before_goes_on_until_the_new_one_begins(robot):
    """Two runs that differ in the new command alone are one until it begins."""
    k = np.array([[1.0, 0.0, 1.5, 0.5, 0.0, -1.0], [1.0, 0.0, 1.5, 0.5, 1.8, 1.0]])
    poses = robot.poses(np.repeat(drawn_keys(3, 1), 2, axis=0), k)
    waits = robot.waits
    assert waits == 3
    np.testing.assert_array_equal(poses[0, : waits + 1], poses[1, : waits + 1])
    assert np.abs(poses[0, waits + 2] - poses[1, waits + 2]).max() > 1e-4


def test_the_ramp_of_the_command_begins_at_the_speed_then(robot):
    """From 1 m/s a command of 1.8 is under way for 60 ms: the next ramp begins faster."""
    driven = Driven(robot, (0.0, 0.0, 0.0), jax.random.PRNGKey(0))
    for _ in range(2):
        k = driven.apply(1.8, 0.0, learn.HELD)
    assert k.tolist()[2:] == [1.8, 0.0, 1.8, 0.0]
    at_start = driven.measured[0]
    k = driven.begin(0.0, 0.0)
    assert k.tolist() == [*driven.measured, 1.8, 0.0, 0.0, 0.0]
    driven.drive(learn.THINKS)
    then = driven.speeds[0]
    assert then > at_start + 0.1
    driven.drive(params.TICK)  # the ramp is at most 0.06 m/s a tick, from the speed measured then
    assert abs(driven._robots.set_point[0, 0] - then) <= 0.06 + params.SENSED[0] + 1e-9


def test_what_was_driven_before_leads_to_the_command_that_is_told(robot):
    n = 40
    speeds = np.random.default_rng(1).uniform([-0.9, -1.7], [1.9, 1.7], (n, 2))
    command = np.random.default_rng(2).uniform([-0.8, -1.3], [1.8, 1.3], (n, 2))
    path = before(robot, draw(robot.floor, drawn_keys(5, n)), speeds, command)
    beyond = (path[-1] - speeds) * (path[-1] - command)
    slipped = np.abs(command - speeds) <= 0.4
    assert (beyond <= 1e-12)[~slipped].all()  # between the two, on its way
    assert np.abs(np.diff(path, axis=0)).max() <= params.TICK * params.RAMP[1] + 1e-9


def test_bad_thinking_times_are_refused():
    for thinking, plant in ((0.05, "mujoco"), (-0.02, "mujoco"), (0.06, "twin")):
        with pytest.raises(pj.InputError, match="whole number of ticks"):
            sims.load("jackal", thinking=thinking, plant=plant)


@pytest.mark.parametrize("path", [learn.MODEL, MODEL])
def test_a_model_that_comes_along_is_of_the_robot_as_it_is(robot, path):
    model = pj.load(path)
    require_same(robot, model)
    assert model.claim.law == law_of(robot) and model.claim.kind == "pac"
    assert any(one.startswith("UNSEEN(1 look; ") for one in model.claim.assumptions)
    assert path.stat().st_size < 1_000_000


@pytest.mark.slow
@pytest.mark.parametrize(("path", "key"), [(learn.MODEL, 0), (MODEL, clutter.BOUND_KEY)])
def test_the_worst_runs_of_its_claim_are_those_of_the_robot(robot, path, key):
    """Whoever changes the code of the plant learns its model anew."""
    model = pj.load(path)
    evidence = model.claim.evidence
    rows = np.array([run["row"] for run in evidence["worst"]])
    k, runs = simulate_rows(robot, key_of(key), Stage(evidence["stage"]), rows)
    told = [[float.fromhex(x) for x in run["k"]] for run in evidence["worst"]]
    np.testing.assert_array_equal(k, told)
    slack = allowance(model.net, model.domain, model.layout)
    now = score_arrays(model.net, slack, model.tube, k, np.asarray(runs.p), np.asarray(runs.q))[0]
    then = np.array([float.fromhex(run["score"]) for run in evidence["worst"]])
    scale = evidence.get("bin_scale", [evidence.get("scale")] * model.tube.n_bins)
    then /= np.array([float.fromhex(scale[i]) for i in model.tube.bin_of(np.array(told))])
    assert (now <= 1.01 * then).all() and (now > 0.9 * then).any()
