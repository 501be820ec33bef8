"""Rotation invariance is declared, and tried where a system can be started with a heading."""

import jax
import numpy as np
import pytest
from turning_arc import Arc

from parc_jax.common.errors import InputError
from parc_jax.learning.bound.start_gap import rotation_gap, try_starts
from parc_jax.learning.system import STAYS

KEY = jax.random.PRNGKey(0)


@pytest.mark.slow
def test_a_robot_that_turns_with_its_heading_has_no_gap():
    gap = rotation_gap(Arc(0.0), KEY, [0.3, -2.0, 3.1])
    assert gap.p.max() < 1e-12 and gap.q.max() < 1e-12
    assert try_starts(Arc(0.0), KEY, 1e-9).turned < 1e-9


@pytest.mark.slow
def test_a_wind_does_not_turn():
    assert rotation_gap(Arc(0.1), KEY, [np.pi]).p.max() == pytest.approx(0.2)
    with pytest.raises(InputError, match="arc: expected runs that turn with their heading"):
        try_starts(Arc(0.1), KEY, 1e-3)


def test_a_wrong_word_for_a_goal_state_is_seen():
    robot = Arc(0.0)
    robot.rotation = (STAYS, STAYS)
    assert rotation_gap(robot, KEY, [0.5]).q.tolist() == pytest.approx([0.5, 0.0])


def test_what_cannot_be_tried_is_said():
    class Silent(Arc):
        rotation = None

    assert try_starts(Silent(0.0), KEY, 0.0).turned is None
