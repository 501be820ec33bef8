"""Valid certificates are accepted; the command line says so."""

import build
import pytest

from parc_jax import checker


@pytest.mark.parametrize("seed", range(8))
def test_valid_certificates_are_accepted(seed):
    answer = build.scene(seed, body="disc" if seed % 2 else "polygon")
    report = checker.check_answer(answer)
    assert report.samples == len(answer["samples"]) > 0
    assert report.sets == len(answer["sets"]) > 0
