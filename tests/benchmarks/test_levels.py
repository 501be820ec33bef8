"""Faults are noticed by day: most of them by README's tests, nearly all by the gate."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from compile_report import IMPORTS, too_many

from benchmarks.attacks.levels import AT_LEAST, LEVELS, level_of_test, shares

MARKED = """
import pytest

pytestmark = pytest.mark.soundness

def test_always(): ...

@pytest.mark.slow
def test_of_the_gate(): ...

@pytest.mark.needs("node")
@pytest.mark.slow
@pytest.mark.night
def test_of_the_night(): ...

@pytest.mark.parametrize("n", [1, pytest.param(2, marks=pytest.mark.night)])
def test_of_both(n): ...
"""


def test_most_faults_are_noticed_by_day():
    found = shares()
    assert all(found[name] >= AT_LEAST[name] for name in LEVELS), found


def test_a_level_is_that_of_the_marks(tmp_path):
    (tmp_path / "test_a.py").write_text(MARKED)
    (tmp_path / "test_b.py").write_text(MARKED.replace("mark.soundness", "mark.night"))

    def level(test):
        return LEVELS[level_of_test(test, tmp_path)]

    assert level("test_a.py::test_always") == "default"
    assert level("test_a.py::test_of_the_gate") == "gate"
    assert level("test_a.py::test_of_the_night") == "night"
    assert level("test_a.py::test_of_both[2]") == "default"
    assert level("test_b.py::test_always") == "night"
    with pytest.raises(KeyError):
        level("test_a.py::test_none")


def test_files_that_call_the_same_kernels_stay_on_one_worker(pytestconfig):
    told = SimpleNamespace(getvalue={"dist": "load", "tx": ["2*popen"]}.get)
    (conftest,) = (
        plugin
        for name, plugin in pytestconfig.pluginmanager.list_name_plugin()
        if str(name).endswith(str(Path("tests", "conftest.py")))
    )
    group = conftest.pytest_xdist_make_scheduler(told, None)._split_scope
    assert group("tests/claim/test_a.py::test_b[1]") == group("tests/local/test_c.py::test_d")
    assert group("tests/soundness/test_claims.py::t") == group("tests/claim/test_a.py::t")
    assert group("tests/cover/test_a.py::test_b") != group("tests/claim/test_a.py::test_b")
    assert group("tests/test_a.py::test_b[1]") == group("tests/test_a.py::test_c")


def test_a_run_that_compiles_more_than_its_budgets_is_told_the_file():
    budget = {"whole": 20, "unlisted": 5, "files": {"test_a.py": 12}}
    assert too_many({"test_a.py": 12, "test_b.py": 5}, budget, whole=True) == []
    assert too_many({"test_a.py": 13, "test_b.py": 6}, budget, whole=False) == [
        "test_a.py compiled 13 programs, its budget is 12",
        "test_b.py compiled 6 programs, its budget is 5",
    ]
    assert too_many({IMPORTS: 20}, budget, whole=True) == []
    many = {f"test_{letter}.py": 5 for letter in "bcde"} | {"test_a.py": 12}
    assert too_many(many, budget, whole=False) == []
    (line,) = too_many(many, budget, whole=True)
    assert "32 programs, the budget is 20" in line and "test_a.py" in line
