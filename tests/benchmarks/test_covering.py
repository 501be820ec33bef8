"""The times of a cover are read off its looks, and what never came is not a number."""

from pathlib import Path
from types import SimpleNamespace

from benchmarks.covering import Options, _facts, _spread
from parc_jax.safe_set.corridors.found import Progress
from parc_jax.safe_set.corridors.stopping import Coverage

LOOKS = [Progress(0.1, 3, 0.9), Progress(0.4, 8, 0.993), Progress(3.2, 9, 0.995)]
SURE, SHORT = Coverage(0.995, 0.991, 0.99, 6000, 30), Coverage(0.991, 0.985, 0.99, 6000, 54)


def test_facts_of_one_query():
    options = Options(Path("model.npz"))
    for coverage, certified in ((SURE, 3.2), (SHORT, None)):
        answer = SimpleNamespace(cover=SimpleNamespace(history=LOOKS), coverage=coverage)
        assert list(_facts(answer, options).values()) == [0.4, 8, certified, 0.993]


def test_unknown_values_are_counted_and_left_out():
    assert _spread([1.0, None, 3.0]) == {
        "median": 2.0,
        "least": 1.0,
        "most": 3.0,
        "known": "2 of 3",
    }
    assert _spread([None]) == {"known": "0 of 1"}
