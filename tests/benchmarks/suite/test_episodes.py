"""The episode track: a driver is a program; a contact costs what a false answer costs."""

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.suite.bad import Refused
from benchmarks.suite.episodes import episode
from benchmarks.suite.score import LOST, WHOLE
from sims.barn.worlds import metric, world

ROOT = Path(__file__).parents[3]
DRIVE = ROOT / "docs" / "examples" / "suite_entry" / "drive"


def driver(body):
    """A program that answers every line by the value of an expression."""
    code = f"import json, sys\nfor line in sys.stdin:\n  print({body}, flush=True)"
    return [sys.executable, "-c", code]


def test_who_drives_straight_on_touches_and_loses():
    found = episode(286, driver("json.dumps({'v': 2, 'w': 0})"), 0)
    assert found["points"] == LOST and found["clearance"] <= 0 and not found["reached"]


def test_a_drive_is_worth_the_metric_and_is_repeated_by_its_seed(capsys):
    found = [episode(1, [str(DRIVE)], 3) for _ in range(2)]
    assert found[0] == found[1]
    if found[0]["clearance"] > 0:
        worth = metric(found[0]["reached"], found[0]["seconds"], world(1).path_length)
        assert found[0]["points"] == pytest.approx(WHOLE * worth / 0.5, abs=1e-3)


@pytest.mark.parametrize("said", ["'no'", "json.dumps({'v': 1})", '\'{"v": NaN, "w": 0}\''])
def test_a_line_without_sense_is_refused(said):
    with pytest.raises(Refused, match="driver: expected"):
        episode(1, driver(said), 0)


@pytest.mark.parametrize("missing", ["numpy", "parc_jax", "sims"])
def test_an_environment_without_a_simulator_is_told_in_a_sentence(missing):
    code = f"import runpy, sys; sys.modules[{missing!r}] = None; "
    code += "runpy.run_module('benchmarks.suite.episodes', run_name='__main__')"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 1 and run.stderr.startswith("episodes: expected parc_jax")
    assert missing in run.stderr and run.stderr.count("\n") == 1
