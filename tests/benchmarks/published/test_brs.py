"""Backward reachable sets against the definition, one by one and batched, with and without a start
set.
"""

from fractions import Fraction

import numpy as np
import pytest
from gap_model import arc_tube, gap_problem, gap_table

from benchmarks.neuralparc.brs import brs_rows
from benchmarks.neuralparc.cells import cells_outward
from benchmarks.neuralparc.sets.operations import shrink
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box

TABLE, TUBE = gap_table(4), arc_tube(4, (2, 1))
PROBLEM = gap_problem()
CELLS = [p for region in cells_outward(TABLE, TUBE, np.array([5.0, 0.0])) for p in region]
GOALS = shrink(PROBLEM.goal, TUBE.final)


def dot(row, k):
    return sum((Fraction(float(c)) * v for c, v in zip(row, k, strict=True)), Fraction(0))


def goal_of(cell):
    return HPolytope(GOALS.A, GOALS.b[cell.bin])


@pytest.mark.parametrize("start", [None, from_box(box([4.0, -1.0], [5.0, 1.0]))])
def test_membership_is_reaching_the_shrunken_goal(rng, start):
    both = 0
    for cell in CELLS[:8]:
        rows = brs_rows(cell, goal_of(cell), start, 2)
        k = rng.dirichlet(np.ones(len(cell.vertices)), 300) @ cell.vertices
        p0 = (
            np.array([10.0, 0.0])
            - (k @ cell.C[-3:-1].T + cell.d[-3:-1])
            + rng.uniform(-0.7, 0.7, (300, 2))
        )
        final = k @ cell.C[-3:].T + cell.d[-3:]
        reaches = goal_of(cell).contains(np.c_[p0 + final[:, :2], final[:, 2]])
        expected = reaches if start is None else reaches & start.contains(p0)
        np.testing.assert_array_equal(rows.contains(np.c_[p0, k]), expected)
        both += 0 < expected.sum() < 300
    assert both >= 3


@pytest.mark.soundness
def test_rows_are_rounded_towards_the_goal():
    """A point exactly on a row of Omega reaches the goal in exact arithmetic."""
    cell = CELLS[0]
    rows = brs_rows(cell, goal_of(cell), None, 2)
    k = [Fraction(float(v)) for v in cell.vertices.mean(axis=0)]
    C, d = cell.final(3)
    final = [Fraction(float(e)) + dot(row, k) for row, e in zip(C, d, strict=True)]
    for i in range(4):  # rows that bound x or y of the end point: push p0 onto the row, exactly
        axis, sign = int(np.argmax(np.abs(GOALS.A[i, :2]))), int(GOALS.A[i].sum())
        if GOALS.A[i, 2] != 0:
            continue
        p0 = (Fraction(float(rows.b[i])) - dot(rows.A[i, 2:], k)) * sign
        assert sign * (p0 + final[axis]) <= Fraction(float(goal_of(cell).b[i]))
