"""Safety-Gymnasium's Car: its shield keeps it off hazards."""

import jax
import numpy as np
import pytest
from needs import need

import parc_jax as pj

need("gymnasium")
from sims import car  # noqa: E402
from sims.car import manoeuvre, sensing, ways  # noqa: E402
from sims.car.guide import CarGuide  # noqa: E402
from sims.point import judge, world  # noqa: E402


def towards(seen: np.ndarray) -> np.ndarray:
    """Both wheels on, turned to the sector of the lidar that shows the goal in front."""
    sector = (int(np.argmax(seen[-48:-32])) - 4) % 16 - 8  # its front is where the twelfth begins
    return np.array([1.0, 1.0]) if sector in (-1, 0) else np.sign(sector + 0.5) * np.array([1, -1])


@pytest.mark.night
def test_its_manoeuvres_begin_with_the_speed_given():
    robot, draw = car.system(1), np.random.default_rng(0)
    k = draw.uniform(robot.domain.lo, robot.domain.hi, (256, 5))
    path = robot.rollout_batch(jax.random.split(jax.random.PRNGKey(0), 256), k).p
    moved = path[:, 2] - path[:, 0]  # a step of the environment, without a turn to speak of
    assert np.corrcoef(moved[:, 1], k[:, 1])[0, 1] > 0.9


def test_a_way_to_the_goal_takes_its_length_and_its_turns():
    half, goal, fast, turning = 2.4, np.array([1.0, 0.0, 0.3]), 0.75, 1.3
    # more than any way takes, so that nothing of it is left
    guess = np.linalg.norm(ways.steps(half).places - goal[:2], axis=1) / fast + 3.0
    axes = np.array([[1.0, -1.0, 0.0], [0.0, 0.0, 1.0]])  # nose first, tail first, across
    places, straight = np.array([[-1.0], [0.0]]) + 0 * axes, (2.0 - goal[2]) / fast

    def found(discs: np.ndarray) -> np.ndarray:
        times = ways.times(guess, ways.dear(discs, half), goal, (fast, turning), half)
        with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
            return np.asarray(jax.jit(ways.read, static_argnums=3)(times, places, axes, half))

    free, round_one = found(np.zeros((0, 3))), found(np.array([[0.0, 0.0, 0.5]]))
    late = ways.AHEAD / fast  # of the last step
    np.testing.assert_allclose(free, straight + np.array([0, 0, np.pi / 2 / turning]), atol=late)
    # by tangents: 30 degrees off and 60 more on the way
    least = (np.sqrt(3) + np.pi / 6 - goal[2]) / fast + np.pi / 2 / turning
    assert least < round_one[0] < least + 1.0 and np.ptp(round_one[:2]) < 1e-5


def test_an_outline_of_the_robot_is_within_its_circle():
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(world.CAR.xml))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for i in range(1, model.ngeom):
        half = model.geom_aabb[i, 3:]
        signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
        corners = data.geom_xpos[i] + signs * half @ data.geom_xmat[i].reshape(3, 3).T
        assert np.linalg.norm(corners[:, :2], axis=1).max() <= sensing.OUTLINE


@pytest.mark.night
def test_behind_the_shield_nothing_is_touched():
    """A policy that wants nothing but the goal, in a world in which it touches without."""
    bare, touched = car.CarGoal(1), 0.0
    shielded = pj.drive.Shield(car.CarGoal(1), car.model(), **car.door())
    for env in (bare, shielded):
        seen, _ = env.reset(seed=5)
        cost = 0.0
        for _ in range(120):
            seen, *_, info = env.step(towards(seen))
            cost += info["cost"]
        true = env.unwrapped.world
        found = judge.judge(np.array(true.trace), true.hazards)
        assert found.contact == cost
        touched = touched if env is shielded else cost
    assert touched > 0 and cost == 0 and not found.ever
    path = np.array(true.trace)
    assert not pj.drive.left_tube(shielded.commitments, path[:, :2], path[:, 2])


@pytest.mark.night
def test_the_driver_meets_goals_round_hazards():
    true, drive, met = world.World(world.LEVELS[1], 0, world.CAR), CarGuide([5]), 0
    for _ in range(250):
        _, info = true.step(drive([true])[0])
        met += info.get("goal_met", False)
        assert info["cost_hazards"] == 0
    assert met >= 2
    assert manoeuvre.STEP == world.CAR.step == pytest.approx(0.04)
