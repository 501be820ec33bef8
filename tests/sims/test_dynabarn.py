"""DynaBARN: worlds as published, a judge of true outlines, contacts with their cause, and a world
that the Jackal crosses by proved manoeuvres.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import parc_jax as pj
from parc_jax.common.keys import key_of
from parc_jax.drive.loop.episode_file import load_episode
from parc_jax.problem.world.movers import Moving
from sims.barn.drive import LIDAR
from sims.dynabarn import __main__ as shell
from sims.dynabarn import driver, memory, movers, plain, sight, worlds
from sims.dynabarn import robot as jackal
from sims.jackal.driven import Driven
from sims.jackal.params import TICK
from sims.lidar import lidar, shapes


def test_the_worlds_are_those_that_were_published():
    assert len(worlds.numbers()) == 40 and worlds.world(59).kind == "hard"
    for number in worlds.numbers():
        here = worlds.world(number, 3.0)
        times = np.arange(0.0, 20.0, TICK)
        places = here.movers(times)
        assert places.shape == (len(times), len(here.tracks), 2)
        assert np.abs(places).max() <= worlds.FIELD
        speed = np.linalg.norm(np.diff(places, axis=0), axis=2) / TICK
        appears = np.diff([here.since(float(t)) for t in times], axis=0) < 0
        assert speed[~appears].max() <= movers.FASTEST
        # who appears does so at the border
        assert (np.abs(places[1:][appears]).max(axis=-1) > worlds.FIELD - 0.05).all()
    with pytest.raises(pj.InputError, match="one of the 40"):
        worlds.world(3)


def test_the_judge_sees_a_contact_of_one_tick():
    track = worlds.Track(np.array([0.0, 10.0]), np.array([[-5.0, 0.6], [5.0, 0.6]]))
    here = worlds.World(1, 0.0, (track,))
    path = np.zeros((500, 3))  # 10 s at rest; it passes at 5 s, 0.6 m - 0.5 m beside the middle
    found = worlds.clearances(here, path, jackal.robot().size)
    assert found.min() == pytest.approx(0.6 - 0.5 - 0.208, abs=1e-9)
    assert abs(TICK * np.argmin(found) - 5.0) < 0.3
    np.testing.assert_array_equal(
        worlds.clearances(here, path, jackal.robot().size, 240), found[240:]
    )


def test_what_walks_is_learned_from_other_worlds_than_it_is_asked_in():
    halves = [[n for n in worlds.numbers() if worlds.half_of(n) == half] for half in (0, 1)]
    assert len(halves[0]) == len(halves[1]) == 20 and not set(halves[0]) & set(halves[1])
    for half in halves:  # of all kinds
        assert {worlds.world(number).kind for number in half} == set(worlds.KINDS)


@pytest.mark.soundness
def test_a_mover_that_leaves_its_tube_is_found_and_one_that_does_not_is_not():
    model, grid = movers.model(0), jackal.model().time
    track = worlds.Track(np.array([0.0, 20.0]), np.array([[-10.0, 0.0], [10.0, 0.0]]))
    here = worlds.World(2, 5.0, (track,))
    times = np.array([-0.2, -0.1, 0.0])
    one = sight.sighting(times, here.movers(times)[:, 0], movers.SEEN)
    told = pj.problem.mover_obstacles(model, [one.mover], worlds.RADIUS, grid, 0.0, until=0.6)
    claim = driver.Claimed(told.until, told, (one,))

    class Begun:
        begin = 0.0

    assert not driver.gone_out(here, Begun, claim, 0.6)
    runs = worlds.Track(track.times, track.places * [4.0, 1.0])  # four times as fast, ahead of it
    assert driver.gone_out(worlds.World(2, 5.0, (runs,)), Begun, claim, 0.6)


def test_a_contact_has_one_cause():
    """A mover walks into a robot that rests at the origin; the claim of its step decides."""
    track = worlds.Track(np.array([0.0, 20.0]), np.array([[-10.0, 0.0], [10.0, 0.0]]))
    here, path = worlds.World(2, 9.0, (track,)), np.zeros((20, 3))
    distance = worlds.clearances(here, path, jackal.robot().size)
    begun = [SimpleNamespace(begin=0.0)]
    seen = sight.Sighting(0.0, here.movers(0.0)[0], np.zeros(2), 0.0, None)

    def why(until: float, wide: float, left: bool = False, of=(seen,)) -> str:
        body = pj.hpolytope([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], [wide] * 4)
        moving = Moving([body], [(0, 5)], until, "")
        claims = [driver.Claimed(until, moving, of)]
        return driver.cause_of(here, path, begun, claims, distance, left)

    assert distance[0] > 0 >= distance.min()
    assert why(0.0, 9.0) == "no manoeuvre was proved"
    assert why(0.2, 9.0) == "later than the manoeuvre was proved for"
    assert why(0.6, 0.1) == "a mover left its tube"
    assert why(0.6, 9.0, left=True) == "the robot left its tube"
    assert why(0.6, 9.0) == "CONTRADICTED"
    assert why(0.6, 9.0, of=()) == "a mover was not seen"
    comes = worlds.Track(np.array([0.0, 10.0]), np.array([[-0.8, 0.0], [9.2, 0.0]]))
    here = worlds.World(2, 9.9, (comes,))
    distance = worlds.clearances(here, path, jackal.robot().size)
    assert why(0.6, 9.0) == "a mover appeared"


def test_a_world_is_crossed_by_proved_manoeuvres(tmp_path):
    """Nothing touched, no tube of the robot left; the checker accepts the file of the episode."""
    told = shell.episode("loop", 1, 0, save=tmp_path)
    assert told["reached"] and told["clearance"] > 0 and not told["left"] and not told["cause"]
    assert sum(told["claimed"].values()) > 50 and "0.6" in told["claimed"]
    assert told["driver"] == shell.digest_of("loop", lidar=False)  # as before the drive
    assert told["said"].startswith("Until 0.6 s after the pose at ")
    load_episode(shell.file_of(told, tmp_path))  # raises where the checker rejects it


def driven(monkeypatch, **told) -> None:
    """The loop drives nothing, and this is told of it."""
    told = {"reached": True, "clearance": 0.2, "cause": "", "seconds": 9.0} | told
    came = SimpleNamespace(touched=False, left=False)
    monkeypatch.setattr(driver, "drive", lambda *_: came)
    monkeypatch.setattr(driver, "told_of", lambda one: told)
    monkeypatch.setattr(driver, "save", lambda one, path: path.write_text("{}"))


def test_a_line_of_another_driver_or_without_its_file_is_driven_again(tmp_path, monkeypatch):
    options = shell.Options(worlds=(1, 2), planners=("loop",), out=tmp_path / "lines")
    saved = replace(options, save=tmp_path / "files")

    def lines(options) -> tuple[int, int]:
        """And files."""
        shell.drive(options)
        return len(options.out.read_text().splitlines()), len(list(tmp_path.glob("files/*")))

    driven(monkeypatch, claimed={"0.6": 2})
    assert [lines(options), lines(options)] == [(2, 0)] * 2
    assert [lines(saved), lines(saved)] == [(4, 2)] * 2
    assert lines(replace(saved, lidar=True)) == (6, 4)
    assert lines(saved) == (6, 4)  # its files are still there
    driven(monkeypatch, claimed={})
    assert lines(saved) == (8, 4)  # there is no file of no manoeuvre
    assert lines(saved) == (8, 4)


def test_fresh_worlds_without_an_outcome_count_as_not_reached(tmp_path, monkeypatch):
    def crashes(here, key, sight):
        if key[1] % 2:
            raise RuntimeError("the simulator crashed")
        return SimpleNamespace(touched=False, left=False)

    driven(monkeypatch)
    monkeypatch.setattr(driver, "drive", crashes)
    said = shell.drive(shell.Options(episodes=12, kinds=("easy",), out=tmp_path / "law"))
    assert said.startswith("7 of 12 reached the goal, 5 without an outcome")
    monkeypatch.setattr(shell, "digest_of", lambda *of: "of other networks")
    with pytest.raises(pj.InputError, match="expected the same drive"):
        shell.drive(shell.Options(episodes=12, kinds=("easy",), out=tmp_path / "law"))


def test_the_plain_planner_crosses_it_too():
    told = shell.episode("plain", 1, 0)
    assert told["reached"] and told["seconds"] < 30
    assert len(plain.commands()) == 143


def test_the_plain_planner_keeps_clear_of_who_may_turn():
    """All that a mover may do takes its speed and is as probable as told; where only some of it
    touches, that costs less than where all does, and nothing where none does.
    """
    walked, chance = plain.futures(12)
    steps = np.abs(np.diff(walked, axis=1))
    assert np.isclose(chance.sum(), 1.0) and (chance > 0).all()
    assert np.allclose(walked[0], plain.STEP * np.arange(1, 13))
    assert (steps <= plain.STEP + 1e-12).all() and np.isclose(np.median(steps), plain.STEP)
    stays = np.zeros((1, 12, 3))
    towards, past, away = (
        float(plain.costs(stays, [(x + 1j * y + 1.5 * walked, chance)])[0])
        for x, y in ((-1.5, 0.0), (-1.0, 1.9), (1.5, 4.0))
    )
    nobody = float(plain.costs(stays, [])[0])
    assert towards > past + 10 > nobody + 10 and away == nobody


def test_who_came_by_before_is_expected_to_go_the_same_way():
    """A loop of 8 s is remembered from its second round on, as it was walked; who crosses it there
    in another direction is not taken for it.
    """
    corner = worlds.Track(
        np.array([0.0, 2.0, 4.0, 8.0]), np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 0.0]])
    )
    kept, draw = memory.Memory(), np.random.default_rng(0)
    way = kept.begin()
    times = np.arange(0.0, 9.5, 0.1)
    for now in times:
        place = corner.at(now % corner.length) + draw.uniform(-0.01, 0.01, 2)
        way.add([now], [place])
        found = kept.again(way)
        assert found is None or now >= corner.length
        if now > corner.length + memory.MEANWHILE + 0.05:
            later = now + np.arange(0.0, 1.3, 0.1)
            truly = corner.at(later % corner.length) @ [1, 1j]
            assert np.abs(np.interp(later, *found) - truly).max() < 0.06
    across = kept.begin()
    for now, x in zip(times[-5:] + 5.0, np.linspace(-0.6, 0.6, 5), strict=True):
        across.add([now], [[1.5 - x, 0.3 - 0.5 * x]])
    across.add([15.0], [corner.at(1.0)])
    assert kept.again(across) is None
    one = sight.Sighting(9.4, corner.at(1.4), np.array([1.5, 0.0]), 0.0, None, found)
    walked, chance = plain.expected(one, 9.4, 12)
    assert walked.shape == (1, 12) and chance.tolist() == [1.0]


def test_who_walks_a_way_of_the_other_half_is_expected_to_go_on_and_to_begin_again():
    """Turned and mirrored; a way of a moment is none yet, nor is one beside it."""
    track = worlds.world(41).tracks[8]
    half, turn = worlds.half_of(41), np.array([[0.0, -1.0], [-1.0, 0.0]])
    kept, draw = memory.Memory(half), np.random.default_rng(0)
    for now in (7.3, track.length - 0.5):
        way, beside = kept.begin(), kept.begin()
        times = 40.0 + now + np.arange(-1.0, 0.01, 0.1)
        places = track.at(times - 40.0) @ turn + draw.uniform(-0.01, 0.01, (len(times), 2))
        way.add(times[-3:], places[-3:])
        assert kept.again(way) is None
        way.times, way.places = [], []
        way.add(times, places)
        beside.add(times, places + 0.1)
        assert kept.again(beside) is None
        later = times[-1] + np.arange(0.0, 3.0, 0.07)
        truly = track.at((later - 40.0) % track.length) @ turn @ [1, 1j]
        away = np.abs(np.interp(later, *kept.again(way)) - truly)
        assert np.sort(away)[-2] < 0.1  # it jumps once
    assert memory.Memory(1 - half).again(way) is None  # walked in one half alone


def test_of_whom_only_the_place_is_known_may_come_from_all_sides():
    one = sight.Sighting(0.0, np.array([2.0, 0.0]), np.zeros(2), 0.0, None)
    walked, chance = plain.expected(one, 0.0, 12)
    assert chance.sum() == pytest.approx(1.0)
    assert np.abs(walked[:, -1] - 2.0) == pytest.approx(1.2 * 1.6)
    assert abs(walked[:, -1].mean() - 2.0) < 1e-9


def stands(*places) -> worlds.World:
    """A world whose movers stand at places."""
    times = np.array([0.0, 100.0])
    return worlds.World(1, 0.0, tuple(worlds.Track(times, np.array([p, p])) for p in places))


def looked(world: worlds.World, seconds: float = 0.4) -> sight.Seen:
    """Sight of a robot that stood at the origin for so long."""
    robot = Driven(jackal.robot(), (0.0, 0.0, 0.0), key_of(0))
    robot.drive(seconds)
    seen = sight.Seen(world, np.random.default_rng(0))
    seen.look(robot)
    return seen


def test_who_is_behind_another_or_in_the_blind_quarter_gives_no_track():
    front, hidden, blind, beside = [2.0, 0.0], [4.0, 0.0], [-3.0, 0.5], [0.0, 3.0]
    seen = looked(stands(front, hidden, blind, beside))
    places = sorted(track.sighting.place.round(1).tolist() for track in seen.tracks)
    assert places == [beside, front]
    assert all(track.sighting.mover is not None for track in seen.tracks)


@pytest.mark.soundness
def test_a_fitted_circle_contains_the_truth_within_its_named_error():
    """Cylinders that stand apart, one in front of another now and then."""
    draw, scanner, found = np.random.default_rng(1), lidar(**LIDAR), []
    for _ in range(200):
        here = draw.uniform(-6.0, 6.0, (8, 2))
        apart = np.linalg.norm(here[:, None] - here[None], axis=-1) + 9.0 * np.eye(8)
        here = here[(apart.min(axis=1) > 1.1) & (np.linalg.norm(here, axis=1) > 1.0)]
        pose = [0.0, 0.0, draw.uniform(-np.pi, np.pi)]
        scan = scanner.scan(pose, shapes(here, worlds.RADIUS), draw)
        for fit in sight.fits(scan):
            away = np.abs(here - fit.place)
            nearest = np.argmin(np.hypot(*away.T))
            assert np.hypot(*away[nearest]) <= fit.off
            found.append((fit.off, away[nearest].max()))
    off, truly = np.array(found).T
    assert len(found) > 500 and off.max() > 0.3  # some are nearly hidden
    # what tracks are learned with is more than what their fits are off
    assert np.quantile(truly[off <= sight.SURE], 0.99) < movers.SCANNED


def test_who_was_seen_is_remembered_for_a_while_and_who_has_gone_is_not():
    comes = worlds.Track(
        np.array([0.0, 0.6, 0.61, 9.0]), np.array([[0.5, 3.0]] * 2 + [[9.0, 9.0]] * 2)
    )
    stays = worlds.Track(comes.times[[0, 3]], np.array([[2.0, 0.0]] * 2))
    both = worlds.World(1, 0.0, (comes, stays))
    assert len(looked(both, 0.4).tracks) == 2
    # all places to which it can have gone by now are seen to be free
    gone = looked(both, 0.8)
    assert not any(np.linalg.norm(track.fits[-1].place - [0.5, 3.0]) < 0.1 for track in gone.tracks)
    # it slips behind one that stands: it may be there, and is remembered, then forgotten
    hides = worlds.Track(comes.times, np.array([[2.6, 1.2]] * 2 + [[4.0, 0.0]] * 2))
    both = worlds.World(1, 0.0, (hides, stays))
    assert len(looked(both, 1.0).tracks) == 2
    assert len(looked(both, 2.0).tracks) == 1
    # who comes back may go anywhere, until it was seen three times in a row again
    again = np.array([[2.6, 1.2]] * 2 + [[4.0, 0.0]] * 2 + [[2.6, 1.2]] * 2)
    back = worlds.Track(np.array([0.0, 0.4, 0.41, 0.65, 0.66, 9.0]), again)
    both = worlds.World(1, 0.0, (back, stays))
    known = [[one.sighting.mover is not None for one in looked(both, t).tracks] for t in (0.8, 1.0)]
    assert sorted(known[0]) == [False, True] and known[1] == [True, True]


def test_who_went_out_of_sight_on_a_known_way_is_expected_but_in_no_claim():
    """It walks to behind the robot, which stands; where it is seen not to be it is not expected."""
    track = worlds.world(41).tracks[8]
    now = 7.3
    here, there = track.at(now), track.at(now + 3.0)
    ahead = (there - here) / np.linalg.norm(there - here)
    # so that it is seen at first, and later in the blind quarter
    place, heading = here + 1.5 * ahead + [-ahead[1], ahead[0]], np.arctan2(*-ahead[::-1])
    robot = Driven(jackal.robot(), (*place, heading), key_of(0))
    seen = sight.Seen(worlds.World(40, now, (track,)), np.random.default_rng(0))
    expected = []
    while robot.time < 5.0:
        known = seen.look(robot)
        expected.append((len(known), len(seen.hidden)))
        for one in seen.hidden:
            assert np.linalg.norm(one.place - track.at(now + robot.time)) < 0.1
        robot.drive(0.2)
    assert (1, 0) in expected and (0, 1) in expected and (1, 1) not in expected
    scan = lidar(**LIDAR).scan([0.0, 0.0, 0.0], shapes([[3.0, 0.0]], worlds.RADIUS))
    assert sight.sees(scan, np.array([2.0, 0.0])) and sight.sees(scan, np.array([0.0, 3.0]))
    for hidden in ([3.0, 0.0], [6.0, 0.0], [-2.0, 0.0]):  # in it, behind it, behind the robot
        assert not sight.sees(scan, np.array(hidden))


def test_who_appears_at_the_side_of_the_robot_stops_it():
    """Nothing is known of it but its place, so it may go anywhere, at once."""
    robot = Driven(jackal.robot(), worlds.START, key_of(0))
    planner = driver.loop()
    planner.restart()
    appears = stands([worlds.START[0] - 1.5, 0.6])
    model = movers.model(0, movers.SCANNED)
    free, claim = driver.decide(planner, robot, model, [])
    assert free.committed.k[-2] > 1.0 and claim.of == ()
    planner.restart()
    seen = sight.Seen(appears, np.random.default_rng(0)).look(robot)
    assert [one.mover for one in seen] == [None]
    step, claim = driver.decide(planner, robot, model, seen)
    assert claim.until and len(claim.of) == 1
    assert step.committed.k[-2] < 0.5
    assert "against 1 that may go anywhere" in claim.moving.said


def test_fresh_worlds_are_of_their_kind():
    law = worlds.Law(("easy", "medium"))
    drawn = [law(seed) for seed in range(12)]
    assert {here.kind for here in drawn} == {"easy", "medium"}
    for here in drawn:
        like = worlds.world(here.number)
        assert len(here.tracks) == len(like.tracks)
        times = np.arange(0.0, 5.0, TICK)
        places = here.movers(times)
        assert np.abs(places).max() <= worlds.FIELD
    assert not np.array_equal(drawn[0].movers(0.0), worlds.Law()(1).movers(0.0))


@pytest.mark.night
def test_tubes_of_movers_are_the_same_on_another_processor():
    """Training rounds elsewhere there, and made every drive another one."""
    import os
    import subprocess
    import sys

    ask = (
        "from sims.dynabarn import movers; from hashlib import sha256;"
        "tube = movers.model(0).tube;"
        "print(sha256(b''.join(part.tobytes() for part in tube.halves)).hexdigest())"
    )
    told = {
        subprocess.run(
            [sys.executable, "-c", ask],
            env=os.environ | {"XLA_FLAGS": f"--xla_cpu_max_isa={kind}"},
            check=True,
            capture_output=True,
        ).stdout
        for kind in ("SSE4_2", "AVX2")
    }
    assert len(told) == 1


def test_worlds_share_as_many_ways_as_the_page_tells():
    walked = [
        (number, track.places)
        for number in worlds.numbers()
        for track in worlds.world(number).tracks
    ]
    hard = [(number, of) for number, of in walked if worlds.world(number).kind == "hard"]
    ways = {half: set() for half in (0, 1)}
    for number, of in walked:
        ways[worlds.half_of(number)] |= {(of @ turn).tobytes() for turn in worlds.turned()}
    known = sum(of.tobytes() in ways[1 - worlds.half_of(number)] for number, of in hard)
    shared = len(walked), len({of.tobytes() for _, of in walked}), len(hard), known
    assert shared == (641, 392, 313, 174)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (("dynabarn", "--worlds", "3"), "expected one of the 40"),
        (("dynabarn", "--out", "/proc/x"), "/proc/x: cannot be written"),
        (("dynabarn", "--save", "file"), "file is a file and no folder"),
        (("tractor.episodes", "--out", "file/yard"), "file is a file and no folder"),
    ],
)
def test_a_command_for_what_is_not_there_ends_in_one_sentence(asked, words, tmp_path):
    """It ended in a traceback."""
    import subprocess
    import sys

    (tmp_path / "file").touch()
    ask = [sys.executable, "-m", f"sims.{asked[0]}", *asked[1:]]
    done = subprocess.run(ask, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith(f"sims.{asked[0]}: ") and words in done.stderr
