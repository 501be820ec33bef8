"""Residuals of real runs: smoothed in where they help runs that they do not know, else left out."""

import numpy as np
import pytest
import slipping

from parc_jax.learning.prior.identify import corrected, flat, largest

K = slipping.drawn(60)


def test_what_a_prior_does_wrong_is_put_right():
    runs = slipping.recorded(K, noise=0.002)
    asked = slipping.recorded(K, np.column_stack([K[:, 0], 0 * K[:, 1], K[:, 1]]))
    found = corrected(lambda rows: flat(asked), runs)
    assert found.smoothing is not None and found.best < 0.3 * found.alone
    assert found.details().startswith("corrected by residuals (predicted from others")
    fresh = slipping.drawn(100, seed=5)
    wrong = slipping.recorded(fresh, np.column_stack([fresh[:, 0], 0 * fresh[:, 1], fresh[:, 1]]))
    truth = flat(slipping.recorded(fresh))
    before = np.abs(truth - flat(wrong)).max()
    assert np.abs(truth - flat(wrong) - found.more(fresh)).max() < 0.5 * before
    np.testing.assert_allclose(found.predicted, flat(asked) + found.more(K), atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_noise_is_left_alone_and_that_is_said(seed):
    runs = slipping.recorded(K, noise=0.05, seed=seed)
    found = corrected(lambda rows: flat(slipping.recorded(K)), runs)
    assert found.smoothing is None and not found.more(slipping.drawn(9)).any()
    assert found.details().startswith("residuals left out")
    np.testing.assert_allclose(found.errors, flat(runs) - flat(slipping.recorded(K)))


def test_errors_are_those_of_runs_that_had_not_been_seen():
    """A prior that knows by heart what it has seen, and nothing else."""
    runs = slipping.recorded(K, groups=np.arange(60) // 2)
    found = corrected(lambda rows: flat(runs) * rows[:, None], runs)
    np.testing.assert_array_equal(found.errors[:, :-1], flat(runs)[:, :-1] + 0.0)
    np.testing.assert_array_equal(largest(runs, found.errors), largest(runs, flat(runs)))


def test_one_run_unlike_all_others_is_not_followed():
    runs = slipping.recorded(K, noise=0.002)
    p = runs.p.copy()
    p[7] += 50.0 * np.linspace(0, 1, p.shape[1])[:, None]
    found = corrected(lambda rows: flat(slipping.recorded(K)), runs.replace(p=p))
    assert np.abs(found.more(K)).max() < 0.1
