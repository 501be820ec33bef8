"""Who may import whom: a stage uses the stages above it and itself. Read from the source, nothing is run."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import parc_jax

ROOT = Path(parc_jax.__file__).parent
ORDER = (
    "checker", "checker_cells",  # the standard library alone
    "errors", "tolerances", "keys", "arrays",
    "lp", "sets", "system", "problem", "problem_moving", "distributed",
    "rollout", "network", "pwa", "error", "model", "reach", "avoid", "certify", "answer", "planner",
    "exchange", "plot", "study", "cli",
)  # fmt: skip
HEAVY = ("sims", "benchmarks", "mujoco", "brax", "matplotlib", "clarabel", "tqdm", "tyro", "scipy.optimize")


def imports(text: str, anywhere: bool):
    """(dotted name, line) of every import; with anywhere=False only those that run when the module is loaded."""
    tree = ast.parse(text)
    nodes = list(ast.walk(tree)) if anywhere else list(at_load(tree))
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in line {node.lineno}"
            whole = node.module in ("parc_jax", "scipy")
            yield from ((f"{node.module}.{a.name}" if whole else node.module, node.lineno) for a in node.names)


def at_load(node):
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            yield child
            yield from at_load(child)


def stage_of(path: Path) -> str:
    return path.relative_to(ROOT).with_suffix("").parts[0]


def upward(path: Path, text: str) -> list[str]:
    """Imports of parc_jax stages that are not above the file's own."""
    own = ORDER.index(stage_of(path))
    found = []
    for name, line in imports(text, anywhere=True):
        parts = name.split(".")
        if parts[0] == "parc_jax" and len(parts) > 1 and parts[1] in ORDER and ORDER.index(parts[1]) > own:
            found.append(f"{path.relative_to(ROOT)}:{line} imports {name}")
    return found


FILES = sorted(p for p in ROOT.rglob("*.py") if p != ROOT / "__init__.py")


def test_every_stage_has_a_place_in_the_order():
    assert {stage_of(p) for p in FILES} <= set(ORDER), "add the new stage to ORDER, below everything that it imports"


def test_stages_import_only_from_above():
    assert [line for p in FILES for line in upward(p, p.read_text())] == []


def test_an_upward_import_would_be_found():
    assert upward(ROOT / "sets" / "box.py", "def f():\n    from parc_jax.certify.scene import scene\n")
    assert upward(ROOT / "certify" / "draw.py", "from parc_jax import planner\n")
    assert not upward(ROOT / "certify" / "draw.py", "from parc_jax.model import TrajectoryModel\n")


@pytest.mark.parametrize("name", ["checker.py", "checker_cells.py"])
def test_the_checker_uses_the_standard_library_alone(name):
    for module, _ in imports((ROOT / name).read_text(), anywhere=True):
        assert module.split(".")[0] in sys.stdlib_module_names, module


def heavy(text: str) -> list[str]:
    names = [name for name, _ in imports(text, anywhere=False)]
    return [n for n in names if any(n == h or n.startswith(h + ".") for h in HEAVY)]


def test_nothing_heavy_is_imported_at_load():
    assert {str(p.relative_to(ROOT)): heavy(p.read_text()) for p in FILES if heavy(p.read_text())} == {}
    assert heavy("import mujoco.mjx\n") and heavy("if True:\n    from scipy.optimize import linprog\n")
    assert not heavy("def f():\n    import brax\n")


def test_robots_are_never_named_by_the_engine():
    for path in FILES:
        if stage_of(path) in ("cli", "study"):
            continue  # these load robots by name, when asked
        names = [name.split(".")[0] for name, _ in imports(path.read_text(), anywhere=True)]
        assert not {"sims", "mujoco", "brax"} & set(names), path


@pytest.mark.parametrize(("module", "absent"), [("parc_jax", "jax"), ("parc_jax.checker", "numpy")])
def test_start_up_is_light(module, absent):
    code = f"import sys, {module}; sys.exit({absent!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
