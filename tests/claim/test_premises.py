"""All that a claim's sentences rest on is one record: what differs in it is refused, or said."""

import ast
import inspect
import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from claim_files import load_claim, save_claim

import parc_jax
from parc_jax.checker.claim import NOT_STATED, NUMBERS, checked_claim, stated_premises
from parc_jax.checker.entries import hash_of
from parc_jax.common.errors import InputError
from parc_jax.common.premises import ASSUMED, CHECKED, agree, assumptions, premises
from parc_jax.common.sets.box import box
from parc_jax.common.spelling import hex_text
from parc_jax.learning.bound.claim import check_claim, derived, error_claim, scene_claim
from parc_jax.learning.bound.statement import _SHOWN, premises_of, statement
from parc_jax.learning.bound.tube import tube
from parc_jax.learning.runs.law import law_spec, subject
from parc_jax.learning.system import time_grid

pytestmark = pytest.mark.soundness
K = box([0, 0], [1, 1])
TUBE = tube([[0, 0.5, 1], [0, 1]], np.full((2, 3, 2), 0.1), np.full((2, 3), 0.1))
LAW, LOG, OTHERS = law_spec("toy", K), law_spec("toy", K, "logged"), law_spec("tos", K)
SAID = "any run of a new recording drawn from "
EVIDENCE = {"failed": 2, "eps_asked": "eps = 0.001", "rows": 900}
BLOCKS = [{"n": 46000, "discard": 3, "eps": "1/1000"}]


@pytest.fixture
def claim():
    return error_claim(
        kind="pac",
        tube=TUBE,
        subject=subject("toy", K, time_grid(0.5, 1.5), 2, 1),
        network="abc",
        quantifier=f"{SAID}{LAW.describe()}",
        eps=Fraction(1, 1000),
        delta=Fraction(1, 1000),
        n=46000,
        discard=3,
        looks=2,
        law=LAW,
        assumptions=("IID", "HIDDEN_START(given speed)", "UNCHANGED_SYSTEM"),
        evidence=EVIDENCE | {"recordings": "0a1b"},
        intersample=(0.0, 0.125),
    )


OTHER = {
    "eps": {"eps": Fraction(1, 900)},
    "delta": {"delta": Fraction(1, 900)},
    "n": {"n": 45999},
    "discards": {"discard": 2},
    "looks": {"looks": 1},
    "law": {"law": OTHERS, "quantifier": f"{SAID}{OTHERS.describe()}"},
    "lasts": {"subject": subject("toy", K, time_grid(0.25, 0.75), 2, 1)},
    "k": {"law": LOG, "quantifier": f"{SAID}{LOG.describe()}"},
    "failed": {"evidence": {"failed": 3}},
    "rows": {"evidence": {"rows": 901}},
    "eps asked": {"evidence": {"eps_asked": "eps = 0.002"}},
    "not drawn": {"evidence": {"not_drawn": ["wind"]}},
    "bins": {
        "bin_eps": (Fraction(1, 1000), None),
        "evidence": {"blocks": BLOCKS},
        "quantifier": f"in each claimed bin of K, a new rollout drawn from {LAW.describe()} with k "
        "in that bin",
    },
    "IID": {"assumptions": ("HIDDEN_START(given speed)", "UNCHANGED_SYSTEM")},
    "HIDDEN_START": {"assumptions": ("IID", "HIDDEN_START(given load)", "UNCHANGED_SYSTEM")},
}
OUTSIDE = {"box", "lasts", "open bins"}  # of the sentence alone: checkers have tube and times
UNSAID = {"box", "recordings"}  # named by the next test, and by the hash


@pytest.mark.parametrize("entry", OTHER)
def test_what_differs_is_refused_in_memory_and_in_files_and_changes_the_sentence(
    entry, claim, tmp_path
):
    before = claim.premises
    changes = OTHER[entry]
    evidence = claim.evidence | changes.get("evidence", {})
    edited = replace(claim, **(changes | {"evidence": evidence}))
    told = derived(claim, **changes)
    assert told.premises.hash != before.hash
    with pytest.raises(InputError, match="made about"):
        check_claim(edited)
    data = json.loads(save_claim(claim, tmp_path / "claim.json").read_text())
    data["claim"] |= edited.facts()
    (tmp_path / "claim.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="made about"):
        load_claim(tmp_path / "claim.json")
    for say in (edited.details, lambda: edited.premises, edited.risk):
        with pytest.raises(InputError, match="made about"):
            say()
    assert told.details() != claim.details()
    assert entry in {e.name for e in (*before, *told.premises)}


def test_every_entry_is_changed_above(claim):
    names = {e.name for e in claim.premises if e.value != NOT_STATED} - UNSAID
    assert names - {"K", "open bins", "UNCHANGED_SYSTEM"} <= OTHER.keys()
    assert {e.name for e in claim.premises if e.standing == CHECKED} == {
        "eps", "delta", "n", "discards", "looks"
    }  # fmt: skip
    for name in ("K", "open bins", "box"):  # these hang together with the tube
        entries = [
            e._replace(value="1 of 2" if name == "open bins" else "N") if e.name == name else e
            for e in claim.premises
        ]
        assert statement(premises(entries)) != claim.details()


def of_kind(kind, claim):
    """Of each kind of claim, with all that it may say."""
    gaps = {"assumptions": (*claim.assumptions, "LEFT_OUT(7 rows)"), "evidence": {"left_out": 7}}
    if kind == "pac":
        return derived(claim, **gaps | {"evidence": {"left_out": 7, "not_drawn": ["wind"]}})
    if kind == "bins":  # of runs: none is made of recordings
        of_runs = {"blocks": BLOCKS, "rows": None, "recordings": None}
        return derived(claim, **OTHER["bins"] | {"evidence": of_runs})
    if kind in ("assumed", "declared"):
        return derived(claim, kind=kind, quantifier="a reason", eps=None, delta=None)
    about = {"steps": [["1.0", 46000, 3]], "scale": "1.0", "tests": 46000, "of": "0a1b"}
    about |= {"corridors": 1, "within": None, "set": "0" * 64, "left_out": 7}
    shown = {"eps": claim.eps, "delta": claim.delta, "n": 46000, "discard": 3}
    if kind == "recordings":
        about |= {"tested": ["0a"] * 46000, "recordings": hash_of(["0a"] * 46000)}
    return scene_claim(claim, TUBE, LAW, about, assumptions=gaps["assumptions"], **shown)


# Entries that a sentence leaves out: others say it, as LEFT_OUT or "open bins"; of a tube that is
# not shown all about runs but its own words are left out.
LEFT = {"pac": {"recordings", "k"}, "bins": {"bins"}}
LEFT |= {kind: {"K", "k", "box", "left out"} for kind in ("tests", "recordings")}
OF_RUNS = {"law", "K", "k", "box", "n", "discards", "failed", "rows", "recordings", "eps asked"}
OF_RUNS |= {"lasts"}
LEFT |= {kind: OF_RUNS for kind in ("assumed", "declared")}
OTHERS = {"open bins": "1 of 2", "bins": "2 of 2 with a claim"}


@pytest.mark.parametrize("kind", LEFT)
def test_each_entry_of_a_record_is_in_its_sentence(kind, claim):
    record = of_kind(kind, claim).premises
    said, silent = statement(record), set()
    for entry in record:
        more = entry.value + 1 if type(entry.value) is int else f"7{entry.value}"
        other = entry._replace(value=OTHERS.get(entry.name, more))
        if statement(premises(other if e == entry else e for e in record)) == said:
            silent.add(entry.name)
    assert silent <= LEFT[kind], silent - LEFT[kind]


def named_by(function):
    """Names of entries in the source of one that makes some."""
    for node in ast.walk(ast.parse(inspect.getsource(function))):
        match node:
            case ast.Dict(keys=keys):
                yield from (key.value for key in keys)
            case (
                ast.Tuple(elts=[ast.Constant(value=name), _, _])
                | ast.Assign(targets=[ast.Subscript(slice=ast.Constant(value=name))])
            ):
                yield name


def test_each_name_that_a_record_may_have_is_tried_above(claim):
    """No entry is new, and told by no sentence, because no claim above has it."""
    tried = {entry.name for kind in LEFT for entry in of_kind(kind, claim).premises}
    makers = premises_of, stated_premises, *_SHOWN.values()
    assert {name for function in makers for name in named_by(function)} <= tried


def test_numbers_that_do_not_follow_from_the_runs_are_not_loaded(claim, tmp_path):
    """Also where somebody has made the hash anew."""
    for changes in ({"eps": Fraction(1, 10**6)}, {"n": 22}, {"discard": 30}):
        with pytest.raises(InputError, match="numbers that follow from its runs; the claim's runs"):
            load_claim(save_claim(derived(claim, **changes), tmp_path / "claim.json"))
    path = save_claim(claim, tmp_path / "claim.json")
    assert load_claim(path).premises == claim.premises
    data = json.loads(path.read_text())
    assert set(NUMBERS) <= data["claim"].keys()
    hashes = {"network": "", "tube": ""}
    told = data["claim"] | {f"{name}_hash": "" for name in hashes}
    seen = checked_claim(told, hashes, TUBE.n_bins)["premises"]
    same = [[e.name, e.standing, e.value] for e in claim.premises if e.name not in OUTSIDE]
    assert [[*e[:2], str(e[2])] for e in seen] == [[*e[:2], str(e[2])] for e in same]


# Of a claim's fields these are read beside its record and the checkers, and are no part of a
# sentence there: whether there is a bound, the exact numbers of a risk, and facts about its runs.
BESIDE = {
    ("answer/answer.py", "evidence"),
    ("answer/risk.py", "delta"),
    ("answer/risk.py", "eps"),
    ("app/files/answer_file.py", "evidence"),
    ("app/plot/film.py", "evidence"),
    ("app/study/report.py", "evidence"),
    ("app/study/job.py", "assumptions"),  # which of a test are its own
    ("drive/local/choice.py", "assumptions"),
    ("drive/local/localise.py", "assumptions"),
    ("drive/local/nested.py", "evidence"),
    ("drive/local/trials.py", "assumptions"),
    ("drive/local/trials.py", "evidence"),
    ("drive/local/validate.py", "evidence"),
    ("learning/model.py", "assumptions"),
    ("learning/model.py", "evidence"),
    ("problem/robust/nominal.py", "evidence"),  # whether it is of another answer
    ("problem/robust/vertex_model.py", "bin_eps"),
    ("problem/world/movers.py", "eps"),
}
FIELDS = {
    "eps",
    "delta",
    "n",
    "discard",
    "looks",
    "bin_eps",
    "assumptions",
    "evidence",
    "quantifier",
}


def test_no_sentence_takes_a_number_of_a_claim_from_elsewhere():
    found, package = set(), Path(parc_jax.__file__).parent
    for path in package.rglob("*.py"):
        where = path.relative_to(package).as_posix()
        if where.startswith(("learning/bound/", "checker/")):
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Attribute) and node.attr in FIELDS:
                of = getattr(node.value, "attr", getattr(node.value, "id", ""))
                found |= {(where, node.attr)} if of == "claim" else set()
    assert found == BESIDE


def test_two_records_that_meet_agree_in_every_entry(claim):
    record = claim.subject.premises
    agree("here", record, record)
    for entry in record:
        other = premises([*(e for e in record if e != entry), entry._replace(value=hex_text(9.0))])
        with pytest.raises(InputError, match=rf"^here: .*agree; {entry.name} is "):
            agree("here", record, other)
        agree("here", record, other, free={entry.name})
        less = premises(e for e in record if e != entry)
        with pytest.raises(InputError, match=rf"{entry.name} is .*beside not stated"):
            agree("here", record, less)
    first, second, *_ = record  # an entry that may differ hides none of those behind it
    both = [e._replace(value=hex_text(9.0)) if e in (first, second) else e for e in record]
    with pytest.raises(InputError, match=rf"agree; {second.name} is "):
        agree("here", record, premises(both), free={first.name})
    assert record.hash == premises(record).hash != premises(both).hash


def test_what_a_caller_assumes_has_a_name_and_says_something():
    told = {"floor": "dry", "friction": ["0.8", 1]}
    assert [*premises(assumptions("it", told))] == [(x, ASSUMED, y) for x, y in told.items()]
    assert assumptions("it", None) == []
    wrongs = ({"": "x"}, {"a": "x", "b": " "}, {"a": []}, {1: "x"}, {"a": "b\n(C)"})
    for wrong in (*wrongs, {"a": None}, {"a": 3.0}, {"a": {"b": 1}}, {"a": object()}):
        with pytest.raises(InputError, match=r"it: expected assumed as some text by name; got \{"):
            assumptions("it", wrong)
    with pytest.raises(InputError, match="it: assumed: expected Mapping; got 'dry'"):
        assumptions("it", "dry")
    with pytest.raises(InputError, match="it: assumed: expected Mapping; got "):
        assumptions("it", [])


def test_a_record_keeps_what_a_file_can_keep():
    for entries in (
        [("eps", CHECKED, 0.1)],
        [("eps", "believed", "1/10")],
        [("eps", CHECKED, "1/10"), ("eps", ASSUMED, "1/9")],
    ):
        with pytest.raises(InputError, match="premises: expected"):
            premises(entries)
