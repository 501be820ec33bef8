"""The Point's task as pure functions: where no vase is touched a step is the original's."""

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
from sims.point.ppo import keys_of  # noqa: E402
from sims.point.sensing import OUTLINE  # noqa: E402
from sims.point.together import driver_of  # noqa: E402
from sims.point.world import HAZARD, LEVELS, VASE, World  # noqa: E402


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
    vases = np.array([world.vase_boxes()[0] for world in worlds])
    return functional.Worlds(poses, velocity, hazards, vases, goals)


@pytest.mark.night
def test_a_step_is_the_original_s():
    """Towards goals, through hazards: from the same states, each of 250 steps agrees."""
    worlds, step = [World(LEVELS[1], seed) for seed in range(8)], jax.jit(functional.Goal().step)
    drive, of_goal = driver_of("Point", blind=True)(range(8)), np.isin(np.arange(60), range(12, 28))
    met, costs, entered, compared = 0, 0, 0, 0
    for t in range(250):
        before = state_of(worlds)
        action = np.clip(drive(worlds), -1, 1)
        now, told = jax.device_get(step(before, action, keys_of(0, t, 1)[0]))
        rewards, infos = zip(*(w.step(a) for w, a in zip(worlds, action, strict=True)), strict=True)
        seen, after = np.array([observed(world) for world in worlds]), state_of(worlds)
        away = np.linalg.norm(after.vase.mean(axis=1) - after.pose[:, :2], axis=1)
        clear = (away > OUTLINE + 2 * VASE) & (
            abs(after.vase - before.vase).max(axis=(1, 2)) < 1e-7
        )
        same = np.array(["goal_met" not in info for info in infos])
        other = ~same[:, None] & of_goal
        assert np.array_equal((now.goal == before.goal).all(axis=1), same) and not told.ended.any()
        for found, true, within in (
            (now.pose[:, :2], after.pose[:, :2], 1e-9),
            (now.velocity, after.velocity, 1e-6),
            (told.reward, np.array(rewards), 1e-9),
            (told.cost, np.array([info["cost"] for info in infos]), 0),
            (np.where(other, seen, told.seen), seen, 1e-6),
        ):
            assert np.allclose(found[clear], true[clear], atol=within)
        paths = np.array([world.trace[-2:] for world in worlds])[..., None, :2]
        gaps = np.linalg.norm(paths - before.hazards[:, None], axis=-1) - HAZARD
        assert told.entered[clear & (gaps < 0).any(axis=(1, 2))].all()
        compared += clear.sum()
        met, costs = met + (~same).sum(), costs + told.cost.sum()
        entered = entered + told.entered.sum()
    assert met > 20 and costs > 30 and costs <= entered < 2 * costs and compared > 1000


def test_goals_keep_the_original_s_distances():
    worlds, seen = functional.drawn(range(8))
    world = World(LEVELS[1], 3)
    assert np.array_equal(seen[3], observed(world)) and np.array_equal(worlds.pose[3], world.pose)
    draws = jax.jit(jax.vmap(functional.new_goal))
    for t in range(100):
        places, found = jax.device_get(draws(keys_of(0, t, 8)[1], worlds))
        assert found.all() and (abs(places) <= 1.195).all()
        assert (np.linalg.norm(places - worlds.pose[:, :2], axis=1) >= 0.705).all()
        assert (np.linalg.norm(places - worlds.vase.mean(axis=1), axis=1) >= 0.455).all()
        assert (np.linalg.norm(places[:, None] - worlds.hazards, axis=2) >= 0.485).all()
    everywhere = np.stack(np.meshgrid(*2 * [np.linspace(-1.2, 1.2, 8)]), axis=-1).reshape(1, -1, 2)
    nowhere = np.broadcast_to(everywhere, (8, 64, 2))
    assert not np.asarray(draws(keys_of(0, 0, 8)[1], worlds._replace(hazards=nowhere))[1]).any()


@pytest.mark.slow
def test_training_goes_on_from_what_was_saved(tmp_path, monkeypatch):
    out = tmp_path / "p.csv"
    size = {"steps": 512, "robots": 16, "horizon": 8, "parts": 2, "pool": 16}
    options = on_device.Options(**size, bare=True, limit=25.0, every=3, out=out)
    on_device.train(options)
    kept = policy.Trained(out.with_suffix(".policy"))
    on_device.train(replace(options, steps=1024))
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["steps"] for row in rows] == ["384", "512", "768", "1024"]
    later, seen = policy.Trained(out.with_suffix(".policy")), np.ones(policy.SEEN)
    assert later.scale.n == pytest.approx(kept.scale.n + 512)
    assert not np.allclose(later.mean(seen), kept.mean(seen))
    monkeypatch.setattr(curves, "WINDOW", 384)
    assert curves.rates(out)["steps"].tolist() == [384, 512, 768, 1024]


@pytest.mark.slow
def test_behind_the_shield_nothing_is_entered(tmp_path):
    """By a policy that does not learn to keep clear; robots that stand are left."""
    out = tmp_path / "p.csv"
    size = {"steps": 4096, "robots": 16, "horizon": 32, "parts": 2, "pool": 16}
    on_device.train(on_device.Options(**size, penalty=0.01, patience=50, out=out))
    (row,) = csv.DictReader(out.read_text().splitlines())
    assert {row[of] for of in ("contact", "entered", "left", "uncertified")} == {"0"}
    assert int(row["episodes"]) >= int(row["stood"]) > 0
