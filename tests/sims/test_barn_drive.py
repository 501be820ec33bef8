"""Driving through worlds: guidance that prefers the way around, and an episode with its loop."""

import json
import runpy
import sys
from dataclasses import replace
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from compilations import compiled_by
from needs import need

import parc_jax as pj
import sims
from parc_jax.app import cli
from parc_jax.drive.loop.commitment import Step
from sims import barn
from sims.barn.drive import LIDAR, PATIENCE, drive
from sims.barn.guidance import FAR, Guidance
from sims.barn.sight import WIDTH, Seen
from sims.jackal.driven import Driven
from sims.jackal.learn import robot
from sims.lidar import lidar

START, GOAL = np.array([0.0, 0.0, np.pi / 2]), np.array([0.0, 6.0])


def test_a_wall_is_gone_around_and_no_way_is_far():
    guide = Guidance(START, GOAL, 0.5)
    wall = np.stack([np.linspace(-3.0, 1.0, 200), np.full(200, 3.0)], axis=1)
    guide.see(wall)
    guide.update()
    here = np.array([0.0, 2.0])
    assert 3.5 + 0.6 < guide.cost(here) < 3.5 + 2.5
    right, left = (guide.cost(np.array([x, 2.0])) for x in (0.5, -0.5))
    assert right < guide.cost(here) < left
    guide.see(np.stack([np.linspace(1.0, 3.0, 200), np.full(200, 3.0)], axis=1))
    guide.update()
    assert guide.cost(here) == FAR


def test_costs_near_the_robot_are_counted_first_and_are_the_same():
    """What lies farther is counted once it is asked for, the robot beside something or not."""
    world = barn.world(58)
    near, whole = (Guidance(world.start, world.goal, 1.0) for _ in range(2))
    for guide in (near, whole):
        guide.see(world.cylinders)
    near.update()
    whole.update()
    middles = world.cylinders[::40]
    for place in (world.start[:2], world.goal - [0.0, 3.0], *middles[:2]):
        near.update(place)
        around = place + np.random.default_rng(0).uniform(-1.0, 1.0, (200, 2))
        for asked in (place, around, world.cylinders, world.start[:2]):
            np.testing.assert_array_equal(near.cost(asked), whole.cost(asked))
        seen = SimpleNamespace(path=around[:, None], heading=np.zeros(len(around)))
        near.update(place)
        np.testing.assert_array_equal(near.prefer(seen), whole.prefer(seen))


def test_costs_that_stay_while_more_is_seen_are_those_counted_anew():
    need("shapely")
    from shapely import Point

    world, rng = barn.world(58), np.random.default_rng(0)
    guide = Guidance(world.start, world.goal, 1.0)
    for y in np.linspace(world.start[1], world.goal[1], 12):
        place = np.array([world.start[0], y])
        clear = SimpleNamespace(region=Point(place).buffer(0.6))
        guide.see(rng.permutation(world.cylinders)[:60], clear)
        guide.give_up(place + rng.uniform(-1.0, 1.0, 2))
        guide.update(place)
        anew = Guidance(world.start, world.goal, 1.0)
        anew._occupied, anew._tried = guide._occupied, guide._tried
        anew.update()
        around = place + rng.uniform(-1.5, 1.5, (200, 2))
        seen = SimpleNamespace(path=around[:, None], heading=np.zeros(len(around)))
        np.testing.assert_array_equal(guide.prefer(seen), anew.prefer(seen))
        np.testing.assert_array_equal(guide.cost(world.cylinders), anew.cost(world.cylinders))


class Standing:
    """A loop that commits to nothing."""

    def restart(self):
        pass

    def step(self, *_, **__):
        return Step(None, False, "nothing is safe")

    def go_on(self, reason, gone, pose, at, drift):
        return Step(None, False, reason)


class Asked(Standing):
    """One that notes what drift it was told."""

    def __init__(self):
        self.drift = []

    def step(self, *asked, drift, **more):
        self.drift.append(drift)
        return super().step(*asked)


class Failing:
    """A lidar whose scans are, one after the other, whole, with NaN, and too short."""

    def __init__(self):
        self.whole, self.n, self.sweep = lidar(beams=181), 0, 0.0

    def pose(self, robot):
        return self.whole.pose(robot)

    def scan(self, *asked):
        scan, self.n = self.whole.scan(*asked), self.n + 1
        if self.n % 3 == 1:
            return scan
        if self.n % 3 == 2:
            return replace(scan, ranges=np.where(np.arange(181) == 90, np.nan, scan.ranges))
        return replace(scan, ranges=scan.ranges[1:])


def test_scans_that_make_no_sense_end_in_the_stop_in_hand_and_the_drive_goes_on():
    need("shapely")
    system, world = sims.load("jackal", threads=1), barn.world(1)
    done = drive(world, system, Standing(), jax.random.PRNGKey(0), Failing())
    reasons = [step.reason for step in done.steps]
    assert len(reasons) == PATIENCE and not done.reached and not done.touched
    assert reasons[0] == reasons[3] == "nothing is safe"
    assert "ranges: expected finite numbers; got 1" in reasons[1]
    assert "ranges" in reasons[2] and "180" in reasons[2]


def test_with_the_map_the_same_obstacles_are_there_in_every_cycle_and_nobody_scans():
    need("shapely")
    system, world = sims.load("jackal", threads=1), barn.world(1)
    done = drive(world, system, Standing(), jax.random.PRNGKey(0), scanner=object(), known=True)
    assert {step.reason for step in done.steps} == {"nothing is safe"}
    assert done.edges == [len(barn.rectangles(world.occupied))] * PATIENCE
    assert all(np.array_equal(true, told) for true, told in done.poses) and not done.drifted


def test_on_odometry_the_robot_goes_on_too_and_drifts_no_more_than_allowed():
    need("shapely")
    system, world = sims.load("jackal", threads=1), barn.world(1)
    key, sensor = jax.random.PRNGKey(0), lidar(beams=181)
    loop = Asked()
    done = drive(world, system, loop, key, sensor, odometry=True)
    assert len(done.steps) == PATIENCE and done.drifted == 0 and not done.touched
    assert loop.drift[0] == 0.0 < loop.drift[1] < loop.drift[-1]
    assert {step.reason for step in done.steps} == {"nothing is safe"}


def test_the_clock_of_a_cycle_begins_before_its_scan():
    """What the robot sees and where it is known to be are as old as the scan by then."""
    need("shapely")
    took, now = [], [0.0]

    class Slow(Failing):
        def scan(self, *asked):
            now[0] += 0.1
            return super().scan(*asked)

    class Told(Standing):
        def step(self, *asked, measured=None, **more):
            took.append(measured if measured is None else now[0] - measured)
            return super().step(*asked)

    system, world = sims.load("jackal", threads=1), barn.world(1)
    drive(world, system, Told(), jax.random.PRNGKey(0), Slow(), clock=lambda: now[0])
    assert min(took) == pytest.approx(0.1)


def test_the_premises_of_a_file_tell_all_that_was_assumed_of_lidar_and_odometry():
    from sims.barn.driver import assumed_of
    from sims.jackal.drift import Allowed

    allowed = [Allowed(0.5, 0.125, 0.25), Allowed(0.25, 0.375, 0.125)]
    drifts, known = SimpleNamespace(allowed=allowed, drifted=2), SimpleNamespace(allowed=[])
    ramp = (3.0, 6.0)
    seen = assumed_of(drifts, lidar(**LIDAR, sweep=0.1), ramp)
    for said in (
        "lidar at (0.12, 0.0) m, 0.0 rad on the robot: ranges within ±0.01 m, nothing narrower "
        "than 0.15 m, no echo: nothing up to its range_max",
        "accelerates by at most 3.0 m/s² and 6.0 rad/s²",
        "stays, and before the start 0.12 m around the robot were looked at",
        "its range_max is 30.0 m, a sweep takes 0.1 s",
    ):
        assert said in seen["what stands"]
    off = "half axes 0.5 m ahead and 0.375 m aside, and a heading by 0.25 rad, at most"
    assert off in seen["measured poses"] and seen["who moves"] == "nobody"
    assert seen["measured poses"].endswith("in this drive 2 cycles were off by more")
    other = [(known, lidar(**LIDAR, sweep=0.1)), (drifts, lidar(**LIDAR)), (known, None)]
    assert len({str(assumed_of(*each, ramp)) for each in [*other, (drifts, lidar())]}) == 4
    assert "truly known" in assumed_of(known, None, ramp)["measured poses"]


def test_a_line_of_other_options_or_without_the_files_that_are_asked_for_is_no_answer(tmp_path):
    from sims.barn.driver import MODEL, Driver, file_name

    driver = Driver(MODEL, "a model")
    line = {"world": 5, "seed": 0, "committed": 3, **driver.told}
    assert driver.has(line) and driver.has(line | {"proved": True})
    for other in (
        {"clock": True},
        {"prove": True},
        {"odometry": True},
        {"sweep": 0.1},
        {"content": "another"},
        {"save": tmp_path},
        {"film": tmp_path},
    ):
        assert not replace(driver, **other).has(line)
    assert not driver.has(line | {"driver": "older code"})
    assert replace(driver, prove=True).has(line | {"proved": True})
    (tmp_path / f"{file_name(driver.digest, 5, (5, 0))}.json").touch()
    assert replace(driver, save=tmp_path).has(line)
    assert replace(driver, film=tmp_path).has(line | {"committed": 0})  # nothing to film


def test_episodes_without_an_outcome_count_as_not_reached():
    from sims.barn.series import summary

    told = {"reached": True, "touched": False, "left": False, "drifted": 0.0, "metric": 0.5}
    told |= {"seconds": 6.0, "clearance": 0.07, "world": 4, "late": 0, "cycles": 60}
    told |= {"cycle_ms": [10.0, 12.0, 1234.1], "plan_ms": [5.0, 6.0, 9.01]}
    said = summary(3 * [told], 4)
    assert said.startswith("3 of 4 episodes reached the goal without contact, 1 without an outcome")
    assert "metric 0.375 of 0.5." in said and "without an outcome" not in summary([told], 1)
    assert said.endswith("Not reached, worlds: those of 1 without an outcome.")
    assert "at most 1240 ms" in said and "at most 9.01 ms" in said
    assert summary([], 4).startswith("0 of 4 episodes reached")


@pytest.mark.soundness
@pytest.mark.parametrize("odometry", [False, True])
def test_what_a_lidar_that_turns_sees_free_is_free(odometry):
    """Also from a robot that drives and turns fast; told as if it stood still, it would not be."""
    need("shapely")
    import shapely

    world, system, sensor = barn.world(1), robot(), lidar(**LIDAR, sweep=0.1)
    standing = [shapely.Point(place).buffer(world.radius - 1e-6) for place in world.cylinders]
    stands, wrong = shapely.union_all(standing), 0.0
    for seed, turning in enumerate((-1.3, 1.3)):
        driven = Driven(system, world.start, jax.random.PRNGKey(seed))
        sight = Seen(world, driven, sensor, np.random.default_rng(seed), odometry)
        for _ in range(8):
            look, true = sight.look(), driven.pose
            assert not look.why
            # to the frame in which it truly stands
            move = framed_as(look.here, true)
            free = shapely.transform(look.free.region, move)
            assert shapely.intersection(free, stands).area == 0.0
            scan, _ = sight._scan()
            told = scan.taken_from(sensor.pose(look.here))
            still = pj.problem.seen_from(
                told.pose, told.angles, told.ranges, max_range=30.0, noise=told.noise, width=WIDTH
            )
            wrong = max(
                wrong, shapely.intersection(shapely.transform(still.region, move), stands).area
            )
            driven.begin(1.6, turning)
            driven.drive(0.2)
    assert wrong > 1e-4


def framed_as(one, other):
    """Places near a pose (3,), as they lie near another."""
    turn = other[2] - one[2]
    spun = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return lambda places: (places - one[:2]) @ spun.T + other[:2]


def test_the_job_is_found_by_its_name_and_asks_for_a_model_that_exists(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["systems"])
    assert stop.value.code == 0 and "\nbarn  " in capsys.readouterr().out
    arguments = ["--out", str(tmp_path / "out"), "--model", str(tmp_path / "none.npz")]
    with pytest.raises(SystemExit) as stop:
        cli.main(["run", "barn", *arguments])
    assert stop.value.code == 2 and "expected a saved model" in capsys.readouterr().err
    with pytest.raises(SystemExit) as stop:
        cli.main(["systems", "barn"])
    assert stop.value.code == 2 and "expected a function `system()`" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--map", "--odometry"], "map: expected a robot that truly knows where it is"),
        (["--seeds", "0"], "seeds: expected a whole number >= 1"),
        (["--jobs", "0"], "jobs: expected a whole number >= 1"),
        (["--model", "nothing.npz"], "nothing.npz: cannot be read (No such file or directory)"),
        (["--worlds", "7777"], "BARN world: expected one of 200 numbers"),
    ],
)
def test_options_without_meaning_are_refused_in_a_sentence(arguments, said, tmp_path, monkeypatch):
    out = ["--out", str(tmp_path / "drives.jsonl"), "--quiet"]
    monkeypatch.setattr(sys, "argv", ["sims.barn", "--worlds", "1", *out, *arguments])
    with pytest.raises(SystemExit) as stop:
        runpy.run_module("sims.barn", run_name="__main__")
    assert str(stop.value).startswith("error: ") and said in str(stop.value)


@pytest.mark.slow
def test_the_robot_that_comes_along_reaches_the_goal_and_touches_nothing(tmp_path):
    need("shapely")
    from sims.barn.series import Options, drive_worlds

    out = tmp_path / "drives.jsonl"
    drive_worlds(Options(worlds=(5,), odometry=True, prove=True, out=out, jobs=1, quiet=True))
    drive_worlds(
        Options(worlds=(5,), odometry=True, out=out, jobs=1, quiet=True)
    )  # it is not driven again
    (told,) = (json.loads(line) for line in out.read_text().splitlines())
    assert told["world"] == 5 and told["reached"] and told["proved"] and not told["touched"]
    files = {"save": tmp_path / "files"}  # it is for them, and is the same
    drive_worlds(Options(worlds=(5,), odometry=True, out=out, jobs=1, quiet=True, **files))
    _, again = (json.loads(line) for line in out.read_text().splitlines())
    assert again["clearance"] == told["clearance"] and len(list(files["save"].iterdir())) == 1


@pytest.mark.night
def test_with_the_map_nothing_compiles_and_the_job_writes_a_film_of_each(tmp_path, monkeypatch):
    need("shapely")
    from sims.barn.driver import MODEL, Driver, content_of

    with_map = Driver(MODEL, content_of(MODEL), known=True)
    first, many = with_map(barn.world(1), (1, 0)), []
    assert compiled_by(lambda: many.append(with_map(barn.world(250), (250, 0)))) == 0
    assert many[0].told["edges"] == [87.0, 87]  # nothing compiles, however many obstacles
    for one in (first, *many):
        assert one.told["reached"] and one.told["map"] and not one.touched
    monkeypatch.setattr(sys.modules["sims.barn.job"], "WORLDS", (217,))
    assert barn.job(out=tmp_path / "job", quiet=True) == 0  # on odometry and a lidar
    for kind in ("episodes/*.json", "films/*.gif", "films/*.html"):
        assert len(list((tmp_path / "job").glob(kind))) == 1
    (episode,) = (tmp_path / "job" / "episodes").iterdir()
    episode.write_text("{}")
    assert barn.job(out=tmp_path / "job", quiet=True) == 1
    episode.unlink()  # it is driven again
    assert barn.job(out=tmp_path / "job", quiet=True) == 0 and episode.exists()


@pytest.mark.night
def test_what_a_proof_costs_is_told_of_the_same_loop_with_other_tubes(tmp_path):
    need("shapely")
    from sims.barn import compared

    asked = compared.Options(
        worlds=(5,), runs=3000, out=tmp_path / "side.jsonl", jobs=1, quiet=True
    )
    *_, learned, constant, none = compared.main(asked).splitlines()
    assert learned.startswith("| learned | 1 of 1 | 0 |")
    assert constant.startswith("| constant |") and none.startswith("| none |")
