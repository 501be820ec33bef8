"""No test depends on how fast or how busy a machine is: none reads a clock, and no budget of a
query is so small that it could end one. What hangs is ended by one clock, that of pyproject.toml.
"""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parent
# prints times that nothing is asserted of; waits between two questions to a browser; a world that
# ends when no robot comes; runs with time to be killed in; a node that is asked twice to end
MAY_READ_IT = {
    "pwa/test_speed.py",
    "helpers/driven_browser.py",
    "helpers/live_tab.py",
    "helpers/ros_world.py",
    "helpers/walkers.py",
    "plot/test_live_browser.py",
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


def test_no_test_depends_on_a_clock():
    texts = {str(p.relative_to(ROOT)): p.read_text(encoding="utf-8") for p in ROOT.rglob("*.py")}
    kept = {file: text for file, text in texts.items() if file not in MAY_READ_IT}
    wrong = [f"{file}: {why}" for file, text in kept.items() for why in faults(text)]
    assert not wrong, "\n".join(wrong)
    assert len(faults("import time\nsolve(budget_s=2.0)\nrun(timeout=5)\nsolve(budget_s=300)")) == 3
