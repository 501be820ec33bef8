"""A Jackal among discs that wander: what is declared of them is so, and contacts are told apart."""

import numpy as np
import pytest

from sims.jackal import crowd
from sims.jackal.params import TICK

SEED = np.array([1, 2], np.uint32)


def test_nobody_is_faster_than_is_declared_or_leaves_the_field():
    discs = crowd.crowd(SEED)
    speed = np.linalg.norm(np.diff(discs, axis=0), axis=2) / TICK
    assert speed.max() <= crowd.FASTEST + 1e-9 and speed.max() > 0.9 * crowd.FASTEST
    most = crowd.FASTEST * TICK
    assert (crowd.FIELD[0] - most <= discs).all() and (discs <= crowd.FIELD[1] + most).all()


@pytest.mark.soundness
def test_outlines_hold_every_disc_until_the_rest():
    discs = crowd.crowd(SEED)
    obstacles, spans = crowd.outlines(discs[100], 12, 0.1, 2.0)
    per_disc = len(obstacles) // crowd.DISCS
    assert [t for a, b in spans[:per_disc] for t in range(a, b + 1)] == list(range(12))
    angles = np.linspace(0, 2 * np.pi, 33)
    rim = crowd.RADIUS * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for i, (part, (first, last)) in enumerate(zip(obstacles, spans, strict=True)):
        ticks = 100 + np.arange(round(first * 0.1 / TICK), round((last + 1) * 0.1 / TICK) + 1)
        there = discs[ticks, i // per_disc][:, None] + rim
        assert (there @ part.A.T <= part.b + 1e-12).all()


def test_what_came_of_a_crowd_is_told_also_where_nobody_reached_the_goal():
    told = {"reached": False, "seconds": 60.0, "clearance": 0.25, "at_rest": True}
    told["under_way"] = False
    said = crowd.summary([told, told | {"clearance": np.inf}], 2, 0)
    assert said.startswith("0 of 2 reached the goal and were not touched. ")
    assert "touched in 0, nearest 0.25 m; discs ran into the robot at rest in 2." in said
    reached = told | {"reached": True, "at_rest": False, "seconds": 20.0}
    assert "1 of 2 reached the goal and were not touched, in 20.0 s (median), at most 20.0 s. " in (
        crowd.summary([told, reached], 2, 1)
    )
    touched = reached | {"under_way": True, "clearance": -0.1}
    said = crowd.summary([touched, reached], 2, 1)
    assert said.startswith("1 of 2 reached the goal and were not touched, in 20.0 s (median)")
    none = crowd.summary([], 2, 0)
    assert "touched in 0; discs ran into the robot at rest in 0; 2 had no outcome." in none


def test_contacts_under_way_and_at_rest_are_told_apart():
    path = np.zeros((101, 3))  # 2 s
    discs = np.full((101, 1, 2), 5.0)
    discs[70:75] = 0.3  # at 1.4 s one stands 0.3 m ahead and aside
    size = (0.458, 0.416)

    def met(*begun):
        return crowd.contacts(path, discs, size, list(begun), 1.2)

    assert met(0.0).at_rest and not met(0.0).under_way and met(0.0).nearest > 1.0
    assert met(0.0, 0.3).under_way and not met(0.0, 0.3).at_rest and met(0.0, 0.3).nearest < 0
    assert met().at_rest and met().nearest == np.inf
