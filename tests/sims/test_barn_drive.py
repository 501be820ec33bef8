"""Driving through worlds: guidance that prefers the way around, and an episode with its loop."""

import json

import numpy as np
import pytest
from needs import need

import sims
from sims.barn.guidance import FAR, Guidance

START, GOAL = np.array([0.0, 0.0, np.pi / 2]), np.array([0.0, 6.0])


def test_in_the_open_the_cost_is_the_way():
    guide = Guidance(START, GOAL, 0.5)
    guide.update()
    places = np.array([[0.0, 0.0], [0.0, 3.0], [0.0, 5.0]])
    np.testing.assert_allclose(guide.cost(places), 5.5 - places[:, 1], atol=0.1)


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


def test_where_nothing_was_found_other_ways_become_shorter():
    guide = Guidance(START, GOAL, 0.5)
    post = np.stack([np.linspace(-0.3, 0.3, 60), np.full(60, 3.0)], axis=1)
    guide.see(np.add(post, [0.02, 0.0]))  # a little shorter on the left
    guide.update()
    left, right = np.array([-0.7, 3.0]), np.array([0.7, 3.0])
    assert guide.cost(left) < guide.cost(right) + 0.1
    before = guide.cost(left)
    for _ in range(5):
        guide.give_up(left)
    guide.update()
    assert guide.cost(left) > before + 0.5


def test_candidates_are_within_k_and_some_turn_on_the_spot():
    from sims.barn.__main__ import candidates

    domain = sims.load("jackal").domain
    found = candidates(domain)
    assert ((domain.lo[2:] <= found) & (found <= domain.hi[2:])).all()
    assert (found[:, 0] == 0).sum() > 50 and np.abs(found[:, 1]).max() == domain.hi[3]


@pytest.mark.night
def test_a_robot_that_learned_to_drive_reaches_the_goal_and_touches_nothing(tmp_path):
    need("shapely")
    from sims.barn.__main__ import Options, main

    out = tmp_path / "drives.jsonl"
    about = {"model": tmp_path / "model.npz", "out": out, "rollouts": 3000, "eps": 1e-2}
    main(Options(worlds=(1, 5), prove=True, **about))
    told = [json.loads(line) for line in out.read_text().splitlines()]
    assert [one["world"] for one in told] == [1, 5]
    assert all(one["reached"] and one["proved"] and not one["touched"] for one in told)
    main(Options(worlds=(1, 5), **about))  # what was driven is not driven again
    assert len(out.read_text().splitlines()) == 2
