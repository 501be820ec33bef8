"""No key twice: of two values for one, another reader of the file may believe the other."""

import json
import sys
from pathlib import Path

import answer_files as build
import known
import known_points
import pytest

from parc_jax.checker.proved import PROVED_JS

sys.path.insert(0, str(Path(__file__).parent / "compare"))

import two
from two_readers import at, objects, with_a_key_twice

VALID = known.VALID | known_points.VALID
META = {"note": [{"deep": {"a": 1}}]}
ON_NODE = ["node", PROVED_JS.parent / "js" / "run.js", PROVED_JS]


def every_kind_of_object():
    """[(answer, place)] of one object of each kind: the names on the way to it, and its own."""
    found = {}
    for make in VALID.values():
        answer = build.rehash(make()) | {"meta": META}
        for path in objects(answer):
            way = (name for name in path if isinstance(name, str))
            found.setdefault((*way, ..., *sorted(at(answer, path))), (answer, path))
    return list(found.values())


FOUND = every_kind_of_object()
TWICE = [with_a_key_twice(answer, path, key) for answer, path in FOUND for key in at(answer, path)]


def test_there_is_an_object_of_each_kind():
    ways = {".".join(name for name in path if isinstance(name, str)) for _, path in FOUND}
    parts = "problem network tube claim hash samples sets corridors doubt no_plan meta".split()
    inner = "problem.body.parts tube.final claim.evidence.blocks doubt.room no_plan.tree.bounded"
    assert {"", *parts, *inner.split(), "meta.note.deep"} <= ways and len(TWICE) > 100


def test_the_python_checker_takes_no_key_twice():
    assert {two.whole_verdict(text) for text in TWICE} == {"a key appears twice"}


@pytest.mark.needs("node")
def test_the_proved_checker_takes_no_key_twice():
    said = two.proved_verdicts(ON_NODE, TWICE)
    assert [one["code"] for one in said] == [1] * len(TWICE)
    assert all("a key that appears twice" in one["lines"][0] for one in said)


@pytest.mark.needs("node")
def test_both_take_the_same_files_with_each_key_once():
    whole = [json.dumps(answer) for answer, _ in FOUND]
    assert {two.whole_verdict(text) for text in whole} == {None}
    assert {one["code"] for one in two.proved_verdicts(ON_NODE, whole)} == {0}
