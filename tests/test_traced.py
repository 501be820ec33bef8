"""What a kernel is traced to is kept for later processes: found again only where nothing that it
depends on has changed, and equal to a fresh trace.
"""

import re
import subprocess
import sys
import zlib
from pathlib import Path

import jax
import numpy as np
import pytest
from jax import export
from toy_models import toy_case

from parc_jax.common import traced as module
from parc_jax.safe_set.corridors import first
from parc_jax.safe_set.verdict.scene import scene_of


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """What is kept goes there, until the test has ended."""
    monkeypatch.setattr(module, "_folders", [])
    monkeypatch.setattr(module, "_programs", {})
    module.keep_traced(tmp_path)
    return tmp_path


TRACED = []


@jax.jit
def kernel(x, by):
    TRACED.append(by)
    return {"product": x * by}


def asked(x, by=2.0):
    """The kernel of a new process: nothing is remembered but files."""
    module._programs.clear()
    TRACED.clear()
    found = module.traced(kernel, (x,), (by,), jax.devices()[0], None)(x)
    assert np.array_equal(found["product"], np.asarray(x) * by)
    return len(TRACED)


def test_a_later_process_does_not_trace(folder):
    x = np.arange(3.0)
    assert asked(x) > 0 and asked(x) == 0 and asked(x + 1) == 0


def test_what_it_depends_on_is_its_name(folder, monkeypatch):
    x = np.arange(3.0)
    asked(x)
    assert asked(np.arange(4.0)) and asked(x.astype(np.float32)) and asked(x, 3.0)
    with jax.default_matmul_precision("bfloat16"):
        assert asked(x)
    monkeypatch.setattr(module, "_sources", lambda: "changed")
    assert asked(x)


@pytest.mark.parametrize("left", [b"", b"noise", zlib.compress(b"no program")])
def test_a_damaged_file_is_traced_anew(folder, left):
    x = np.arange(3.0)
    asked(x)
    (file,) = folder.iterdir()
    file.write_bytes(left)
    assert asked(x) > 0 and asked(x) == 0


def test_where_nothing_can_be_written_it_is_traced(folder):
    module.keep_traced(folder / "none")
    assert asked(np.arange(3.0)) > 0


def test_a_change_of_any_source_changes_the_name(tmp_path, monkeypatch):
    file = tmp_path / "parc_jax" / "common" / "traced.py"
    file.parent.mkdir(parents=True)
    file.write_text("one")
    monkeypatch.setattr(module, "__file__", str(file))
    names = set()
    for text in ("one", "two", "one two"):
        file.write_text(text)
        names.add(module._sources.__wrapped__())
    assert len(names) == 3


def test_all_that_the_kernels_are_made_from_is_in_the_name():
    code = "import sys; import parc_jax.safe_set.corridors.first; print(*sys.modules)"
    root = Path(module.__file__).parents[2]
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, cwd=root, text=True)
    loaded = [name.split(".") for name in found.stdout.split() if name.startswith("parc_jax.")]
    assert len(loaded) > 20 and {name[1] for name in loaded} <= set(module.ROOMS)


def unplaced(text):
    """A module's text without the places in the sources, which are numbered anew each time."""
    return re.sub(r" loc\(#loc\d*\)|^#loc.*\n", "", text, flags=re.MULTILINE)


@pytest.mark.slow
def test_what_is_kept_is_a_fresh_trace(folder, tmp_path):
    """The same text, the same plans."""
    other = tmp_path / "other"
    other.mkdir()
    plans, texts = [], []
    for now in ([], [folder], [folder], [other]):
        module._folders[:] = now
        module._programs.clear()
        model, problem = toy_case(4)
        plans.append(first.first_safe(scene_of(problem, model), jax.random.PRNGKey(3), 4))
        jax.tree.map(np.testing.assert_array_equal, plans[-1], plans[0])
    assert plans[0][0].count == 4
    for now in (folder, other):
        (file,) = now.glob("*.stablehlo")
        texts.append(export.deserialize(bytearray(zlib.decompress(file.read_bytes()))))
    assert len(set(map(unplaced, (text.mlir_module() for text in texts)))) == 1
