"""What the proofs are made from changes only together with a run of them, and by day too some of
them are run where Coq is.
"""

import hashlib
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROVED = ("parc_jax/checker/proved", "parc_jax/drive/onboard/proved")
KINDS = ("Makefile", "_CoqProject", "theories/*.v", "program/*.ml", "js/*.ml", "js/*.js")
BY_DAY = ("ClaimSpec", "ListFacts", "Draws")  # of these claims are told: a second or two
THEORIES = ROOT / PROVED[0] / "theories"


@pytest.mark.parametrize("name", PROVED)
def test_the_proofs_that_last_passed_were_of_these_files(name):
    folder = ROOT / name
    kept = dict(line.split()[::-1] for line in (folder / "sources.sha256").read_text().splitlines())
    made = {"program/check.ml"}  # from the theories, where somebody ran make
    found = {str(path.relative_to(folder)) for kind in KINDS for path in folder.glob(kind)} - made
    here = {file: hashlib.sha256((folder / file).read_bytes()).hexdigest() for file in found}
    changed = sorted(file for file in found | set(kept) if here.get(file) != kept.get(file))
    assert not changed, (
        f"{name}: {', '.join(changed)} changed after all proofs were run. Run them where Coq is, "
        f"`make -C {name} hashes`; it writes these hashes only when they pass, and its "
        "sources.sha256 is committed with the change."
    )


@pytest.mark.parametrize("name", PROVED)
def test_every_theory_is_among_the_proofs(name):
    """A file that nobody compiles proves nothing."""
    folder = ROOT / name
    text = "".join((folder / file).read_text() for file in ("_CoqProject", "Makefile"))
    theories = [str(path.relative_to(folder)) for path in folder.glob("theories/*.v")]
    assert theories and not [path for path in theories if path not in text]


@pytest.mark.needs("coq")
def test_what_runs_show_is_proved_again(tmp_path):
    for name in BY_DAY:
        shutil.copy(THEORIES / f"{name}.v", tmp_path)
        command = ["coqc", "-q", "-Q", ".", "ParcJax", f"{name}.v"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-2000:]


def test_the_guarantees_name_the_files_that_are_to_be_read():
    """Those whose hash test_rocq.py compares."""
    page = (ROOT / "docs" / "guarantees.md").read_text(encoding="utf-8")
    assert set(re.findall(r"`(\w+)\.v`", page)) == {"Spec", "ClaimSpec", "Episode", "Statements"}
