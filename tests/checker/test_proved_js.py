"""The proved checker as JavaScript (parc_jax/checker/proved/proved.js), which the page and `check
--second` run: it is what its sources make, and its allowance of work grows with the file.
"""

import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import known
import known_points
import pytest

from parc_jax import checker
from parc_jax.app.cli import check as second
from parc_jax.checker.question import about_the_model

SOURCE = second.PROVED_JS.parent
PAGE = Path(__file__).parents[2] / "docs" / "proved_checker.md"
MEGABYTE = 10**6


def made_from():
    """What the Makefile says of it: the names of the sources, and what made it."""
    text = (SOURCE / "Makefile").read_text()
    values = dict(re.findall(r"^(\w+) := (.*)$", text, re.MULTILINE))
    return values["JS_FROM"].replace("$(OCAML)", values["OCAML"]).split(), values["JS_BY"]


def test_it_begins_with_the_hash_of_its_sources_and_with_what_made_it():
    names, by = made_from()
    digest = hashlib.sha256(b"".join((SOURCE / name).read_bytes() for name in names)).hexdigest()
    first = [f"// sha256 of the sources: {digest}", f"// made by {by}"]
    assert second.PROVED_JS.read_text().splitlines()[:2] == first
    assert second.PROVED_JS.stat().st_size < 190_000


def test_the_page_has_the_hash_of_the_whole_and_what_made_it():
    """So that no line of it changes unseen, also where nothing can build it."""
    page = PAGE.read_text(encoding="utf-8")
    whole = hashlib.sha256(second.PROVED_JS.read_bytes()).hexdigest()
    assert f"proved.js`, sha256 `{whole}`" in page
    assert made_from()[1] in page


@pytest.mark.night
@pytest.mark.needs("coq", "js_of_ocaml")
def test_its_sources_make_it_byte_for_byte(tmp_path):
    made = shutil.ignore_patterns(*(SOURCE / ".gitignore").read_text().split())
    shutil.copytree(SOURCE, tmp_path / "proved", ignore=made)
    command = ["make", "-s", "js", f"PROVED={tmp_path / 'made.js'}"]
    done = subprocess.run(command, cwd=tmp_path / "proved", capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert (tmp_path / "made.js").read_bytes() == second.PROVED_JS.read_bytes()


@pytest.fixture
def told(monkeypatch, tmp_path):
    """What it says of a file with these bytes."""
    monkeypatch.delenv(second.VARIABLE, raising=False)

    def ask(content):
        (tmp_path / "answer.json").write_bytes(content)
        return second.ask(second.find_second(), tmp_path / "answer.json")

    return ask


@pytest.mark.needs("node")
@pytest.mark.parametrize(
    "size", [2, *(pytest.param(size, marks=pytest.mark.slow) for size in (3, 7, 19))]
)
def test_a_large_file_is_not_refused_for_its_size(told, size):
    """Counted in 32 bits, 1000 units of work for each of these bytes were less than none."""
    answer = known.bracket()
    unclaimed = next(node for node in answer["no_plan"]["tree"] if "open" in node)
    unclaimed["open"] = "x" * (size * MEGABYTE)
    said = told(json.dumps(answer).encode())
    assert said.code == second.ACCEPTED, said.lines


@pytest.mark.needs("node")
def test_bytes_that_are_not_utf_8_are_refused(told):
    text = json.dumps(known.plain())[:-1] + ', "meta": "\u00e9"}'
    assert told(text.encode("utf-8")).code == second.ACCEPTED
    said = told(text.encode("latin-1"))
    assert said.code == second.REJECTED and "not UTF-8" in said.lines[0]


@pytest.mark.needs("node")
def test_both_checkers_count_every_entry(told):
    """Also what is said twice."""
    answer = known_points.points()
    for part, n in (("samples", 70), ("sets", 2), ("corridors", 5), ("doubt", 1)):
        answer[part] *= n
    report = checker.check_answer(answer)
    assert (report.samples, report.sets, report.corridors, report.doubt) == (70, 2, 5, 1)
    said = told(json.dumps(answer).encode())
    first = [line.split("(")[0].split(":")[0].split(" of")[0].strip() for line in said.lines[1:5]]
    assert first == ["70 samples", "2 polytopes", "5 corridors", "1 box"]


@pytest.mark.needs("node")
@pytest.mark.parametrize("places", [(), ((0, 0),), ((1, 1),), ("end",), ((1, 0), "end")])
def test_both_say_in_the_same_words_whether_the_tube_holds_the_model(told, places):
    answer = known_points.beside_the_model(*places)
    words = about_the_model(checker.check_answer(answer))
    assert ("every bin" in words) == (places == ())
    assert told(json.dumps(answer).encode()).lines.count(words) == 1


@pytest.mark.needs("node")
def test_both_say_of_which_plans_shares_are_told(told):
    """Of those that end at a place of the file's box, with whatever heading."""
    words = (
        "of the (p0, k) whose first point ends in the file's box z, whatever else the goal asks, by"
    )
    answer = known.bracket()
    for lines in (
        checker.summary(checker.check_answer(answer)),
        told(json.dumps(answer).encode()).lines,
    ):
        assert words in " ".join(" ".join(lines).split())
