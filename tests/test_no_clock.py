"""No test depends on how fast or how busy a machine is: none reads a clock, and no budget of a
query is so small that it could end one. What hangs is ended by one clock, that of pyproject.toml.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent
FILES = sorted(ROOT.rglob("*.py"))
# prints times that nothing is asserted of; waits between two questions to a browser; a world that
# ends when no robot comes; runs with time to be killed in; a node that is asked twice to end
MAY_READ_IT = {
    "pwa/test_speed.py",
    "helpers/driven_browser.py",
    "helpers/ros_world.py",
    "helpers/walkers.py",
    "ros/test_node.py",
}
PATIENT = 300  # [s] many times what any query of the tests takes


def faults(text: str) -> list[str]:
    """What in a test's source depends on a clock."""
    out = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import) and "time" in [alias.name for alias in node.names]:
            out.append(f"line {node.lineno} imports time")
        if isinstance(node, ast.keyword) and isinstance(node.value, ast.Constant):
            if node.arg == "timeout":
                out.append(f"line {node.value.lineno} has a timeout of its own")
            if node.arg == "budget_s" and 0 < node.value.value < PATIENT:
                out.append(f"line {node.value.lineno}: a budget of {node.value.value} s")
    return out


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_no_test_depends_on_a_clock(path):
    if str(path.relative_to(ROOT)) not in MAY_READ_IT:
        assert not faults(path.read_text(encoding="utf-8"))


def test_a_clock_would_be_seen():
    assert len(faults("import time\nsolve(budget_s=2.0)\nrun(timeout=5)\nsolve(budget_s=300)")) == 3
