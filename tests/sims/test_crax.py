"""CRAX's Goal tasks: their worlds are the original's, the shield keeps off what costs."""

import numpy as np
import pytest
from needs import need

import parc_jax as pj

need("gymnasium")
from sims import crax  # noqa: E402
from sims.crax import judge, sensing, world  # noqa: E402
from sims.crax.environment import CraxGoal  # noqa: E402
from sims.crax.guide import CraxGuide  # noqa: E402
from sims.crax.original import towards  # noqa: E402
from sims.point.compared import parted  # noqa: E402

# of crax-bench 0.1.0 in float64: level 1, key 0. `sims.crax.compared` compares whole episodes
GOALS = (0.0, 0.0, 0.0, 0.0, 0.0005729, 0.0032084, 0.0026355, 0.0, 0.0, 0.0025309, 0.0030301)
HAZARDS = (0.5202799, 0.1249405, 0.1080072, 0.3476639, 0.4772232, 0.1295593, 0.4361604, 0.687496)
WAYS = (-0.6558259, 0.7549122, -0.9691259, 0.2465664, 0.6342343, -0.7731409)


def test_a_world_is_the_original_s_of_the_same_key():
    seen = world.World(world.LEVELS[1], 0).observation()
    assert np.allclose(seen[12:23], GOALS, atol=1e-7)
    assert np.allclose(seen[28:36], HAZARDS, atol=1e-7)
    assert np.allclose(seen[44:50], WAYS, atol=1e-7) and seen.shape == (62,)


def test_a_world_keeps_what_its_law_says():
    """Apart from each other as drawn; goals that were met are elsewhere, and free."""
    true = world.World(world.LEVELS[3], 3)
    keep = np.array([kind.keepout for kind in true.level.hazards])
    assert len(true.hazards) == len(keep) == 20
    assert (np.abs(true.hazards) <= world.EXTENTS - keep[:, None] + 1e-6).all()
    before = true.goals.copy()
    true.data.qpos[:2] = before[1]
    gained, _ = true.step(np.zeros(2))
    assert gained == true.met == 1 and (true.goals[0] == before[0]).all()
    assert np.linalg.norm(true.goals[1] - before[1]) > true.level.goal
    round_ = ~true.square
    away = np.linalg.norm(true.goals[1] - true.hazards[round_], axis=1)
    assert (away >= true.sizes[round_] + true.level.goal).all()


def test_steps_that_differ_have_their_own_numbers():
    one, free = np.zeros((100, 8)), np.arange(100) > 50
    other = one.copy()
    other[[20, 60], 3] = 1e-3
    assert parted(one, other).endswith("above 1e-9 in 2 of 100 steps, the first is step 20")
    assert parted(one, other, free).endswith("above 1e-9 in 1 of 49 steps, the first is step 60")
    assert parted(one, one, free).endswith("never above 1e-9")


def test_cost_is_graded_by_depth_and_by_touch():
    true = world.World(world.LEVELS[3], 0)
    flat, solid = (np.flatnonzero(true.square & (true.solid == s))[0] for s in (False, True))
    side = true.sizes[flat] * np.array([0.5, 0.0])
    true.data.qpos[:2] = true.hazards[flat] + side
    _, info = true.step(np.zeros(2))
    assert info["cost"] == pytest.approx(2.0 * 0.5, abs=1e-3) and info["touched"] == 0
    true.data.qpos[:2] = true.hazards[solid]
    true.data.qvel[:] = 0.0
    assert true.step(np.zeros(2))[1]["touched"] == 1


def test_the_judge_measures_from_the_outline():
    true = world.World(world.LEVELS[3], 0)
    box = np.flatnonzero(true.square & true.solid)[0]
    disc = np.flatnonzero(~true.square & true.solid)[0]
    for which in (box, disc):
        at = true.hazards[which] + [true.sizes[which] + 0.3, 0.0]
        away, towards_it = (
            judge.edges(np.array([[*at, turn]]), true)[0, which] for turn in (0, np.pi)
        )
        assert away == pytest.approx(0.2) and towards_it == pytest.approx(0.15)
    turned = judge.edges(np.array([[*at, 3 * np.pi / 4]]), true)[0, disc]
    assert 0.15 < turned < 0.2
    # the corner of its arrow is the farthest point of the robot
    assert sensing.OUTLINE >= np.hypot(judge.ARROW + judge.HALF, judge.HALF)


def test_obstacles_hold_what_costs():
    """Each of them grown by the robot's outline: the middles from which something costs."""
    true = world.World(world.LEVELS[3], 0)
    angle = np.linspace(0, 2 * np.pi, 100)
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for obstacle, place, size, solid, square in zip(
        sensing.obstacles(true)[len(world.WALLS) :],
        true.hazards,
        true.sizes,
        true.solid,
        true.square,
        strict=True,
    ):
        needed = size if solid else size - sensing.OUTLINE
        edge = place + needed * ways * (1 - 1e-9)
        assert obstacle.contains(edge).all()
        if solid and square:
            assert obstacle.contains(place + size * (judge.SQUARE * (1 - 1e-9))).all()
    # as a batch has them: the same sets, counter-clockwise
    walls, pieces = len(world.WALLS), len(world.WALLS) * sensing.PIECES
    batch, joined = sensing.corners(true), sensing.corners(true)[:pieces]
    joined = (
        joined.reshape(sensing.PIECES, walls, -1, 2).transpose(1, 0, 2, 3).reshape(walls, -1, 2)
    )
    for obstacle, corners in zip(sensing.obstacles(true), [*joined, *batch[pieces:]], strict=True):
        assert np.allclose((corners @ obstacle.A.T).max(axis=0), obstacle.b, atol=1e-12)
    for corners in batch:
        x, y = (np.roll(corners, -1, axis=0) - corners).T
        assert (x * np.roll(y, -1) - y * np.roll(x, -1) >= -1e-12).all()


@pytest.mark.night
def test_behind_the_shield_nothing_costs():
    """A policy that wants nothing but the goal, in a world in which it costs without; a driver that
    knows the map meets goals.
    """
    env, without = CraxGoal(3), 0.0
    seen, _ = env.reset(seed=1)
    draw = np.random.RandomState(0)
    for _ in range(60):
        seen, *_, info = env.step(towards(seen, draw))
        without += info["cost"]
    assert without > 0
    shielded, draw = pj.drive.Shield(env, crax.model(), **crax.door()), np.random.RandomState(0)
    seen, _ = shielded.reset(seed=1)
    true, guide, cost, changed = env.world, CraxGuide([0]), 0.0, 0
    for i in range(160):
        action = towards(seen, draw) if i < 60 else guide([true])[0]
        seen, *_, info = shielded.step(action)
        cost, changed = cost + info["cost"], changed + info["shield"]["changed"]
    path = np.array(true.trace)
    found = judge.judge(path, true)
    assert cost == 0 and not found.ever and changed > 0 and true.met >= 1
    assert not pj.drive.left_tube(shielded.commitments, path[:, :2], path[:, 2])
