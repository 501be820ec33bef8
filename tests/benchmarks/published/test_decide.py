"""Verdicts on reach sets from vertices alone: never against the LPs, and nearly always there."""

from fractions import Fraction

import numpy as np
import pytest
from gap_model import arc_tube, gap_problem, gap_table

from benchmarks.neuralparc import brs
from benchmarks.neuralparc.cells import cells_outward, stack
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.sets.operations import shrink
from parc_jax.common.sets.box import box
from parc_jax.common.sets.extent import bounding_box
from parc_jax.common.sets.hpolytope import HPolytope, from_box

TUBE = arc_tube(4, (4, 3))
CELLS = stack(
    [p for region in cells_outward(gap_table(4), TUBE, np.array([5.0, 0.0])) for p in region]
)
GOAL = gap_problem().goal
YES, NO, OPEN = int(LPStatus.FEASIBLE), int(LPStatus.INFEASIBLE), int(LPStatus.UNKNOWN)
TURN = np.array([[1.0, 0.3, 0.8], [-0.2, 1.0, -0.7], [0.1, 0.0, 1.0]])


def rotated(goal: HPolytope) -> HPolytope:
    """A goal whose rows couple position and heading."""
    return HPolytope(
        goal.A @ TURN, goal.b + goal.A @ (TURN - np.eye(3)) @ np.array([10.0, 0.0, 0.0])
    )


def both(goal: HPolytope, start, final=TUBE.final):
    """Rows, verdicts by vertices, their inner points, and verdicts by LPs."""
    goals, goal_box = shrink(goal, final), bounding_box(goal)
    rows = brs.brs_rows(CELLS, HPolytope(goals.A, goals.b[CELLS.bin]), start, 2)
    by_lp = brs._by_lp(rows.A, rows.b, *brs.brs_bounds(CELLS, goal_box, 2))[0]
    return rows, *brs.decide(rows, CELLS, goals, goal_box, start, 2), by_lp


CASES = {
    "box": (GOAL, None, 0.99),
    "narrow heading": (from_box(box([9.5, -0.5, 0.1], [10.5, 0.5, 0.17])), None, 0.95),
    "box and start": (GOAL, from_box(box([4.0, -0.5], [4.6, 0.3])), 0.4),
    "coupled rows": (rotated(GOAL), None, 0.5),
    "coupled rows and start": (rotated(GOAL), from_box(box([4.0, -0.5], [4.6, 0.3])), 0.2),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_vertices_agree_with_the_lps_wherever_they_decide(name):
    goal, start, share = CASES[name]
    rows, status, inner, by_lp = both(goal, start)
    decided = status != OPEN
    assert decided.mean() >= share
    np.testing.assert_array_equal(status[decided], by_lp[decided])
    assert {YES, NO} == set(by_lp.tolist()) == set(status[decided].tolist())
    found = status == YES
    assert np.isnan(inner[~found]).all() and np.isfinite(inner[found]).all()
    for i in np.flatnonzero(found)[::7]:  # in exact arithmetic the point lies inside
        x = [Fraction(float(v)) for v in inner[i]]
        for row, b in zip(rows.A[i], rows.b[i], strict=True):
            assert sum(
                (Fraction(float(a)) * v for a, v in zip(row, x, strict=True)), Fraction(0)
            ) < Fraction(float(b))


EQUAL = np.full_like(TUBE.final, 0.01)


def touching(gap: float) -> HPolytope:
    """A goal that, shrunken by EQUAL, begins `gap` [rad] beyond the largest heading that any cell
    ends with.
    """
    q = CELLS.vertices @ CELLS.C[:, -1:].swapaxes(1, 2) + CELLS.d[:, None, -1:]
    first = float(q.max()) + gap - EQUAL[0, 2]
    return from_box(box([9.5, -0.5, first], [10.5, 0.5, first + 1.0]))


@pytest.mark.slow
@pytest.mark.soundness
def test_a_goal_that_just_touches_is_not_called_out_of_reach():
    assert (both(touching(1e-6), None, EQUAL)[1] == NO).all()
    at_touch = both(touching(0.0), None, EQUAL)[1]
    assert (
        OPEN in at_touch and YES not in at_touch
    )  # within rounding of the touch nothing is proved either way
    _, status, _, by_lp = both(touching(-1e-4), None, EQUAL)
    assert (by_lp == YES).any() and not ((status == NO) & (by_lp == YES)).any()


@pytest.mark.slow
def test_what_vertices_leave_open_is_decided_by_lps():
    goal, start = CASES["coupled rows and start"][:2]
    *_, status, _, by_lp = both(goal, start)
    assert (status == OPEN).any()
    found = brs.reach_sets(CELLS, shrink(goal, TUBE.final), bounding_box(goal), start, 2)
    np.testing.assert_array_equal(found.status, by_lp)
