"""The Point's task as pure functions: a world without a vase is stepped as the original's."""

import csv
from dataclasses import replace

import jax
import numpy as np
import pytest
from needs import need

need("gymnasium", "mujoco")
pytest.importorskip("mujoco.mjx")

from sims.point import curves, functional, on_device, policy  # noqa: E402
from sims.point.environment import observed  # noqa: E402
from sims.point.manoeuvre import speeds_of  # noqa: E402
from sims.point.world import BINS, GOAL, HAZARD, LEVELS, Level, World  # noqa: E402


@pytest.fixture(autouse=True)
def not_strict():
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


def state_of(worlds) -> functional.Worlds:
    poses = np.array([world.pose for world in worlds])
    ahead, aside, turning = np.array([world.speeds for world in worlds]).T
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    velocity = np.stack([cos * ahead - sin * aside, sin * ahead + cos * aside, turning], axis=1)
    hazards = np.array([world.hazards for world in worlds])
    goals = np.array([world.layout["goal"] for world in worlds])
    return functional.Worlds(poses, velocity, hazards, goals)


def test_a_step_is_the_original_s():
    """Towards goals, through hazards: from the same states, all of 400 steps agree."""
    bare = Level(LEVELS[1].extents, (LEVELS[1].counts[0], 0), False)
    worlds, task = [World(bare, seed) for seed in range(8)], functional.Goal()
    step, draw = jax.jit(task.step), np.random.default_rng(0)
    met, costs, entered = 0, 0.0, 0
    for t in range(400):
        before = state_of(worlds)
        off = before.goal - before.pose[:, :2]
        off = np.arctan2(off[:, 1], off[:, 0]) - before.pose[:, 2]
        action = np.stack([np.ones(8), np.sin(off) + (np.cos(off) < 0)], axis=1)
        action = np.clip(action + draw.normal(size=(8, 2)) / 2, -1, 1)
        now, told = step(before, action, jax.random.PRNGKey(t))
        answers = [world.step(one) for world, one in zip(worlds, action, strict=True)]
        after = state_of(worlds)
        assert not np.any(told.ended)
        here = np.array([info.get("goal_met", False) for _, info in answers])
        assert np.array_equal(np.any(now.goal != before.goal, axis=1), here)
        assert np.allclose(now.pose[:, :2], after.pose[:, :2], atol=1e-9)
        assert np.allclose(now.speeds, [world.speeds for world in worlds], atol=1e-6)
        assert np.allclose(told.reward, [reward for reward, _ in answers], atol=1e-9)
        assert np.array_equal(told.cost, [info["cost"] for _, info in answers])
        seen = np.array([observed(world) for world in worlds])
        goal = slice(12, 12 + BINS)
        assert np.allclose(np.delete(told.seen, np.r_[0:3, goal], 1), np.delete(seen, np.r_[0:3, goal], 1), atol=1e-6)
        assert np.allclose(told.seen[:, :3], seen[:, :3], atol=1e-3)
        assert np.allclose(told.seen[~here, goal], seen[~here, goal], atol=1e-6)
        met, costs, entered = met + here.sum(), costs + np.sum(told.cost), entered + np.sum(told.entered)
    assert met > 20 and costs > 100 and entered >= costs
