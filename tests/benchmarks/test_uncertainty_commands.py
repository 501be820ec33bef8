"""The commands behind the tables of uncertainty, on a few plans."""

import pytest

from benchmarks import from_here, rough_execution

MODEL = "tests/data/drift_4x8.npz"


@pytest.mark.night
def test_plans_from_here_are_found_and_proved():
    found = from_here.main(from_here.Options(model=MODEL, n=2))
    assert set(found["proved"].values()) == {2} and len(found["proved"]) == 4


@pytest.mark.night
def test_most_plans_that_withstand_the_grid_are_shown_to():
    for grid, shown in rough_execution.main(rough_execution.Options(model=MODEL, n=2000)):
        assert 0.4 * grid < shown < grid
