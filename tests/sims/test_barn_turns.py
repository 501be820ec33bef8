"""Where a robot in a pocket turns: only preference."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapely

import parc_jax as pj
from sims.barn.guidance import Guidance
from sims.barn.turns import GENTLE, HARD, Turns

SIZE = 0.458, 0.416
START, GOAL = np.array([0.0, 0.0, np.pi / 2]), np.array([0.0, -4.0])


def in_a_corridor(half: float, here=(0.0, 0.0, np.pi / 2)) -> Turns:
    """A robot looks into a dead end of a half width [m]; its goal lies behind it."""
    guide = Guidance(START, GOAL, 0.5)
    y = np.linspace(-0.6, 0.5, 60)
    sides = [np.stack([np.full_like(y, x), y], axis=1) for x in (-half, half)]
    x = np.linspace(-half, half, 40)
    guide.see(np.concatenate([*sides, np.stack([x, np.full_like(x, 0.5)], axis=1)]))
    guide.update(here)
    free = shapely.box(-half, -1.0, half, 0.5).union(shapely.box(-1.5, -3.0, 1.5, -0.6))
    return Turns(here, guide, pj.problem.FreeSpace(free), SIZE)


def costs(turns: Turns, *rests, k=(0.1, 0.1)) -> np.ndarray:
    x, y, heading = np.array(rests).T
    path = np.stack([x, y], axis=1)[:, None]
    given = np.broadcast_to(np.r_[np.zeros(4), k], (len(rests), 6))
    return turns.prefer(SimpleNamespace(path=path, heading=heading, k=given))


def test_in_a_narrow_pocket_it_drives_back_before_it_turns():
    ahead = np.pi / 2
    stays, back, turned, turned_behind = costs(
        in_a_corridor(0.3),
        (0.0, 0.0, ahead),
        (0.0, -0.15, ahead),
        (0.0, 0.0, ahead + 0.4),
        (0.0, -1.2 + 0.4, ahead + 0.4),
    )
    assert back < stays < turned
    assert turned_behind < back


def test_where_there_is_room_it_turns_at_once_and_either_way_is_as_good():
    left, right, stays, on = costs(
        in_a_corridor(1.4),
        *[(0.0, 0.0, np.pi / 2 + turn) for turn in (0.4, -0.4, 0.0)],
        (0.0, 0.15, np.pi / 2),
    )
    assert max(left, right) < stays < on
    assert left == pytest.approx(right, abs=0.05)


def test_commands_that_let_it_slide_cost_more():
    turns, rest = in_a_corridor(0.3), (0.0, -0.1, np.pi / 2)
    gentle, *hard = (
        costs(turns, rest, k=k)[0] for k in (GENTLE, (-0.6, 0.0), (0.0, -1.0), (0.6, 1.0))
    )
    np.testing.assert_allclose(hard, gentle + HARD)


def test_a_place_beyond_the_window_costs_what_guidance_says():
    turns, far = in_a_corridor(0.3), (0.0, -2.5, -np.pi / 2)
    seen = SimpleNamespace(path=np.array([[far[:2]]]), heading=np.array(far[2:]))
    assert costs(turns, far) == turns._guide.prefer(seen)


def test_a_way_that_lies_behind_is_half_a_turn_away():
    guide = in_a_corridor(0.3)._guide
    assert guide.away((0.0, 0.0, np.pi / 2)) == pytest.approx(np.pi, abs=0.2)
    assert guide.away((0.0, 0.0, -np.pi / 2)) == pytest.approx(0.0, abs=0.2)
    assert guide.away((*GOAL, 0.0)) == 0.0
