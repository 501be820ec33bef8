"""DynaBARN: worlds as published, a judge of true outlines, contacts with their cause, and a world
that the Jackal crosses by proved manoeuvres.
"""

from types import SimpleNamespace

import numpy as np
import pytest

import parc_jax as pj
from parc_jax.drive.loop.episode_file import load_episode
from parc_jax.problem.world.movers import Moving
from sims.dynabarn import __main__ as shell
from sims.dynabarn import driver, movers, plain, worlds
from sims.jackal import learn
from sims.jackal.params import TICK


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
    found = worlds.clearances(here, path, learn.robot().size)
    assert found.min() == pytest.approx(0.6 - 0.5 - 0.208, abs=1e-9)
    assert abs(TICK * np.argmin(found) - 5.0) < 0.3
    np.testing.assert_array_equal(
        worlds.clearances(here, path, learn.robot().size, 240), found[240:]
    )


def test_what_walks_is_learned_from_other_worlds_than_it_is_asked_in():
    halves = [[n for n in worlds.numbers() if movers.half_of(n) == half] for half in (0, 1)]
    assert len(halves[0]) == len(halves[1]) == 20 and not set(halves[0]) & set(halves[1])
    for half in halves:  # of all kinds
        assert {worlds.world(number).kind for number in half} == set(worlds.KINDS)


@pytest.mark.soundness
def test_a_mover_that_leaves_its_tube_is_found_and_one_that_does_not_is_not():
    model, grid = movers.model(0), learn.model().time
    track = worlds.Track(np.array([0.0, 20.0]), np.array([[-10.0, 0.0], [10.0, 0.0]]))
    here = worlds.World(2, 5.0, (track,))
    times = np.array([-0.2, -0.1, 0.0])
    one = pj.problem.see_mover(times, here.movers(times)[:, 0], movers.STEP)
    told = pj.problem.mover_obstacles(model, [one], worlds.RADIUS, grid, 0.0, until=0.6)
    claim = driver.Claimed(told.until, told, (0,))

    class Begun:
        begin = 0.0

    assert not driver.gone_out(here, Begun, claim, 0.6)
    runs = worlds.Track(track.times, track.places * [4.0, 1.0])  # four times as fast, ahead of it
    assert driver.gone_out(worlds.World(2, 5.0, (runs,)), Begun, claim, 0.6)


def test_a_contact_has_one_cause():
    """A mover walks into a robot that rests at the origin; the claim of its step decides."""
    track = worlds.Track(np.array([0.0, 20.0]), np.array([[-10.0, 0.0], [10.0, 0.0]]))
    here, path = worlds.World(2, 9.0, (track,)), np.zeros((20, 3))
    distance = worlds.clearances(here, path, learn.robot().size)
    begun = [SimpleNamespace(begin=0.0)]

    def why(until: float, wide: float, left: bool = False) -> str:
        body = pj.hpolytope([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], [wide] * 4)
        moving = Moving([body], [(0, 5)], until, "")
        claims = [driver.Claimed(until, moving, (0,))]
        return driver.cause_of(here, path, begun, claims, distance, left)

    assert distance[0] > 0 >= distance.min()
    assert why(0.0, 9.0) == "no manoeuvre was proved"
    assert why(0.2, 9.0) == "later than the manoeuvre was proved for"
    assert why(0.6, 0.1) == "a mover left its tube"
    assert why(0.6, 9.0, left=True) == "the robot left its tube"
    assert why(0.6, 9.0) == "CONTRADICTED"
    comes = worlds.Track(np.array([0.0, 10.0]), np.array([[-0.8, 0.0], [9.2, 0.0]]))
    here = worlds.World(2, 9.9, (comes,))
    distance = worlds.clearances(here, path, learn.robot().size)
    assert why(0.6, 9.0) == "a mover appeared"


def test_a_world_is_crossed_by_proved_manoeuvres(tmp_path):
    """Nothing touched, no tube of the robot left; the checker accepts the file of the episode."""
    told = shell.episode("loop", 1, 0, tmp_path)
    assert told["reached"] and told["clearance"] > 0 and not told["left"] and not told["cause"]
    assert sum(told["claimed"].values()) > 50 and "0.6" in told["claimed"]
    assert told["said"].startswith("Until 0.6 s after the pose at ")
    load_episode(tmp_path / "world_1_0.json")  # raises where the checker rejects it


def test_the_plain_planner_crosses_it_too():
    told = shell.episode("plain", 1, 0)
    assert told["reached"] and told["seconds"] < 30
    assert len(plain.arcs(1.8, 1.3, 0.8)) == 143
