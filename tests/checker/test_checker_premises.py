"""What a claim rests on, as both checkers print it: numbers that they have checked themselves, and
the file's word from the fields that its hash covers. Known to both: tests/helpers/known.py.
"""

import contextlib
import copy
import json
import sys
from fractions import Fraction as F
from pathlib import Path

import answer_files as build
import known
import leaves
import pytest
from episode_files import Robot, sealed

from parc_jax import checker
from parc_jax.app.cli import check as second
from parc_jax.checker.answer import allowance_of
from parc_jax.checker.claim import LONGEST, MAX_PREMISES

sys.path.insert(0, str(Path(__file__).parent / "compare"))

import two

ODD = "\x1b[2J\\ \u00e9\u20ac\U0001f600\ud800\x7f'\"\n  checked  eps: 0"
ABOUT_CLAIMS = {
    why: make
    for why, (make, limits) in known.CASES.items()
    if why.startswith(("a claim", "a tested set", "a law", "words of")) and not limits
}


def about_the_tube(lines):
    """What is said of the claim, without the hashes."""
    return [line for line in two.about_the_tube(lines) if "sha256" not in line]


def told(answer):
    """The same of the Python checker for an answer, as it stands in a file."""
    answer = json.loads(json.dumps(build.rehash(answer)))
    return about_the_tube(checker.summary(checker.check_answer(answer)))


@pytest.fixture
def second_told(monkeypatch, tmp_path):
    """What the proved checker says of an answer, on node."""
    monkeypatch.delenv(second.VARIABLE, raising=False)

    def ask(answer):
        path = tmp_path / "answer.json"
        path.write_text(answer if isinstance(answer, str) else json.dumps(answer))
        return second.ask(second.find_second(), path)

    return ask


def changed(**changes):
    return known.change(known.with_facts(), changes)


def assumed():
    """Of a claim without evidence."""
    answer = known.plain()
    answer["claim"] |= {"kind": "declared\x1b", "quantifier": "a datasheet says so"}
    return build.rehash(answer)


def odd():
    """Of every kind of character, too long to print, and K in numbers of every kind."""
    answer = known.with_facts(lambda: known.change(known.line(), {"problem__dt": "0.05"}))
    lo, hi = [["-1/3", "0x1p-50", "2/3"], ["1e3", "0.5", "7"]]
    answer["problem"] |= {"n_k": 3, "domain": {"lo": lo, "hi": hi}}
    answer["network"]["weights"] = [[["1", "0", "0"]]]
    answer["tube"]["edges"] = [list(pair) for pair in zip(lo, hi, strict=True)]
    answer["samples"][0]["k"] = ["0", "0.25", "1"]
    answer["claim"]["subject"]["domain"] = {"lo": lo, "hi": hi}
    answer["claim"]["assumptions"] = [ODD, f"{ODD}({ODD})", "(", "a)", "b(c", "x" * 600, ""]
    law = answer["claim"]["law"]
    law |= {"k_law": ODD, "lo": lo, "hi": hi, "generator": ODD, "parameters": [[ODD, ODD]]}
    law["hash"] = known.hash_of_law(law)
    words = f"a new rollout drawn from {ODD} (k by {ODD}, {ODD} = {ODD}; {law['hash'][:8]})"
    answer["claim"]["quantifier"] = words
    return build.rehash(answer)


def lacking():
    """A claim that lacks one of its numbers."""
    answer = known.with_facts()
    del answer["claim"]["looks"]
    return build.rehash(answer)


def no_claim():
    """Nobody says anything of the tube."""
    return build.rehash(known.plain() | {"claim": None})


# what any claim about runs rests on
LEDGER = ["IID", "TRANSLATION_INVARIANCE", "DISCRETE_TIME", "DEPLOYMENT_LAW = CALIBRATION_LAW"]
LEDGER += ["UNCHANGED_SYSTEM", "UNSEEN"]
STATED = (known.with_facts, known.with_facts_of_bins, assumed, odd, lacking, no_claim)
STATED += (known.plain, lambda: build.rehash(known.claim_of_bins(known.BLOCK, known.BLOCK)))


def test_each_premise_has_a_line_and_the_sentence_of_the_file_has_none():
    assert told(known.with_facts()) == [
        "The proof rests on the tube. That so many runs show this eps with this delta was",
        "  checked; what is not marked so is the file's word:",
        "  checked  eps: 1/1000",
        "  checked  delta: 1/1000",
        "  checked  n: 6905 runs",
        "  checked  discards: 0",
        "  checked  looks: 1",
        f"  measured law: {known.FACTS['quantifier']}",
        "  measured K: [-1, 1]",
        "  measured k: uniform on K",
        "  measured failed: 0",
        "  measured not drawn: wind, load",
        "  assumed  IID",
        "  assumed  HIDDEN_START: given the load (of 3 kg)",
        *(f"  assumed  {name}: not stated" for name in LEDGER[1:]),
    ]
    of_bins = told(known.with_facts_of_bins())
    assert "  checked  n: 7100 recordings or more in each" in of_bins
    assert "  checked  bins: 1 of 2 with a claim" in of_bins
    assert "  measured rows: 20000" in of_bins and "  measured eps asked: eps = 1/2" in of_bins


def test_what_no_field_states_is_assumed_and_said_to_be_missing():
    lines = [f"  assumed  {name}: not stated" for name in ("law", "K", "k", "failed")]
    assert told(known.plain())[7:] == [*lines, *(f"  assumed  {x}: not stated" for x in LEDGER)]
    lines = told(build.rehash(known.plain() | {"claim": known.plain()["claim"] | {"kind": "own"}}))
    assert "  assumed  assumptions: not stated" in lines
    more = changed(claim__evidence__failed=1)
    assert "  more runs failed than are left outside:" in told(more)


def test_what_is_quoted_is_escaped_and_short():
    lines = told(odd())
    assert all(line.isascii() and line.isprintable() for line in lines)
    assert sum(line.startswith("  checked  ") for line in lines) == len(known.SHOWN)
    assert max(map(len, lines)) < 2 * LONGEST + 100
    assert any("(600 characters)" in line for line in lines)
    K = "[-0.333333333333, 1000] x [0.000000000000, 0.5] x [0.666666666667, 7]"
    K = K.replace("0.000000000000,", "1/1125899906842624,")
    assert f"  measured K: {K}" in lines
    assert told(assumed())[0] == f"{two.RESTS}, which is ASSUMED (kind declared\\x1b):"
    assert told(assumed())[1] == "  assumed  law: a datasheet says so"


@pytest.mark.needs("node")
@pytest.mark.parametrize("make", STATED)
def test_both_print_the_same_lines(make, second_told):
    said = second_told(make())
    assert said.code == second.ACCEPTED, said.lines
    assert about_the_tube(said.lines) == told(make())


@pytest.mark.needs("node")
def test_both_say_that_an_obstacle_is_there_for_a_part_of_the_time(second_told):
    part = {"problem__obstacles__0__steps": [0, 0], "corridors__0__sep": [[[[1, known.TOP]]]]}
    answer = known.change(known.corridor(), part)
    told = [
        "NOT PROVED: 1 obstacle told of by intervals: nothing is",
        "  said of them at other times",
    ]
    whole = known.change(known.corridor(), {"problem__obstacles__0__steps": [0, 1]})
    for one, said in ((answer, True), (whole, False)):
        one = json.loads(json.dumps(one))
        lines = list(checker.summary(checker.check_answer(one)))
        assert (told[0] in lines and told[1] in lines) == said
        assert (told[0] in second_told(one).lines) == said


def test_a_report_says_how_long_a_plan_is():
    """The wall behind the goal may be met by a robot that nothing stops there."""
    for dt, seconds in (("1/8", "0.25"), ("5e-1", "1")):
        answer = known.change(known.corridor(), {"problem__dt": dt, "problem__steps": 2})
        lines = list(checker.summary(checker.check_answer(json.loads(json.dumps(answer)))))
        assert f"NOT PROVED: anything later than the {seconds} s of a plan" in lines
    both = known.bracket()  # where a file has plans, and shares of volume beside them
    both |= {part: known.plain()[part] for part in ("samples", "sets")}
    lines = list(checker.summary(checker.check_answer(build.rehash(both))))
    assert any("undecided" in line for line in lines)
    assert any(line.startswith("NOT PROVED: anything later") for line in lines)


@pytest.mark.needs("node")
@pytest.mark.parametrize("place", known.EDITS)
def test_an_edit_is_rejected_and_one_with_its_hash_made_anew_is_seen(place, second_told):
    before = known.with_facts()
    edited = changed(**{place: known.EDITS[place]})
    hidden = copy.deepcopy(edited) | {"hash": before["hash"]}
    assert two.rejected(checker.check_answer, json.loads(json.dumps(hidden)))
    assert second_told(hidden).code == second.REJECTED
    lines = told(edited)
    assert lines != told(before) and about_the_tube(second_told(edited).lines) == lines


@pytest.mark.needs("node")
@pytest.mark.parametrize("why", ABOUT_CLAIMS)
def test_the_proved_checker_rejects_them_too(why, second_told):
    """What the Python checker rejects in test_checker_checks.py."""
    said = second_told(ABOUT_CLAIMS[why]())
    assert said.code == second.REJECTED and "malformed" not in said.lines[0], said


@pytest.mark.needs("node")
@pytest.mark.parametrize("more", [0, 1])
def test_both_count_the_assumptions(more, second_told):
    """One line each, and no more than somebody may read."""
    answer = changed(claim__assumptions=[f"x{i}" for i in range(MAX_PREMISES + more)])
    assert (second_told(answer).code == second.ACCEPTED) == (more == 0)
    assert (two.rejected(checker.check_answer, answer) is None) == (more == 0)


# Fields of a claim that no printed line is made from.
UNPRINTED = {("statement",), ("network_hash",), ("tube_hash",), ("evidence", "of")}
UNPRINTED |= {("subject", "system"), ("subject", "time")}


@pytest.mark.parametrize("make", [known.tested, known.with_facts, known.with_facts_of_bins])
def test_an_edit_of_a_claim_is_rejected_or_seen(make):
    """Every leaf, every list and every field of it, one at a time, with the hashes made anew: no
    line stays as it was while what it is made from changed.
    """

    def said(answer):
        lines = checker.summary(checker.check_answer(answer))
        return [line for line in lines if "sha256" not in line]

    answer, before, unseen, n = make(), said(make()), set(), 0
    for place, claim in leaves.edits(answer["claim"]):
        edited, n = copy.deepcopy(answer) | {"claim": copy.deepcopy(claim)}, n + 1
        with contextlib.suppress(checker.Rejected, KeyError):
            if said(edited) == before:
                unseen.add(place)
    assert n > 60
    assert not {place for place in unseen if {place[:1], place[:2]}.isdisjoint(UNPRINTED)}


SHAPE = [["-1/8", "0"], ["1e-1", "0"], ["0", "0x1p-3"]]
TURNED = "grown by the polygon (-0.125, 0), (0.1, 0), (0, 0.125) m, which never turns"


@pytest.mark.needs("node")
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "a body (point 0 grown by 0.5 m) among 1 convex obstacle, from p0 within 4 half-spac"),
        ({"problem__body__parts__0__radius": "1/4"}, "grown by 0.25 m) among"),
        ({"problem__body__parts__0": {"points": [0, 0], "vertices": SHAPE}}, f"(point 0 {TURNED})"),
        ({"problem__body__parts__append": {"points": [0], "radius": "0"}}, "m; point 0 grown by 0"),
        ({"problem__start": None}, "obstacle, from any p0."),
    ],
)
def test_both_say_body_obstacles_and_starts(changes, words, second_told):
    answer = known.plain() if "problem__body__parts__append" not in changes else known.line()
    one = json.loads(json.dumps(known.change(answer, changes)))
    (told,) = [line for line in checker.summary(checker.check_answer(one)) if words in line]
    assert second_told(one).lines.count(told) == 1


@pytest.mark.needs("node")
def test_both_print_a_body_of_many_parts_as_far_as_it_is_read(second_told):
    many = {"problem__body__parts": [{"points": [0], "radius": "1/3"}] * 90}
    one = json.loads(json.dumps(known.change(known.line(), many)))
    (told,) = [line for line in checker.summary(checker.check_answer(one)) if "It is of" in line]
    assert "... (3148 characters)) among 0 convex obstacles" in told
    assert second_told(one).lines.count(told) == 1


@pytest.mark.needs("node")
def test_both_say_the_body_of_an_episode_by_the_points_of_the_robot(second_told):
    robot = Robot(0, points=2, copies=2)
    file = robot.episode(robot.driven())
    body = "hull of points 0, 1 grown by 0.05 m"
    assert file["premises"][3] == ["body", "checked", [body]]
    assert second_told(file).lines.count(f"The body: {body}.") == 1


@pytest.mark.needs("node")
def test_a_heading_is_of_a_claim_that_turns(second_told):
    """Where the claim says; `rotation` cut out of an episode's claim, its hashes made anew."""
    robot = Robot(3, points=2)
    file = robot.episode(robot.driven(3, heading=F(0)))
    for subject, fits in (({"rotation": ["turns"]}, True), ({}, True), ({"rotation": None}, False)):
        file["claim"] = {"kind": "own", "subject": subject}
        other = sealed(file)
        assert (second_told(other).code == second.IN_PART) == fits
        if fits:
            checker.check_episode(other, allowance_of)
        else:
            with pytest.raises(checker.Rejected, match="its claim says that nothing turns"):
                checker.check_episode(other, allowance_of)


def test_what_a_scene_rests_on_is_told_as_the_word_of_the_file():
    said = ["Edges of free space rest on this: all that stands is at least 0.1 m wide.", "\x1b[2J"]
    one = json.loads(json.dumps(known.plain() | {"meta": {"rests_on": said}}))
    lines = list(checker.summary(checker.check_answer(one)))
    assert lines.count(f"  The file says of it, unchecked: {said[0]}") == 1
    assert lines.count("  The file says of it, unchecked: \\x1b[2J") == 1
    for wrong in ("text", [1], {}):
        assert checker.check_answer(known.plain() | {"meta": {"rests_on": wrong}}).said == []
