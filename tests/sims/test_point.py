"""Safety-Gymnasium's Point: its worlds are the original's, its shield keeps it off hazards."""

import runpy
import sys
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import MagicMock

import jax
import numpy as np
import pytest
from needs import need

import parc_jax as pj

need("gymnasium")
from in_step import in_step_as_alone  # noqa: E402

from parc_jax.common.keys import Stage, key_data, stream  # noqa: E402
from sims import point  # noqa: E402
from sims.point import (  # noqa: E402
    curves,
    episodes,
    film,
    guide,
    judge,
    lidar,
    manoeuvre,
    policy,
    ppo,
    sensing,
    together,
    train,
    world,
)
from sims.point.ours import towards  # noqa: E402

# of safety-gymnasium 1.0.0 on MuJoCo 2.3.3: SafetyPointGoal1-v0, reset(seed=3), then three steps of
# the action (1.0, 0.3). `sims.point.compared` compares whole episodes
AGENT, GOAL = (0.11175539, 0.45792521), (-0.49761527, -0.10112951)
HAZARDS = ((1.03737996, 1.04621375), (-0.29575588, 1.15205284))  # the first, the last
JOINTS = (0.00518353, -0.00081618, 0.04961976)
SPEEDS = (0.16358299, 0.00190096, 0.20067437)
REWARDS = (0.00018746, -0.00013917, -0.00038869)


@pytest.fixture(scope="module")
def shielded():
    return pj.drive.Shield(point.PointGoal(1), point.model(), **point.door())


def test_a_world_is_the_original_s_of_the_same_seed():
    env = point.PointGoal(1)
    seen, _ = env.reset(seed=3)
    true = env.world
    assert np.allclose(true.start, AGENT, atol=1e-8)
    assert np.allclose(true.layout["goal"], GOAL, atol=1e-8)
    assert np.allclose(true.hazards[[0, -1]], HAZARDS, atol=1e-8)
    rewards = [env.step([1.0, 0.3])[1] for _ in range(3)]
    assert np.allclose(rewards, REWARDS, atol=1e-7) and seen.shape == (60,)
    assert np.allclose(true.data.qpos[:3], JOINTS, atol=1e-7)
    assert np.allclose(true.data.qvel[:3], SPEEDS, atol=1e-6)
    assert np.allclose(true.trace[-1], true.pose, atol=1e-9) and len(true.trace) == 7


def test_the_judge_and_the_environment_tell_the_same_cost():
    """A robot that wants nothing but the goal."""
    env, cost, depth, draw = point.PointGoal(1), 0.0, 0.0, np.random.RandomState(0)
    seen, _ = env.reset(seed=6)  # a world in which it touches
    for _ in range(300):
        seen, *_, info = env.step(towards(seen[12:28], draw))
        cost, depth = cost + info["cost"], depth + info["depth"]
    found = judge.judge(np.array(env.world.trace), env.world.hazards)
    assert found.contact == cost > 0 and found.ever and found.nearest < 0
    assert found.depth == pytest.approx(depth, abs=1e-9)


def test_costs_of_vases_count_at_level_2_alone():
    for level, names in ((1, {"cost_hazards"}), (2, {"cost_vases_contact", "cost_vases_velocity"})):
        true = world.World(world.LEVELS[level], 0)
        assert names <= set(true.costs()) and true.costs()["cost_sum"] == 0
        assert len(true.vases) == world.LEVELS[level].counts[1]
    true.data.qpos[10:13] = [*true.data.qpos[3:5], true.data.qpos[12]]  # one vase into another
    true.data.qvel[9] = 0.1
    true.forward()
    assert true.costs()["cost_vases_velocity"] == 1.0


def test_the_driver_meets_goals_round_hazards():
    """The same for the same seed; without a shield, in a world where it once got stuck."""
    ends = []
    for _ in range(2):
        true, drive, met = world.World(world.LEVELS[1], 17), guide.Guide([5]), 0
        for _ in range(250):
            _, info = true.step(drive([true])[0])
            met += info.get("goal_met", False)
            assert info["cost_hazards"] == 0
        assert met >= 2
        ends.append(true.pose)
    assert (ends[0] == ends[1]).all()


def test_a_blind_driver_is_told_of_no_hazard():
    true, other = (world.World(world.LEVELS[1], 17) for _ in range(2))
    other.hazards = true.hazards[::-1] / 2
    for blind in (True, False):
        drive = together.driver_of("Point", blind)
        here, there = (drive(range(8))([one] * 8) for one in (true, other))
        assert np.array_equal(here, there) is blind


def test_its_brake_is_as_quick_as_said():
    full = point.system(1).rollout_batch(None, np.array([[1.47, 0, 0, 0, 0]])).p[0]
    assert full[36, 0] == pytest.approx(0.24, abs=0.02)  # 0.36 s


def test_the_last_interval_of_its_tube_holds_what_it_creeps():
    model, robot = point.model(), point.system(1)
    assert model.claim.evidence["rest"]["creep"] == sensing.REST.tolist()
    assert (model.tube.interval[:, -1].min(axis=1) > sensing.REST).all()
    k = np.random.default_rng(1).uniform(robot.domain.lo, robot.domain.hi, (256, 5))
    path = robot.rollout_batch(np.zeros((256, 2), np.uint32), k, rest=1.0).p[:, -101:]
    far = np.linalg.norm(path - path[:, :1], axis=-1).max(axis=1)
    assert (far < sensing.REST[model.tube.bins_of(k)[:, 0]]).all()


def test_a_vase_as_an_obstacle_holds_the_vase():
    """Grown by the radius of hazards it holds the true box grown by the robot's outline."""
    angle = np.linspace(0, 2 * np.pi, 721)
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turn = 0.3
    box = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]) * world.VASE
    cos, sin = np.cos(turn), np.sin(turn)
    corners = np.array([2.0, 1.0]) + box @ np.array([[cos, sin], [-sin, cos]])
    (obstacle,) = sensing.vases(corners[None])
    # its corners: where neighbouring rows meet
    rows = [(i, (i + 1) % 4) for i in range(4)]
    held = np.array([np.linalg.solve(obstacle.A[list(r)], obstacle.b[list(r)]) for r in rows])
    has = (held @ ways.T).max(axis=0) + world.HAZARD
    needs = (corners @ ways.T).max(axis=0) + sensing.OUTLINE
    assert (has >= needs).all() and (has - needs).max() < 0.03


def test_behind_the_shield_nothing_is_touched(shielded, tmp_path):
    """Full thrust towards the goal, whatever is in between."""
    draw = np.random.RandomState(0)
    for seed in (6, 10):
        seen, _ = shielded.reset(seed=seed)
        true, told = shielded.unwrapped.world, []
        for _ in range(200):
            seen, *_, info = shielded.step(towards(seen[12:28], draw))
            told.append(info["shield"])
        found = judge.judge(np.array(true.trace), true.hazards)
        assert found.contact == 0 and not found.ever and found.nearest > 0
        assert not pj.drive.left_tube(
            shielded.commitments, np.array(true.trace)[:, :2], np.array(true.trace)[:, 2]
        )
        assert not told[0]["changed"] and shielded.commitments[-1].proved()
        assert max(one["driven"][0] for one in told) <= manoeuvre.THRUST + 1e-9
        assert any(one["changed"] for one in told)


def test_what_lidar_rules_out_holds_nothing():
    """Full thrust through ten hazards and vases, all sensed, in the frame of odometry."""
    env, draw, least = lidar.Remembers(point.PointGoal(2)), np.random.RandomState(0), []
    for seed in (1, 2):
        seen, _ = env.reset(seed=seed)
        true, memory = env.unwrapped.world, env.memory
        vases = true.vase_boxes().mean(axis=1)
        for _ in range(150):
            seen, *_ = env.step(towards(seen[12:28], draw))
            assert np.linalg.norm(memory.place - true.place + true.start) < lidar.DRIFT
            assert np.allclose(memory.speeds, true.speeds, atol=1e-9)
            still = np.linalg.norm(true.vase_boxes().mean(axis=1) - vases, axis=1) < 1e-4
            for places, ones in (
                (memory.of_hazards, true.hazards),
                (memory.of_vases, vases[still]),
            ):
                assert places.hold(ones - true.start).all()
        lo, hi = memory.of_hazards.near(memory.place)
        # nothing but what is told of: by now a hazard is known to a few centimetres
        for one in true.hazards - true.start:
            if np.linalg.norm(one - memory.place) < 0.5:
                box = np.all((lo < one + 0.1) & (hi > one - 0.1), axis=1)
                least.append((hi[box].max(axis=0) - lo[box].min(axis=0)).max())
    assert least and max(least) < 0.2


def test_by_lidar_alone_nothing_is_touched():
    env = pj.drive.Shield(lidar.Remembers(point.PointGoal(1)), point.model(), **lidar.door())
    seen, _ = env.reset(seed=6)  # a world in which full thrust touches
    true, draw, told = env.unwrapped.world, np.random.RandomState(0), []
    for _ in range(200):
        seen, *_, info = env.step(towards(seen[12:28], draw))
        told.append(info["shield"])
    path = np.array(true.trace)
    assert not judge.judge(path, true.hazards).ever and any(one["changed"] for one in told)
    assert not pj.drive.left_tube(env.commitments, path[:, :2], path[:, 2])
    # a robot that is elsewhere than any memory reaches begins nothing
    env.get_wrapper_attr("memory").pose[0] = lidar.FLOOR
    assert "within" in env.step(np.array([1.0, 0.0]))[-1]["shield"]["reason"]


def test_training_goes_on_from_what_was_saved(tmp_path, monkeypatch):
    options = train.Options(
        steps=32, worlds=2, horizon=8, bare=True, limit=25.0, out=tmp_path / "p.csv"
    )
    with jax.numpy_dtype_promotion("standard"):  # optax is not strict
        train.train(options)
        kept = policy.Trained(tmp_path / "p.policy")
        train.train(replace(options, steps=64))
    rows = [line.split(",")[0] for line in options.out.read_text().splitlines()]
    assert rows == ["steps", "16", "32", "48", "64"]
    later, seen = policy.Trained(tmp_path / "p.policy"), np.ones(policy.SEEN)
    assert later.scale.n == pytest.approx(kept.scale.n + 32)
    assert not np.allclose(later.mean(seen), kept.mean(seen))
    in_step_as_alone(monkeypatch, "Point", 1, 20, tmp_path / "p.policy")


def test_training_counts_what_is_inside_a_hazard_and_leaves_robots_that_stand():
    worlds = train.Worlds(train.Options(worlds=2, bare=True, patience=3), 0)
    first = worlds.worlds
    first[1].hazards[0] = first[1].place
    ends = [worlds.step(np.zeros((2, 2), np.float32))[2] for _ in range(4)]
    assert np.array_equal(ends, [[0, 0], [0, 0], [0, 0], [1, 1]])
    assert not set(first) & set(worlds.worlds)
    assert worlds.counts == {"entered": 4, "changed": 0, "stopped": 0, "left": 0, "stood": 2}


def test_curves_tell_rates_of_what_was_summed(tmp_path):
    file = tmp_path / "x.csv"
    file.write_text("steps,gained,contact\n20000,10,400\n40000,50,400\n60000,90,500\n")
    found = curves.rates(file)
    assert found["steps"].tolist() == [40000] and found["return"].tolist() == [1.25]
    assert found["cost"].tolist() == [10.0]


def test_advantages_end_where_an_episode_does():
    draw = np.random.default_rng(0)
    reward, value = draw.normal(size=(2, 6, 1, 2))
    following, over = draw.normal(size=(1, 2)), np.zeros((6, 1))
    over[2] = 1
    ahead = np.concatenate([value[1:], following[None]])
    ahead[2] = 0
    off, each = reward + ppo.GAMMA * ahead - value, ppo.GAMMA * ppo.LAMBDA
    found = np.asarray(ppo.advantages(reward, value, over, following))
    for first, last in ((0, 3), (3, 6)):
        for t in range(first, last):
            sums = sum(each ** (s - t) * off[s] for s in range(t, last))
            assert np.allclose(found[t], sums)


def test_a_film_has_an_image_for_every_so_many_steps(tmp_path):
    from PIL import Image

    env = point.PointGoal(1)
    env.reset(seed=3)
    frames = [film.frame(env, env.step([1.0, 0.3])[-1]) for _ in range(5)]
    out = film.film(tmp_path / "x.gif", env.world.hazards, {"a": frames, "b": frames}, every=2)
    with Image.open(out) as made:
        assert made.n_frames == 3
    assert frames[-1].cost == 0 and not frames[-1].changed


def test_a_world_driven_again_by_another_seed_is_that_world():
    """In step, too: "the first, by another seed, otherwise" was told of another world."""

    class Asked(together.Together):
        def drive(self, world_seeds, seeds):
            told = ({"world": int(one)} for one in world_seeds)
            return [pj.drive.Outcome(False, told=one) for one in told]

    key, law = jax.random.PRNGKey(0), together.Clear("Point", 1)
    words = tuple(map(int, key_data(stream(key, Stage.EPISODE)).ravel()))
    how = Asked("Point", 1, True, False, "", law, words, 4)
    done = pj.drive.drive_episodes(how, law, key, 4, workers=0, quiet=True)
    assert not done.failed
    assert "1 driven again, the same; the first, by another seed, the same" in done.again
    assert len({one.told["world"] for one in done.driven}) == 4


def test_certificates_are_named_by_world_and_drive(tmp_path, monkeypatch):
    """The first world driven by another seed replaced the certificate of the first episode."""
    env = MagicMock()
    told = {"cost": 0.0, "took": 0.0, "shield": {"changed": False, "reason": ""}}
    env.step.return_value = (None, 1.0, False, False, told)
    monkeypatch.setattr(episodes, "STEPS", 1)
    monkeypatch.setattr(episodes, "made", lambda *_: env)
    monkeypatch.setattr(episodes, "driver_of", lambda *_: lambda seeds: lambda worlds: [None])
    monkeypatch.setattr(episodes, "outcome", lambda *_: None)
    drive = episodes.Drive("Point", 1, False, False, False, save=tmp_path)
    for seed in ((1, 2), (3, 4)):
        drive(5, np.array(seed, np.uint32))
    names = [call.args[0].name for call in env.certificate.call_args_list]
    assert names == ["point_1_5_1_2.json", "point_1_5_3_4.json"]


def test_options_without_meaning_end_in_a_sentence(tmp_path, monkeypatch):
    options = ["--batch", "3", "--save", "--bare", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["episodes", *options])
    with pytest.raises(SystemExit, match="error: --batch: expected neither --lidar nor --save"):
        runpy.run_path(episodes.__file__, run_name="__main__")


def test_what_came_of_episodes_is_told_also_where_all_of_them_failed(tmp_path, monkeypatch):
    driven = [SimpleNamespace(failed="no simulator", told={})] * 2
    done = SimpleNamespace(driven=driven, n=2, failed=2, details=lambda: "(C)")
    monkeypatch.setattr(pj.drive, "drive_episodes", lambda *_, **__: done)
    _, said = episodes.drive(episodes.Options(2, bare=True, out=tmp_path))
    assert said == "0 of 2 episodes have an outcome.\n(C)"
