"""The notebooks: committed with what they show, made of code that compiles, and run from top to
bottom without a screen.
"""

import ast
import json
import runpy
from pathlib import Path

import pytest
from needs import need

DOCS = Path(__file__).resolve().parents[1] / "docs"
BOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
PICTURES = {"drift_parking": 4, "your_own_robot": 2}


def code(path: Path) -> list[str]:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


def test_there_are_two():
    assert [path.stem for path in BOOKS] == ["drift_parking", "your_own_robot"]


def check_shown(book, path: Path) -> None:
    """All that a notebook has to show, and no word of trouble."""
    shown = [out for cell in book.cells for out in cell.get("outputs", [])]
    pictures = sum("image/png" in out.get("data", {}) for out in shown)
    said = "".join(
        out.text for out in shown if out.output_type == "stream" and out.name == "stdout"
    )
    assert pictures == PICTURES[path.stem]
    assert "proved in exact arithmetic" in said and "(E) With confidence 0.95" in said
    assert not [out for out in shown if out.output_type == "error"]
    assert not [out.text for out in shown if out.output_type == "stream" and out.name == "stderr"]


@pytest.mark.parametrize("path", BOOKS, ids=lambda p: p.stem)
def test_a_notebook_is_small_shows_what_came_of_it_and_compiles(path):
    need("nbformat")
    import nbformat

    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    assert path.stat().st_size < 300_000
    cells = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    check_shown(book, path)
    for source in code(path):
        lines = [line for line in source.splitlines() if not line.startswith("%")]
        compile("\n".join(lines), str(path), "exec")


@pytest.mark.parametrize("path", BOOKS, ids=lambda p: p.stem)
def test_what_a_notebook_names_is_there(path):
    """Fast, so that a function that was renamed or left is noticed before the long test runs."""
    tree = ast.parse(
        "\n".join(line for source in code(path) for line in source.splitlines() if line[:1] != "%")
    )
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    assert len(imports) >= 4
    there = {}
    exec(compile(ast.Module(imports, []), str(path), "exec"), there)
    named = {ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    of_imports = {name for name in named if name.partition(".")[0] in there and "(" not in name}
    assert len(of_imports) >= 10
    for name in of_imports:
        eval(name, there)


@pytest.mark.night
@pytest.mark.parametrize("path", BOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    """In a kernel of its own, as a stranger runs it. Every figure that it makes is shown."""
    need("nbclient", "nbformat", "ipykernel")
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    for name in ("JAX_COMPILATION_CACHE_DIR", "TF_CPP_MIN_LOG_LEVEL"):  # set by conftest.py
        monkeypatch.delenv(name)
    ran = runpy.run_path(str(DOCS / "make_notebooks.py"))["ran"]
    check_shown(ran(path, tmp_path), path)
    assert any(tmp_path.glob("*_answer.json"))
