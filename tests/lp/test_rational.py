"""Elimination over the rationals: coordinates are exact, dependence is decided and not guessed."""

from fractions import Fraction

import numpy as np
import pytest

from parc_jax.common.lp.exact import Basis

THIRD = Fraction(1, 3)


def fractions(row):
    return [Fraction(v) for v in row]


@pytest.mark.soundness
def test_coordinates_put_the_vector_together_again(rng):
    for n in (1, 2, 4):
        basis = Basis(n)
        vectors = [fractions(rng.normal(size=n).tolist()) for _ in range(n)]
        assert all(basis.add(v) for v in vectors) and basis.full
        target = fractions(rng.normal(size=n).tolist())
        found = basis.coordinates(target)
        for j in range(n):
            assert sum(c * v[j] for c, v in zip(found, vectors, strict=True)) == target[j]


@pytest.mark.soundness
def test_a_dependent_vector_stays_out_however_close_it_is():
    basis = Basis(2)
    assert basis.add([THIRD, 2 * THIRD])
    assert not basis.add([Fraction(1, 7), Fraction(2, 7)])
    almost = [Fraction(1), 2 + Fraction(1, 10**40)]
    assert not basis.add(almost, least=Fraction(1, 10**30))  # too nearly parallel to be of use
    assert basis.coordinates([Fraction(1), Fraction(0)]) is None  # outside of the span
    assert basis.coordinates([Fraction(1), Fraction(2)]) == [3]
    assert basis.add(almost) and basis.full and not basis.add([Fraction(5), Fraction(8)])


def test_coordinates_agree_with_floats(rng):
    rows = rng.normal(size=(3, 3))
    basis = Basis(3)
    assert all(basis.add(fractions(row.tolist())) for row in rows) and len(basis) == 3
    found = [float(c) for c in basis.coordinates(fractions([1.0, 2.0, 3.0]))]
    np.testing.assert_allclose(found, np.linalg.solve(rows.T, [1.0, 2.0, 3.0]), rtol=1e-12)
