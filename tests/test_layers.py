"""Who may import whom: a stage uses the stages above it and itself. Read from the source, nothing
is run.
"""

import ast
import functools
import re
import subprocess
import sys
from pathlib import Path

import pytest

import parc_jax

ROOT = Path(parc_jax.__file__).parent
ORDER = (
    "checker",  # the standard library alone
    "errors",
    "base",
    "settings",
    "lp",
    "sets",
    "system",
    "problem",
    "world",
    "rollout",
    "network",
    "prior",
    "pwa",
    "claim",
    "model",
    "robust",
    "separation",
    "verdict",
    "cover",
    "certificate",
    "no_plan",
    "batch",
    "published",
    "methods",
    "sentences",
    "local",
    "answer",
    "planner",
    "loop",
    "onboard",
    "io",
    "plot",
    "figures",  # a face, as the two others
    "types",
    "bags",
    "exchange",
    "ros",
    "study",
    "cli",
)
# who asks for the published method, and draws its verdicts of regions: above the engine (and
# benchmarks)
USES_PUBLISHED = ("figures", "study", "cli")
HEAVY = (
    "sims",
    "benchmarks",
    "mujoco",
    "brax",
    "matplotlib",
    "clarabel",
    "tqdm",
    "tyro",
    "scipy.optimize",
)


@functools.cache
def statements(text: str, anywhere: bool) -> tuple[ast.AST, ...]:
    """All nodes of a file, or those that run when it is loaded."""
    tree = ast.parse(text)
    return tuple(ast.walk(tree)) if anywhere else tuple(at_load(tree))


def imports(text: str, anywhere: bool):
    """(dotted name, line) of every import; with anywhere=False only those that run when the module
    is loaded.
    """
    for node in statements(text, anywhere):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                continue  # within a folder; only the checker may, see below
            whole = node.module in ("parc_jax", "scipy")
            yield from (
                (f"{node.module}.{a.name}" if whole else node.module, node.lineno)
                for a in node.names
            )


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
        if (
            parts[0] == "parc_jax"
            and len(parts) > 1
            and parts[1] in ORDER
            and ORDER.index(parts[1]) > own
        ):
            found.append(f"{path.relative_to(ROOT)}:{line} imports {name}")
    return found


FILES = sorted(p for p in ROOT.rglob("*.py") if p != ROOT / "__init__.py")


def test_every_stage_has_a_place_in_the_order():
    assert {stage_of(p) for p in FILES} <= set(ORDER), (
        "add the new stage to ORDER, below everything that it imports"
    )


def test_stages_import_only_from_above():
    assert [line for p in FILES for line in upward(p, p.read_text())] == []


def test_an_upward_import_would_be_found():
    assert upward(
        ROOT / "sets" / "box.py",
        "def f():\n    from parc_jax.safe_set.verdict.scene import scene_of\n",
    )
    assert upward(ROOT / "cover" / "sampling.py", "from parc_jax import planner\n")
    assert not upward(
        ROOT / "cover" / "sampling.py", "from parc_jax.learning.model import TrajectoryModel\n"
    )


def published_in(path: Path, text: str) -> list[str]:
    """Imports of the published baseline where it has no business."""
    if stage_of(path) in ("published", *USES_PUBLISHED):
        return []
    names = [name for name, _ in imports(text, anywhere=True)]
    return [f"{path.relative_to(ROOT)}: {n}" for n in names if n.startswith("parc_jax.neuralparc")]


def test_the_published_baseline_is_used_by_nothing_but_its_users():
    assert [line for p in FILES for line in published_in(p, p.read_text())] == []
    systems = Path(parc_jax.__file__).parents[1] / "sims"
    for path in sorted(systems.rglob("*.py")):
        assert "parc_jax.neuralparc" not in path.read_text(), path


def test_a_new_use_of_the_published_baseline_would_be_found():
    text = "def f():\n    from parc_jax.neuralparc.brs import brs_rows\n"
    assert published_in(ROOT / "plot" / "regions.py", text)
    assert published_in(ROOT / "answer.py", "from parc_jax import published\n")
    assert published_in(ROOT / "methods.py", text)
    assert not published_in(ROOT / "figures.py", text)


def relative(text: str) -> list[int]:
    """Levels of all relative imports."""
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
    return [node.level for node in nodes if node.level]


def test_only_the_checker_imports_relatively():
    """It is a folder that is copied, under any name, and knows nothing outside of it."""
    found = {stage_of(path) for path in FILES if relative(path.read_text())}
    assert found == {"checker"}
    for path in (ROOT / "checker").rglob("*.py"):
        assert set(relative(path.read_text())) <= {1}


@pytest.mark.parametrize("path", sorted((ROOT / "checker").rglob("*.py")), ids=lambda p: p.name)
def test_the_checker_uses_the_standard_library_alone(path):
    for module, _ in imports(path.read_text(), anywhere=True):
        assert module.split(".")[0] in sys.stdlib_module_names, module


def heavy(text: str) -> list[str]:
    names = [name for name, _ in imports(text, anywhere=False)]
    return [n for n in names if any(n == h or n.startswith(h + ".") for h in HEAVY)]


def test_nothing_heavy_is_imported_at_load():
    assert {
        str(p.relative_to(ROOT)): heavy(p.read_text()) for p in FILES if heavy(p.read_text())
    } == {}
    assert heavy("import mujoco.mjx\n") and heavy(
        "if True:\n    from scipy.optimize import linprog\n"
    )
    assert not heavy("def f():\n    import brax\n")


def test_who_depends_on_the_kind_of_device_asks_one_place():
    """But for probes, which name it, and fmpy, whose platform is another thing."""
    asks = re.compile(r"default_backend|(?<!fmpy)\.platform\b")
    found = {str(p.relative_to(ROOT)) for p in FILES if asks.search(p.read_text())}
    assert found == {"base/backend.py", "base/probes.py"}


def test_robots_are_never_named_by_the_engine():
    for path in FILES:
        if stage_of(path) in ("cli", "study"):
            continue  # these load robots by name, when asked
        names = [name.split(".")[0] for name, _ in imports(path.read_text(), anywhere=True)]
        assert not {"sims", "mujoco", "brax"} & set(names), path


LIGHT = [
    ("parc_jax", "jax"),
    ("parc_jax.checker", "numpy"),
    ("parc_jax.planner.planner", "flax"),
]


@pytest.mark.parametrize(("module", "absent"), LIGHT)
def test_start_up_is_light(module, absent):
    code = f"import sys, {module}; sys.exit({absent!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


ANSWER = """
import sys, jax, parc_jax as pj
from sims.drift_parking import problem
planner = pj.Planner(pj.load("tests/data/drift_4x8.npz"))
assert planner.solve(problem(), jax.random.PRNGKey(0), pj.Settings(samples_only=True)).found
heavy = {"mujoco", "brax", "crazyflow", "jsbsim", "vehiclemodels", "gymnasium", "torch"}
sys.exit(" ".join(heavy & set(sys.modules)) or 0)
"""


@pytest.mark.slow
def test_an_answer_loads_no_simulator():
    root = Path(__file__).parents[1]
    done = subprocess.run([sys.executable, "-c", ANSWER], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
