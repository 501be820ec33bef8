"""How many runs a claim costs: against the published table and against exact rationals."""

import re
from decimal import Decimal, localcontext
from fractions import Fraction
from math import comb
from pathlib import Path

import pytest
from scipy.special import bdtr

import parc_jax
from parc_jax.common.errors import InputError
from parc_jax.learning.bound import counts
from parc_jax.learning.bound.counts import (
    as_probability,
    clopper_pearson,
    least_probability,
    most_discards,
    required_runs,
    supported_eps,
    wrong_claim_probability,
)

pytestmark = pytest.mark.soundness


def exact_tail(n, eps, discard):
    eps = Fraction(str(eps))
    return sum(comb(n, i) * eps**i * (1 - eps) ** (n - i) for i in range(discard + 1))


def test_the_bound_inverts_the_binomial_tail():
    for failures, n, delta in ((1, 50, 0.01), (9, 300, 1e-3), (250, 300, 1e-6)):
        eps = float(clopper_pearson(failures, n, delta))
        assert bdtr(failures, n, eps) == pytest.approx(delta, rel=1e-5)


def test_the_table_of_runs():
    deltas = (0.05, 1e-3, 1e-6, 1e-9)
    table = {
        0.1: (29, 66, 132, 197),
        0.01: (299, 688, 1375, 2062),
        1e-3: (2995, 6905, 13809, 20713),
        1e-4: (29956, 69075, 138149, 207223),
    }
    for eps, row in table.items():
        assert tuple(required_runs(eps, delta) for delta in deltas) == row
    assert required_runs(1e-5, 1e-6) == 1_381_545


@pytest.mark.parametrize(
    ("discard", "n"), [(0, 1375), (1, 1661), (5, 2532), (10, 3431), (50, 9219)]
)
def test_discards_against_exact_rationals(discard, n):
    assert required_runs(0.01, 1e-6, discard) == n
    assert exact_tail(n, 0.01, discard) <= Fraction(1, 10**6) < exact_tail(n - 1, 0.01, discard)
    assert wrong_claim_probability(n, 0.01, discard) >= exact_tail(n, 0.01, discard)


@pytest.mark.parametrize(("n", "discard"), [(60, 0), (400, 3), (6905, 0), (2_000, 5)])
def test_the_supported_eps_is_supported_and_nearly_the_smallest(n, discard):
    eps = supported_eps(n, 1e-3, discard)
    assert (
        exact_tail(n, eps, discard)
        <= Fraction(1, 1000)
        < exact_tail(n, eps * (1 - Fraction(1, 10**4)), discard)
    )


def decimal_tail(n, eps, discard):
    with localcontext(prec=60):
        eps = Decimal(eps)
        part = whole = (1 - eps) ** n
        for i in range(1, discard + 1):
            part *= (n - i + 1) * eps / (i * (1 - eps))
            whole += part
        return whole


@pytest.mark.parametrize(("n", "eps", "discard"), [(5, 0.3, 2), (315_315_000, 1e-5, 3000)])
def test_the_tail_of_many_runs_is_never_on_the_small_side(n, eps, discard):
    exact = float(decimal_tail(n, eps, discard))
    assert exact <= wrong_claim_probability(n, eps, discard) <= exact * (1 + 2e-7)


def test_rare_runs_take_more_than_an_integer_of_c():
    n = required_runs(1e-8, 1e-6, 5)
    assert n > 2**31
    assert decimal_tail(n, 1e-8, 5) <= Decimal("1e-6") < decimal_tail(n - 1000, 1e-8, 5)


@pytest.mark.parametrize(("n", "delta"), [(2_127_949_024, 0.05), (57_962_265, 0.1)])
def test_a_bound_by_many_trials_is_never_on_the_small_side(n, delta):
    """The inverse of scipy's tail was, by 1e-7 of delta."""
    assert decimal_tail(n, float(clopper_pearson(1, n, delta)), 1) <= Decimal(delta)
    for discard in (0, 1):
        assert required_runs(1e-16, 1e-6, discard) > 2**50
        with pytest.raises(InputError, match=r"^eps: expected one that fewer than 2\^61 runs show"):
            required_runs(1e-20, 1e-6, discard)


def test_most_discards_is_the_inverse_of_required_runs():
    for discard in (0, 1, 7, 40):
        n = required_runs(0.01, 1e-3, discard)
        assert (
            most_discards(n, 0.01, 1e-3) == discard
            and most_discards(n - 1, 0.01, 1e-3) == discard - 1
        )


def test_probabilities_are_the_decimals_the_user_wrote():
    assert as_probability("eps", 1e-3) == Fraction(1, 1000)
    for bad in (0, 1, 1.5, -0.1):
        with pytest.raises(InputError, match="between 0 and 1"):
            as_probability("eps", bad)


def test_one_bound_on_a_probability_serves_everybody(monkeypatch):
    """Against the binomial tail itself; and no second inversion anywhere in the package."""
    few = (0, 10, 0.05), (3, 50, 1e-3), (49, 50, 1e-6), (41, 300, 1e-9)
    for failures, n, delta in few:
        assert exact_tail(n, clopper_pearson(failures, n, delta), failures) <= delta
        summed = float(clopper_pearson(failures, n, delta))
        monkeypatch.setattr(counts, "FEW", 0)
        assert float(clopper_pearson(failures, n, delta)) == pytest.approx(summed, rel=2e-7)
        monkeypatch.undo()
    for failures, n, delta in (*few, (120, 9_000, 1e-9)):
        high = float(clopper_pearson(failures, n, delta))
        assert 0.9 * delta < bdtr(failures, n, high) <= delta  # never on the small side
        low = least_probability(n - failures, n, delta)
        assert low == pytest.approx(1 - high, abs=1e-12)
    assert least_probability(0, 5, 0.01) == 0.0 and clopper_pearson(5, 5, 0.01) == 1
    inverted = re.compile(r"betainc|beta\.(ppf|isf)")
    root = Path(parc_jax.__file__).parent
    found = {str(p.relative_to(root)) for p in root.rglob("*.py") if inverted.search(p.read_text())}
    assert found == {"learning/bound/counts.py"}
