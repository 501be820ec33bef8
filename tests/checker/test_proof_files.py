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


def listed():
    """Theories in the order in which they are compiled."""
    text = (ROOT / PROVED[0] / "_CoqProject").read_text()
    return re.findall(r"^theories/(\w+)\.v$", text, re.MULTILINE)


def needed(name):
    """A theory and all that it rests on, in that order."""
    text = (THEORIES / f"{name}.v").read_text()
    of = " ".join(re.findall(r"^From ParcJax Require (?:Import )?([\w\s]+)\.", text, re.MULTILINE))
    names = {name}.union(*(needed(other) for other in of.split()))
    return [other for other in listed() if other in names]


def last_changed():
    """The first theory of those that are not as the last commit of theories found them, or that it
    changed; the first of all where the history is not here.
    """
    said = ""
    for command in (["diff", "HEAD"], ["log", "-1", "--format="]):
        asked = ["git", *command, "--name-only", "--", str(THEORIES)]
        said = said or subprocess.run(asked, cwd=ROOT, capture_output=True, text=True).stdout
    changed = {Path(line).stem for line in said.splitlines()}
    return next((name for name in listed() if name in changed), listed()[0])


@pytest.mark.needs("coq")
def test_the_first_theory_that_changed_last_is_proved_again(tmp_path):
    for name in needed(last_changed()):
        shutil.copy(THEORIES / f"{name}.v", tmp_path)
        command = ["coqc", "-q", "-Q", ".", "ParcJax", f"{name}.v"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-2000:]


def test_what_a_theory_rests_on_is_found():
    assert needed("Spec") == ["Spec"]
    assert needed("Draws") == ["ClaimSpec", "ListFacts", "Draws"]
    assert set(listed()) - set(needed("Statements")) == set()


def test_the_guarantees_name_the_files_that_are_to_be_read():
    """Those whose hash test_rocq.py compares."""
    page = (ROOT / "docs" / "guarantees.md").read_text(encoding="utf-8")
    to_read = {"Spec", "ClaimSpec", "Episode", "Json", "Format", "Statements"}
    assert set(re.findall(r"`(\w+)\.v`", page)) == to_read
