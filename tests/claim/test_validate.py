"""Testing the final choice itself."""

from fractions import Fraction

import jax
import numpy as np
import pytest
from synthetic_plants import disturbed, failing, plant

from parc_jax.claim.counts import clopper_pearson
from parc_jax.claim.validate import validate_choice
from parc_jax.errors import InputError

KEY = jax.random.PRNGKey(0)
pytestmark = pytest.mark.soundness


def test_no_failure_is_one_minus_a_root_of_delta():
    for n in (10, 100, 4000):
        assert clopper_pearson(0, n, 1e-3) == pytest.approx(1 - 1e-3 ** (1 / n), rel=1e-8)
    assert float(clopper_pearson(0, 10, 0.05)) == pytest.approx(
        0.2589, abs=1e-4
    )  # the published 10 of 10
    assert clopper_pearson(7, 7, 0.01) == 1


def test_the_bound_inverts_the_binomial_tail(rng):
    from scipy.stats import binom

    for failures, n, delta in ((1, 50, 0.01), (9, 300, 1e-3), (250, 300, 1e-6)):
        eps = float(clopper_pearson(failures, n, delta))
        assert binom.cdf(failures, n, eps) == pytest.approx(delta, rel=1e-5)


def test_the_statement_covers_the_true_rate():
    system, half = plant(disturbed), 0.12  # P(|0.1 gain| > 0.12) = 0.2301
    wrong = 0
    for seed in range(40):
        key = jax.random.PRNGKey(seed)
        result = validate_choice(
            system,
            key,
            [0.5, 0.5],
            lambda b: np.abs(b.p[:, -1, 0] - 0.5) > half,
            n=100,
            delta=0.05,
        )
        wrong += result.eps < 0.2301
    assert wrong <= 6  # 40 x 0.05 = 2, four standard errors 5.5
    assert f"{result.failures} of 100 fresh runs" in result.statement()


def test_a_run_with_nan_has_failed_whatever_the_test_says():
    result = validate_choice(plant(failing), KEY, [0.5, 0.5], lambda b: np.zeros(b.n, bool), n=200)
    assert result.failures > 2


def test_looks_split_delta():
    system = plant(disturbed)
    one, two = (
        validate_choice(system, KEY, [0.5, 0.5], lambda b: np.zeros(b.n, bool), n=50, looks=looks)
        for looks in (1, 2)
    )
    assert one.eps < two.eps and one.delta == two.delta == Fraction(1, 1000)
    with pytest.raises(InputError, match="looks"):
        validate_choice(system, KEY, [0.5, 0.5], lambda b: np.zeros(b.n, bool), looks=0)


def test_the_users_verdict_is_checked():
    system = plant(disturbed)
    for verdict in (lambda b: np.zeros((b.n, 1), bool), lambda b: False, lambda b: np.zeros(b.n)):
        with pytest.raises(InputError, match="for each of 16 runs"):
            validate_choice(system, KEY, [0.5, 0.5], verdict, n=16)
    with pytest.raises(InputError, match=r"test_validate.py, line \d+ .*AttributeError"):
        validate_choice(system, KEY, [0.5, 0.5], lambda b: b.collided, n=16)
