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
    "common",
    "learning",
    "problem",
    "safe_set",
    "proof",
    "statement",
    "method",
    "answer",
    "planner",
    "drive",
    "app",
    "bags",  # a guest: nothing else imports it, but by a door
)
# who may import from below all the same, and what: inside of a function, or for types alone
DOORS = {
    "answer/answer.py": "parc_jax.drive.local",
    "planner.py": "parc_jax.drive.local",
}
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
    "viser",
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
    """Imports of parc_jax stages that are not above the file's own, doors aside."""
    own, file = ORDER.index(stage_of(path)), path.relative_to(ROOT).as_posix()
    at_load = {name for name, _ in imports(text, anywhere=False)}
    found = []
    for name, line in imports(text, anywhere=True):
        _, stage, *_ = [*name.split("."), ""]
        below = name.startswith("parc_jax.") and stage in ORDER and ORDER.index(stage) > own
        door = DOORS.get(file, "-")
        if below and not (name.startswith(door) and late(file, name, text, at_load)):
            found.append(f"{file}:{line} imports {name}")
    return found


def late(file: str, name: str, text: str, at_load: set[str]) -> bool:
    """Is it imported when it is needed, or for types alone?"""
    return name not in at_load or "if TYPE_CHECKING:" in text


FILES = sorted(p for p in ROOT.rglob("*.py") if p != ROOT / "__init__.py")


def test_every_stage_has_a_place_in_the_order():
    assert {stage_of(p) for p in FILES} <= set(ORDER), (
        "add the new stage to ORDER, below everything that it imports"
    )


def test_stages_import_only_from_above():
    assert [line for p in FILES for line in upward(p, p.read_text())] == []


def test_every_door_is_used():
    for file, name in DOORS.items():
        assert name in (ROOT / file).read_text(), file


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


def test_the_checker_uses_the_standard_library_alone():
    allowed = (
        "argparse collections concurrent contextlib copy fractions functools hashlib importlib "
        "itertools json math multiprocessing operator os pathlib re signal sys typing"
    )
    files = [path for path in FILES if stage_of(path) == "checker"]
    used = {(p.name, name) for p in files for name, _ in imports(p.read_text(), anywhere=True)}
    foreign = [one for one in used if one[1].split(".")[0] not in allowed.split()]
    assert len(files) > 10 and not foreign, foreign


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
    assert found == {"common/backend.py", "common/probes.py"}


def test_robots_are_never_named_by_the_engine():
    for path in FILES:
        if path.relative_to(ROOT).parts[:2] in (("app", "cli"), ("app", "study")):
            continue  # these load robots by name, when asked
        names = [name.split(".")[0] for name, _ in imports(path.read_text(), anywhere=True)]
        assert not {"sims", "mujoco", "brax"} & set(names), path


LIGHT = [
    ("parc_jax", "jax"),
    ("parc_jax.checker", "numpy"),
    ("parc_jax.planner", "flax"),
]


def test_start_up_is_light():
    code = "import sys, {0}; sys.exit({1!r} in sys.modules)"
    asked = {pair: [sys.executable, "-c", code.format(*pair)] for pair in LIGHT}
    heavy = [pair for pair, call in asked.items() if subprocess.run(call).returncode]
    assert not heavy, heavy


ANSWER = """
import sys, jax, parc_jax as pj
from sims.drift_parking import problem
planner = pj.Planner(pj.load("tests/data/drift_4x8.npz"))
one = planner.solve(problem(), jax.random.PRNGKey(0), pj.Settings(samples=1, samples_only=True))
assert "Safe: " in one.summary() and "scipy" not in sys.modules  # which takes as long as the search
assert planner.solve(problem(), jax.random.PRNGKey(0), pj.Settings(samples_only=True)).status.found
heavy = {"mujoco", "brax", "crazyflow", "jsbsim", "vehiclemodels", "gymnasium", "torch"}
sys.exit(" ".join(heavy & set(sys.modules)) or 0)
"""


@pytest.mark.slow
def test_an_answer_loads_no_simulator():
    root = Path(__file__).parents[1]
    done = subprocess.run([sys.executable, "-c", ANSWER], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
