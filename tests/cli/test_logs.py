"""Logging that can be turned up: silent unless asked, from the shell by an option."""

import logging
import logging.handlers

import numpy as np
import pytest
import toy_query


@pytest.fixture
def solve(shell, files):
    """Solve the toy query with further arguments."""
    asked = ("solve", "model.npz", "scene.toml", "--quiet", "--no-cache")
    return lambda *options: shell(*asked, *options)


def test_a_command_tells_what_it_does_only_when_asked(solve):
    quiet = solve()
    assert quiet[0] == 0 and quiet[2] == ""
    code, said, told = solve("--verbose")
    assert code == 0 and said == quiet[1]
    assert "planner: searched for" in told and "proved in exact arithmetic" in told
    assert logging.getLogger("parc_jax").level == logging.NOTSET  # as it was before


def test_in_python_it_is_the_standard_library_s(caplog):
    with caplog.at_level(logging.INFO, logger="parc_jax"):
        answer = toy_query.planner().solve(toy_query.gap(), np.asarray([0, 1], np.uint32))
    told = [record.getMessage() for record in caplog.records]
    assert any(f"{len(answer.corridors)} corridors" in line for line in told)
