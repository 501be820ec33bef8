"""The command behind the table of proofs that nothing fits, on its smallest rows."""

import pytest

from benchmarks import blocked


@pytest.mark.night
def test_where_nothing_fits_it_is_proved_with_two_parameters():
    rows = blocked.main(blocked.Options(budget_s=300, n_k=(2,)))
    assert {row["kind"] for row in rows if row["scene"] != "a wall of 1 m"} == {"proved"}
    assert len(rows) == 6
