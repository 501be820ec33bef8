"""Answers at the door: what makes no sense is refused in a sentence; sets are drawn from evenly."""

import json

import numpy as np
import pytest

from benchmarks.suite.answer import Piece, Sets, read
from benchmarks.suite.bad import Refused

LO, HI = np.zeros(3), np.ones(3)
BAD = {
    "no JSON": (b"{", "JSON"),
    "not an object": (b"[]", "object"),
    "another word": (b'{"verdict": "some", "discs": []}', "object with"),
    "no verdict": (b'{"plans": [[0, 0, 0]]}', "verdict"),
    "plans beside none": (b'{"verdict": "none", "plans": [[0, 0, 0]]}', "beside"),
    "two coordinates": (b'{"verdict": "some", "plans": [[0, 0]]}', "rows of 3"),
    "uneven rows": (b'{"verdict": "some", "plans": [[0, 0, 0], [0]]}', "rows of 3"),
    "words": (b'{"verdict": "some", "plans": [["a", 0, 0]]}', "rows of 3"),
    "NaN": (b'{"verdict": "some", "plans": [[NaN, 0, 0]]}', "NaN"),
    "strings": (b'{"verdict": "some", "plans": [["0", "0", "0"]]}', "finite numbers"),
    "a number too large": (b'{"verdict": "some", "plans": [[1e999, 0, 0]]}', "finite numbers"),
    "a plan outside": (b'{"verdict": "some", "plans": [[2, 0, 0]]}', "start"),
    "a box without hi": (b'{"verdict": "some", "boxes": [{"lo": [0, 0, 0]}]}', "hi, lo"),
    "a box that is a list": (b'{"verdict": "some", "boxes": [[0, 0, 0]]}', "objects"),
    "rows without numbers": (
        b'{"verdict": "some", "polytopes": '
        b'[{"lo": [0, 0, 0], "hi": [1, 1, 1], "A": [[1, 0, 0]], "b": []}]}',
        "each row",
    ),
    "b that is a number": (
        b'{"verdict": "some", "polytopes": '
        b'[{"lo": [0, 0, 0], "hi": [1, 1, 1], "A": [[1, 0, 0]], "b": 3}]}',
        "b of a polytope",
    ),
    "too many": (json.dumps({"verdict": "some", "plans": [[0, 0, 0]] * 100_001}).encode(), "most"),
    "deep": (b"[" * 100_000, "JSON"),
}


@pytest.mark.parametrize("name", BAD)
def test_nonsense_is_refused_in_a_sentence(name):
    text, word = BAD[name]
    with pytest.raises(Refused, match=word) as refused:
        read(text, LO, HI)
    assert len(str(refused.value)) < 300 and "\n" not in str(refused.value)


def test_sets_are_cut_to_the_plans_that_may_be_asked():
    text = b'{"verdict": "some", "boxes": [{"lo": [-9, 0, 0], "hi": [9, 1, 1]}, '
    text += b'{"lo": [4, 4, 4], "hi": [5, 5, 5]}]}'
    (piece,) = read(text, LO, HI).pieces
    assert (piece.lo == LO).all() and (piece.hi == HI).all()


def test_draws_are_even_over_a_union():
    """Two boxes that share a half, and a triangle: shares of each cell are those of its volume."""
    none = np.empty((0, 2)), np.empty(0)
    pieces = (
        Piece(np.array([0.0, 0]), np.array([2.0, 1]), *none),
        Piece(np.array([1.0, 0]), np.array([3.0, 1]), *none),
        Piece(np.array([4.0, 0]), np.array([5.0, 1]), np.array([[1.0, 1]]), np.array([5.0])),
    )
    sets = Sets(pieces, np.random.default_rng(0))
    drawn = sets.draw(35_000)
    cells = np.bincount(drawn[:, 0].astype(int), minlength=5) / len(drawn)
    assert np.abs(cells - np.array([1, 1, 1, 0, 0.5]) / 3.5).max() < 0.015
    assert sets.holds(drawn).all()


def test_what_is_flat_or_empty_has_no_volume():
    point = Piece(np.zeros(2), np.zeros(2), np.empty((0, 2)), np.empty(0))
    thin = Piece(np.zeros(2), np.ones(2), np.array([[1.0, 1], [-1, -1]]), np.array([1.0, -1]))
    rng = np.random.default_rng(0)
    assert Sets((point,), rng).flat and (Sets((point,), rng).draw(3) == 0).all()
    assert not Sets((thin,), rng)
    sliver = Piece(np.zeros(2), np.ones(2), np.array([[1.0, 1], [-1, -1]]), np.array([1.00001, -1]))
    assert not Sets((sliver,), rng)  # nobody waits for draws from it


class Counting(np.random.Generator):
    """Chance that counts the numbers that it was asked for."""

    asked = 0

    def uniform(self, low, high, size):
        self.asked += int(np.prod(size))
        return super().uniform(low, high, size)


def test_dust_is_told_by_a_third_of_the_draws_and_chance_goes_on_as_after_all():
    thin = np.array([[1.0, 1], [-1, -1]])
    dust = Piece(np.zeros(2), np.ones(2), thin, np.array([1e-9, 0.0]))
    rng, other = (kind(np.random.PCG64(1)) for kind in (Counting, np.random.Generator))
    assert not Sets((dust, dust), rng)
    drawn = 2 * 1_134_592 * 2  # of two pieces two coordinates each, until more than a million
    other.random(drawn)
    assert rng.asked < 0.31 * drawn and rng.random() == other.random()


def test_few_draws_around_dust_are_compared_with_all_rows():
    seen = []

    class Rows(np.ndarray):
        def __matmul__(self, other):
            seen.append(len(self) * other.shape[1])
            return np.asarray(self) @ np.asarray(other)

    class Chance:
        def uniform(self, low, high, size):
            return np.random.default_rng(0).uniform(low, high, size).view(Rows)

    A = np.tile(np.array([[1.0, 1], [-1, -1]]), (50, 1))
    dust = Piece(np.zeros(2), np.ones(2), A, np.tile([1e-9, 0.0], 50))
    assert len(dust.draw(Chance(), 4096)) == 0
    assert sum(seen) <= 0.1 * 4096 * 100
