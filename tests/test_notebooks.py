"""The notebooks: committed without outputs, made of code that compiles, and run from top to bottom
without a screen.
"""

import ast
import json
from pathlib import Path

import pytest
from needs import need

BOOKS = sorted((Path(__file__).resolve().parents[1] / "docs" / "notebooks").glob("*.ipynb"))


def code(path: Path) -> list[str]:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


def test_there_are_two():
    assert [path.stem for path in BOOKS] == ["drift_parking", "your_own_robot"]


@pytest.mark.parametrize("path", BOOKS, ids=lambda p: p.stem)
def test_a_notebook_is_small_clean_and_compiles(path):
    need("nbformat")
    import nbformat

    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    assert path.stat().st_size < 20_000
    assert all(
        not cell.outputs and cell.execution_count is None
        for cell in book.cells
        if cell.cell_type == "code"
    )
    for source in code(path):
        lines = [line for line in source.splitlines() if not line.startswith("%")]
        compile("\n".join(lines), str(path), "exec")


@pytest.mark.parametrize("path", BOOKS, ids=lambda p: p.stem)
def test_what_a_notebook_imports_is_there(path):
    """Fast, so that a renamed function is noticed before the long test runs."""
    tree = ast.parse(
        "\n".join(line for source in code(path) for line in source.splitlines() if line[:1] != "%")
    )
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    assert len(imports) >= 4
    exec(compile(ast.Module(imports, []), str(path), "exec"), {})


@pytest.mark.night
@pytest.mark.parametrize("path", BOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    """In a kernel of its own, as a stranger runs it. Every figure that it makes is shown."""
    need("nbclient", "nbformat", "ipykernel")
    import nbclient
    import nbformat

    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    for name in ("JAX_COMPILATION_CACHE_DIR", "TF_CPP_MIN_LOG_LEVEL"):  # set by conftest.py
        monkeypatch.delenv(name)
    book = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(book, kernel_name="python3", resources=resources).execute()
    shown = [out for cell in book.cells for out in cell.get("outputs", [])]
    pictures = sum("image/png" in out.get("data", {}) for out in shown)
    said = "".join(
        out.text for out in shown if out.output_type == "stream" and out.name == "stdout"
    )
    assert pictures == {"drift_parking": 5, "your_own_robot": 2}[path.stem]
    assert "proved in exact arithmetic" in said and "(E) With confidence 0.95" in said
    assert not [out.text for out in shown if out.output_type == "stream" and out.name == "stderr"]
    assert any(tmp_path.glob("*_answer.json"))
