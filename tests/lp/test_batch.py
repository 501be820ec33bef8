"""The batched kernel against HiGHS and the host door; batch entries do not influence each other."""

import jax
import numpy as np
import pytest
from scipy.optimize import linprog

from parc_jax.common.errors import InputError
from parc_jax.common.lp.interior import factor, interior_point, solve_factored
from parc_jax.common.lp.status import LPStatus
from parc_jax.neuralparc import lp_batch as batch_module
from parc_jax.neuralparc.lp_batch import feasible_batch, solve_batch


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


def test_one_program_needs_no_batch_axes(rng):
    c, A, b = (part[0] for part in programs(rng, 3, 3, 12)[:3])
    b = b + 3.0
    st = jax.jit(interior_point)([*c], [*A.T], b)
    theirs = linprog(c, A, b, bounds=(None, None), method="highs")
    if theirs.status == 0:
        assert st.tau > st.kappa
        np.testing.assert_allclose(np.array([x / st.tau for x in st.x]), theirs.x, atol=1e-6)
    else:
        assert st.tau < st.kappa


def test_entry_i_ignores_entry_j(rng):
    c, A, b = programs(rng, 9, 3, 18)
    bound = np.full(3, 20.0)
    together = solve_batch(c, A, b, -bound, bound)
    A[4], b[4], c[4] = 1e6 * rng.normal(size=(18, 3)), -np.ones(18), 0.0
    changed = solve_batch(c, A, b, -bound, bound)
    others = np.arange(9) != 4
    np.testing.assert_array_equal(together.status[others], changed.status[others])
    np.testing.assert_array_equal(together.x[others], changed.x[others])


def test_row_order_and_scale_do_not_change_the_verdict(rng):
    c, A, b = programs(rng, 30, 3, 18)
    bound = np.full(3, 20.0)
    plain = solve_batch(c, A, b, -bound, bound)
    order, scale = rng.permutation(18), 10.0 ** rng.integers(-3, 4, 18)
    other = solve_batch(c, (A * scale[:, None])[:, order], (b * scale)[:, order], -bound, bound)
    np.testing.assert_array_equal(plain.status, other.status)


def test_flat_and_touching_sets():
    A = np.array([[[1.0], [-1.0]]] * 3)
    b = np.array([[1.0, -1.0], [1.0, -1.001], [1.0, 1.0]])
    status = feasible_batch(A, b, np.full(1, -9.0), np.full(1, 9.0)).status
    assert status.tolist() == [LPStatus.FEASIBLE, LPStatus.INFEASIBLE, LPStatus.FEASIBLE]


def test_what_the_kernel_leaves_open_goes_to_the_host(rng):
    c, A, b = programs(rng, 6, 3, 24)
    ours = solve_batch(c, A, b)  # no bounds: float proofs are impossible, unbounded programs occur
    assert ours.n_host == 6
    for i in range(6):
        theirs = linprog(c[i], A[i], b[i], bounds=(None, None), method="highs")
        expected = {0: LPStatus.OPTIMAL, 2: LPStatus.INFEASIBLE, 3: LPStatus.UNBOUNDED}
        assert theirs.status == 4 or ours.status[i] == expected[theirs.status]


def test_shapes_share_compiled_kernels(rng):
    """Batches of up to 64 programs with 9 to 16 rows are one shape: the kernel is traced once."""
    traces = []
    kernel = jax.jit(lambda c, A, b: (traces.append(A.shape), c * 0.0, b * 0.0)[1:])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(batch_module, "_kernel", kernel)
        for batch, h in ((5, 9), (64, 12), (7, 16)):
            batch_module.propose(*programs(rng, batch, 3, h))
    assert traces == [(64, 16, 3)]


def test_cholesky_matches_numpy(rng):
    solve = jax.jit(lambda lower, r: solve_factored(factor(lower), r))
    for n in (1, 2, 5, 8):
        G = rng.normal(size=(n, n + 3))
        M, r = G @ G.T, rng.normal(size=n)
        ours = solve([[M[i, j] for j in range(i + 1)] for i in range(n)], [*r])
        np.testing.assert_allclose(np.array(ours), np.linalg.solve(M, r), rtol=1e-8)


def test_too_many_variables_are_refused():
    with pytest.raises(InputError, match="at most 10"):
        feasible_batch(np.ones((2, 3, 11)), np.ones((2, 3)))
