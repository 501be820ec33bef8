"""One way to run a compiled call over many rows: every row once, in order, whatever their
number.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from parc_jax.common.arrays import as_float64, difference, in_chunks, map_rows
from parc_jax.common.errors import InputError


@pytest.mark.parametrize("n", [1, 7, 8, 9, 40])
def test_chunks_hold_every_row_once_in_order_and_are_filled_up_with_the_last(n):
    seen = []

    def call(rows):
        seen.append(rows)
        return rows, 2.0 * rows

    once, twice = in_chunks(n, 8, call)
    assert once.tolist() == list(range(n)) and (twice == 2 * once).all()
    assert {len(rows) for rows in seen} == {8} and len(seen) == -(-n // 8)
    assert max(rows.max() for rows in seen) == n - 1


@pytest.mark.parametrize("n", [0, 1, 5, 64])
def test_rows_are_mapped_in_float64_whatever_their_number_and_flags(n):
    kernel = jax.jit(jax.vmap(lambda x, i: (x.sum() + i.astype(x.dtype), i)))
    x = np.arange(3.0 * n).reshape(n, 3)
    with jax.enable_x64(False):
        total, index = map_rows(4, kernel, x, np.arange(n))
    assert total.dtype == np.float64 and index.dtype == np.int64
    np.testing.assert_array_equal(total, x.sum(axis=1) + np.arange(n))
    np.testing.assert_array_equal(index, np.arange(n))


def test_one_program_serves_all_numbers_of_rows():
    traced = []

    def kernel(x):
        traced.append(x.shape)
        return jnp.sqrt(x)

    compiled = jax.jit(jax.vmap(kernel))
    for n in (0, 1, 5, 9):
        assert len(map_rows(4, compiled, np.ones(n))) == n
    assert len(traced) == 1


@pytest.mark.parametrize(
    "value",
    [10**400, 10**5000, [[1], [1, 2]], 1j, np.ma.array([[0.0]] * 2, mask=[[1], [0]])],
    ids=["400", "5000", "ragged", "complex", "masked"],
)
def test_what_no_float64_holds_is_refused(value):
    """On one line, also where Python writes it on several, or not at all."""
    with pytest.raises(InputError, match="x: expected numbers of shape") as told:
        as_float64("x", value, (None,))
    assert "\n" not in str(told.value)


def test_runs_that_failed_alike_do_not_differ_and_others_do_without_bound():
    a, b = [np.nan, np.nan, 1.0, 2.0], [np.nan, 1.0, np.nan, 0.5]
    assert difference(a, b).tolist() == [0.0, np.inf, np.inf, 1.5]


@pytest.mark.parametrize("n", [0, 1, 4, 6])
def test_rows_that_are_kept_are_kept_once(n):
    x = np.arange(n)
    kernel = lambda x: (x, 10.0 * x)  # noqa: E731
    row, found = map_rows(4, kernel, x, only=lambda found: found[0] != 2)
    np.testing.assert_array_equal(row, x[x != 2])
    np.testing.assert_array_equal(found, 10.0 * x[x != 2])


@pytest.mark.parametrize(
    "wrong",
    [True, [True, False], ([False],), np.ones(2, bool), 1j, jax.random.key(0), [[1], [1, 2]]],
)
def test_what_is_no_number_is_refused_in_our_words(wrong):
    """As NumPy reads them True is 1; and a key of JAX has a type, but no kind of numbers."""
    with pytest.raises(InputError, match="side: expected numbers of shape"):
        as_float64("side", wrong, (None,))
