"""The batched kernel against HiGHS and the host door; batch entries do not influence each other."""

import numpy as np
import pytest
from scipy.optimize import linprog

from benchmarks.neuralparc.lp_batch import solve_batch
from benchmarks.neuralparc.lp_program import LPStatus


def programs(rng, batch, n, h):
    """Two thirds feasible, one third mostly empty."""
    A, b = rng.normal(size=(batch, h, n)), rng.uniform(0.5, 2.0, (batch, h))
    b[::3] -= 2.5
    return rng.normal(size=(batch, n)), A, b


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "h"),
    [
        (1, 6),
        pytest.param(3, 18, marks=pytest.mark.slow),
        pytest.param(8, 24, marks=pytest.mark.night),
    ],
)
def test_batch_agrees_with_highs(rng, n, h):
    c, A, b = programs(rng, 60, n, h)
    bound = np.full(n, 20.0)
    ours = solve_batch(c, A, b, -bound, bound)
    seen = set(ours.status.tolist())
    for i in range(60):
        theirs = linprog(c[i], A[i], b[i], bounds=(-20, 20), method="highs")
        assert ours.status[i] == (LPStatus.INFEASIBLE if theirs.status == 2 else LPStatus.OPTIMAL)
        if theirs.status == 0:
            assert ours.lower[i] <= theirs.fun + 1e-9 and abs(ours.upper[i] - theirs.fun) < 1e-6
    assert seen == {int(LPStatus.OPTIMAL), int(LPStatus.INFEASIBLE)}
    assert ours.n_host <= 6


def test_entry_i_ignores_entry_j(rng):
    c, A, b = programs(rng, 9, 3, 18)
    bound = np.full(3, 20.0)
    together = solve_batch(c, A, b, -bound, bound)
    A[4], b[4], c[4] = 1e6 * rng.normal(size=(18, 3)), -np.ones(18), 0.0
    changed = solve_batch(c, A, b, -bound, bound)
    others = np.arange(9) != 4
    np.testing.assert_array_equal(together.status[others], changed.status[others])
    np.testing.assert_array_equal(together.x[others], changed.x[others])


def test_flat_and_touching_sets():
    A = np.array([[[1.0], [-1.0]]] * 3)
    b = np.array([[1.0, -1.0], [1.0, -1.001], [1.0, 1.0]])
    status = solve_batch(np.zeros((3, 1)), A, b, np.full(1, -9.0), np.full(1, 9.0)).status
    assert status.tolist() == [LPStatus.FEASIBLE, LPStatus.INFEASIBLE, LPStatus.FEASIBLE]


def test_what_the_kernel_leaves_open_goes_to_the_host(rng):
    c, A, b = programs(rng, 6, 3, 24)
    ours = solve_batch(c, A, b)  # no bounds: float proofs are impossible, unbounded programs occur
    assert ours.n_host == 6
    for i in range(6):
        theirs = linprog(c[i], A[i], b[i], bounds=(None, None), method="highs")
        expected = {0: LPStatus.OPTIMAL, 2: LPStatus.INFEASIBLE, 3: LPStatus.UNBOUNDED}
        assert theirs.status == 4 or ours.status[i] == expected[theirs.status]
