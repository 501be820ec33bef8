"""The checker of episodes: where the next manoeuvre may begin, against an oracle in fractions, and
all that a file may not say of what it rests on.
"""

import copy
import gc
import itertools
import json
import math
import random
from collections import Counter
from fractions import Fraction as F

import pytest
from answer_files import text
from episode_files import DT, Robot, beyond, sealed
from episode_mutants import check_episode_mutants

from parc_jax import checker
from parc_jax.checker.answer import allowance_of, main
from parc_jax.checker.episode import Begun, summary_of_episode
from parc_jax.checker.rests_on import seconds

HAIR = F(1, 1 << 40)


def check(file):
    return checker.check_episode(file, allowance_of)


def said(file):
    return "\n".join(summary_of_episode(check(file)))


def accepted(file) -> bool:
    """Is it, or is it rejected because the next one began elsewhere?"""
    try:
        check(file)
    except checker.Rejected as why:
        assert "began outside of the tube" in str(why)
        return False
    return True


@pytest.mark.parametrize("seed", range(24))
def test_the_next_one_begins_as_far_away_as_the_tube_allows_and_no_farther(seed):
    """Both ways along both axes: the last place that the oracle allows, and a hair beyond."""
    draw = random.Random(seed)
    robot = Robot(seed, points=draw.choice([1, 2, 3]), copies=draw.choice([1, 3]))
    passed = DT * draw.choice([1, F(3, 2), 2, F(5, 2), 3, F(7, 2), 4, 9])
    doubt = [F(draw.randint(0, 3), 128) for _ in range(4)]
    k, place = F(draw.randint(-64, 64), 64), [F(draw.randint(-64, 64), 64) for _ in range(2)]
    for axis, sign in itertools.product(range(2), (1, -1)):
        next_place, next_k = list(place), F(draw.randint(-64, 64), 64)

        def out(x, axis=axis, sign=sign, next_place=next_place, next_k=next_k):
            next_place[axis] = place[axis] + sign * x
            return beyond(robot, (place, k), (next_place, next_k), passed, doubt)

        # along the other axis in the middle of where it may be
        steps = min(passed / DT, robot.T)
        next_place[1 - axis] = place[1 - axis] + robot.at(steps, 0, 0, k)[1 - axis]
        at = sign * robot.at(steps, 0, 0, k)[axis]
        if out(at) > 0:
            first, other = robot.manoeuvre(0, place, k), robot.manoeuvre(passed, next_place, next_k)
            assert not accepted(robot.episode([first, other], doubt))
            continue
        inside, outside = at, at + 8
        while outside - inside > HAIR:
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if out(middle) <= 0 else (inside, middle)
        for x, fits in ((inside, True), (outside, False)):
            out(x)
            pair = [
                robot.manoeuvre(0, place, k),
                robot.manoeuvre(passed, next_place, next_k),
            ]
            assert accepted(robot.episode(pair, doubt)) is fits


@pytest.mark.parametrize("seed", range(12))
def test_so_it_is_for_a_robot_that_turns(seed):
    """The same of headings, whose cosine and sine the oracle has to 50 bits."""
    draw = random.Random(seed)
    robot = Robot(seed, points=2, copies=draw.choice([1, 3]))
    k, passed = F(draw.randint(-64, 64), 64), DT * draw.choice([1, F(5, 2), 3])
    one, turned = F(draw.randint(-190, 190), 64), F(draw.randint(-8, 8), 64)
    turns = [(F(math.cos(x)), F(math.sin(x))) for x in (one, one + turned)]
    way = robot.at(passed / DT, 0, 0, k)
    (cos, sin), place = turns[0], [F(1, 2), F(-1, 4)]
    world = [cos * way[0] - sin * way[1], sin * way[0] + cos * way[1]]
    aside = [F(draw.randint(-64, 64), 64) for _ in range(2)]

    def pair(x):
        there = [a + b + x * c for a, b, c in zip(place, world, aside, strict=True)]
        out = beyond(robot, (place, k), (there, k), passed, [0] * 4, *turns)
        first = robot.manoeuvre(0, [*place, one], k)
        return out, robot.episode([first, robot.manoeuvre(passed, [*there, one + turned], k)])

    inside, outside = F(0), F(8)
    if pair(inside)[0] > 0:
        assert not accepted(pair(inside)[1])
        return
    while outside - inside > HAIR:
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if pair(middle)[0] <= 0 else (inside, middle)
    margin = F(1, 1 << 30)
    assert accepted(pair(max(inside - margin, F(0)))[1]) and not accepted(pair(inside + margin)[1])


def test_a_heading_that_jumps_is_seen_where_two_points_show_it():
    robot = Robot(3, points=2)
    done = robot.driven(3, heading=F(0))
    told = "assumed heading: that of the poses: 2 reference points, within their errors, show no"
    assert told in said(robot.episode(done))
    done[2]["pose"][2] = "3"
    assert not accepted(robot.episode(done))
    robot = Robot(3, points=1)  # of a point nothing is known but the word of the poses, and said
    done = robot.driven(3, heading=F(0))
    done[2]["pose"][2] = "3"
    assert "assumed heading: that of the poses" in said(robot.episode(done))


@pytest.mark.parametrize("claim", [None, {"kind": "declared", "reason": "x", "assumptions": []}])
def test_who_has_a_heading_rests_on_runs_that_turn_whatever_its_claim_says(claim):
    robot = Robot(3)
    for heading in (None, F(1, 3)):
        file = robot.episode(robot.driven(2, heading)) | {"claim": claim}
        told = said(sealed(file, told=True))
        words = "assumed ROTATION_INVARIANCE: a run with another heading is the same run, turned"
        assert (words in told) is (heading is not None)


def a_body_that_shrinks(file):
    for one in file["manoeuvres"][1:]:
        one["problem"]["body"]["parts"][0]["radius"] = "0"
    return "its body is another than before"


def another_frame(file):
    entry = file["manoeuvres"][1]
    entry["pose"].append("0")
    entry["sample"]["p0"] = ["0", "0"]
    return "another frame"


def a_moment(file):
    """As quick as nobody thinks, of a robot that may stand."""
    for j, one in enumerate(file["manoeuvres"]):
        one["begin"] = str(F(j, 10**9))
    return "within half a time step"


def another_dt(file):
    for one in file["manoeuvres"][1:]:
        one["problem"]["dt"] = "1/2"
    return "other dimensions"


def a_copy_left_out(file):
    for one in file["manoeuvres"]:
        one["problem"]["body"]["parts"][0]["points"] = [0, 1, 2, 3, 4]
    return "leaves out copies"


def never_at_rest(file):
    file["network"]["weights"][0][-12:] = [["1"], ["1"]] * 6
    return "does not come to rest"


def a_claim_about_draws(file):
    file["claim"] = (file["claim"] or {}) | {"kind": "validated"}
    return "its plans were chosen"


@pytest.mark.parametrize(
    "broken",
    [
        a_claim_about_draws,
        a_body_that_shrinks,
        another_frame,
        a_moment,
        another_dt,
        a_copy_left_out,
        never_at_rest,
    ],
)
def test_what_is_broken_is_rejected_however_it_is_sealed(broken):
    robot = Robot(5, points=2, copies=3)
    file = robot.episode(robot.driven())
    check(file)
    words = broken(file)
    with pytest.raises(checker.Rejected, match=words):
        check(sealed(file))


def test_a_manoeuvre_that_came_to_its_end_must_stand_there_too():
    """The first of two, which another one follows later; left under way it need not."""
    robot = Robot(1, points=1)
    robot.ways[-1] = [F(1), F(1)]  # k = 0 stands, another one goes on
    robot.places[-1] = robot.places[-2]
    away = robot.at(robot.T, 0, 0, F(1))
    left = robot.at(2, 0, 0, F(1))
    first, ends = robot.manoeuvre(0, [0, 0], 1), (9 * DT, away)
    with pytest.raises(checker.Rejected, match=r"manoeuvres\[0\]: it does not come to rest"):
        check(robot.episode([first, robot.manoeuvre(*ends, 0)]))
    report = check(robot.episode([first, robot.manoeuvre(2 * DT, left, 0)]))
    assert report.rests == 0 and report.moves[0] == 0
    width = max(robot.widths[-1][0][0])
    assert report.moves[1] == 2 * width


@pytest.mark.parametrize(("narrow", "side"), [(1, 1), (2, -1)])
def test_as_near_to_a_knot_as_times_may_differ_the_narrower_interval_counts(narrow, side):
    robot = Robot(0, points=1)
    robot.widths = [[[[F(1, 64) if t == narrow else F(1)] * 2]] for t in range(robot.T)]
    place = [at + F(1, 2) for at in robot.at(2, 0, 0, F(0))]

    def begins(late):
        other = robot.manoeuvre(2 * DT + side * late, place, F(0))
        return accepted(robot.episode([robot.manoeuvre(0, [0, 0], F(0)), other]))

    assert [begins(F(x, 10**9)) for x in (0, F(1, 2), 1, 2)] == [False, False, False, True]


@pytest.mark.parametrize(("end", "share"), [(F(1), 2), (F(1, 1024), 1), (F(0), 1)])
def test_who_stands_is_in_the_tube_at_both_ends_of_the_last_interval(end, share):
    """What the prediction moves may be as large as the width of the interval and the lesser of that
    and the width of the end together.
    """
    robot = Robot(1, points=2)
    robot.widths[-1] = [[[F(1, 8), F(1, 8)]], [[F(1, 4), F(1, 4)]]]
    for more, stands in ((0, True), (HAIR, False)):
        moved = share * F(1, 8) + (end if share == 1 else 0) + more
        robot.places[-1] = copy.deepcopy(robot.places[-2])
        robot.places[-1][0][0][1] -= moved
        file = robot.episode(robot.driven(1))
        file["tube"]["final"] = [[str(end)] * 4]
        if stands:
            assert check(sealed(file)).moves == (moved, max(moved + F(1, 4), F(1, 2)))
            continue
        with pytest.raises(checker.Rejected, match="does not come to rest"):
            check(sealed(file))


def test_what_the_last_interval_may_move_is_told_rounded_up():
    robot = Robot(2, points=2)
    report = check(robot.episode(robot.driven()))
    width = max(e for each in robot.widths[-1] for e in each[0])
    assert report.moves == (0, 2 * width)
    told = f"by more than {math.ceil(20000 * width) / 10000:.4f} m"
    assert told in "\n".join(summary_of_episode(report))


def test_numbers_of_all_that_it_rests_on_are_told():
    robot = Robot(5, points=2, copies=3)
    file = robot.episode(robot.driven(heading=F(0)), [F(1, 8), F(1, 4), F(1, 64), 1000])
    told = said(file)
    for words in (
        "checked manoeuvres: 3, of 4 steps of 0.25 s each",
        "checked begins: 0 s to 1 s, 0.5 s to 0.5 s apart",
        "checked end: 2 s",
        "checked body: hull of points 0, 1 grown by 0.05 m",
        "checked frame: told from the pose of each manoeuvre",
        "checked tube: of each manoeuvre from its stated pose alone",
        "checked obstacles: 1 to 1 a manoeuvre",
        "within ±0.125, ±0.25 m of the truth; within ±0.015625 rad; 1000 m of drift",
        "assumed rest: the robot stays where a manoeuvre came to its end",
    ):
        assert words in told
    assert told.count("sha256 episode") == 1


@pytest.mark.parametrize("number", range(15))
def test_each_premise_told_otherwise_is_refused(number):
    """Another value or another standing, and none at all."""
    robot = Robot(5, points=2)
    file = robot.episode(robot.driven(heading=F(0)))
    assert len(file["premises"]) == 15
    name, standing, value = file["premises"][number]
    changed = [
        [name, standing, ["other"]],
        [name, {"checked": "assumed", "assumed": "checked"}[standing], value],
        None,
    ]
    for one in changed:
        other = copy.deepcopy(file)
        other["premises"][number : number + 1] = [] if one is None else [one]
        with pytest.raises(
            checker.Rejected, match=f"the premise {name} is not what the file shows: drive again"
        ):
            check(sealed(other, told=False))


def test_a_doubt_of_a_heading_that_poses_do_not_have_is_said():
    """It gives each place room too."""
    robot = Robot(5)
    file = robot.episode(robot.driven())
    before, file["doubt"][-2] = said(file), "1000"
    assert "within ±1000 rad" not in before and "within ±1000 rad" in said(sealed(file))


def test_headings_that_are_off_need_three_copies_of_each_point():
    for copies in (1, 3):
        robot = Robot(5, copies=copies)
        file = robot.episode(robot.driven(heading=F(0)), [0, 0, F(1, 64), 0])
        if copies == 3:
            assert accepted(file)
        else:
            with pytest.raises(checker.Rejected, match="a point has no three copies"):
                check(file)
        assert accepted(robot.episode(robot.driven(heading=F(0))))


def test_a_file_may_add_what_it_assumes_and_no_more():
    robot = Robot(5)
    file = robot.episode(robot.driven())
    n = len(file["premises"])
    for add, words in (
        (["sweep", "assumed", "0.1 s\x1b[2J"], None),
        (["sweep", "checked", "0.1 s"], "called checked"),
        (["rest", "assumed", "0.1 s"], "twice"),
        (["sweep", "assumed", {}], "no name with text"),
        (["sweep", "assumed", "0.1 s" + " " * 2000 + "on Mondays"], None),
    ):
        file["premises"][n:] = [add]
        if words is None:
            told = said(sealed(file))
            assert r"  assumed sweep: 0.1 s\x1b[2J" in told or "... (2015 characters)" in told
        else:
            with pytest.raises(checker.Rejected, match=words):
                check(sealed(file))


@pytest.mark.parametrize("part", ["manoeuvres", "premises", "doubt", "copies", "claim"])
def test_one_hash_covers_all(part):
    robot = Robot(5)
    file = robot.episode(robot.driven())
    file[part] = {"manoeuvres": file[part][:2] if part == "manoeuvres" else 0}.get(part, "0")
    with pytest.raises(checker.Rejected, match="a hash does not match"):
        check(file)


def test_a_tube_without_the_model_is_told():
    """Nothing is in it, whatever stands there; answers say so as well."""
    robot = Robot(4, points=1)
    file = robot.episode(robot.driven(1))
    assert "The tube holds the model's own trajectory in every bin." in said(file)
    rows = {"A": [["1", "0"], ["-1", "0"], ["0", "1"], ["0", "-1"]], "b": ["3", "-2", "1", "1"]}
    file["tube"]["interval"][0][0] = [rows]
    assert "leaves out the model's own trajectory in 1 of 1 bins" in said(sealed(file))


def test_of_the_manoeuvres_before_nothing_is_kept_but_the_last():
    robot = Robot(6)
    file = robot.episode(robot.driven(4))

    def alive():
        gc.collect()
        return Counter(type(x) for x in gc.get_objects() if isinstance(x, checker.Context | Begun))

    chain, before = checker.Chain(file), alive()
    for entry in file["manoeuvres"]:
        assert chain.add(entry)
        assert len(chain.context.reaches) <= chain.context.n_bins
        assert not any(isinstance(value, checker.Context) for value in chain.last)
        assert alive() - before == {checker.Context: 1, Begun: 1}


def test_a_file_of_an_old_format_is_refused_with_what_to_do(tmp_path, capsys):
    robot = Robot(6)
    file = robot.episode(robot.driven(2)) | {"format": "parc_jax.episode/1"}
    place = tmp_path / "old.json"
    place.write_text(json.dumps(file))
    assert main([str(place)]) == 1
    assert "not parc_jax.episode/3: drive again, and save that" in capsys.readouterr().out


def test_no_false_mutant_is_accepted():
    """By the thousand: `python -m benchmarks.attacks mutants`."""
    tally = sum((check_episode_mutants(seed, 12) for seed in range(8)), start=Counter())
    by_verdict = {verdict: 0 for verdict in ("rejected", "accepted", "false")}
    for (_, verdict), count in tally.items():
        by_verdict[verdict] += count
    assert by_verdict["false"] == 0 and min(by_verdict["rejected"], by_verdict["accepted"]) > 20


def test_obstacles_that_come_and_go_are_told_of_as_such():
    """A wall that is there for a moment alone is no wall."""
    robot = Robot(3)
    whole = robot.driven(3)

    def told(*spans):
        """Every manoeuvre with an obstacle in each of these steps."""
        many = copy.deepcopy(whole)
        for one in many:
            wall = one["problem"]["obstacles"][0]
            one["problem"]["obstacles"] = [wall | {"steps": list(span)} for span in spans]
            one["sample"]["sep"] = [[[[last + 1, [[2, "1"]]]]] for _, last in spans]
        return said(robot.episode(many))

    assert "NOT PROVED" not in said(robot.episode(whole))
    # whether another one takes the place of one that goes: nothing is said
    for spans in ([(0, 3)], [(0, 1), (2, 3)], [(0, 2)], [(1, 3)], [(0, 3), (2, 2)]):
        assert "NOT PROVED: in 3 manoeuvres obstacles are told of by intervals" in told(*spans)
        assert "nothing is said of them before" in told(*spans)
        assert "told of by intervals in 3" in told(*spans)


def test_a_manoeuvre_left_when_no_run_of_a_chain_was_is_said():
    robot = Robot(3)
    file = robot.episode(robot.driven(3))
    for times, odd in (("0.25 to 0.75", 0), ("0.75 to 0.875", 2)):
        law = f"a chain of 1 to 3 manoeuvres before it, each left after {times} s"
        file["claim"] = {"kind": "declared", "law": {"k_law": law}}
        assert f"until that of the next; {odd} of 2 were left when no run" in said(sealed(file))


@pytest.mark.parametrize("heading", [None, F(0)])
def test_a_polygon_never_turns(heading):
    robot = Robot(3)
    done = robot.driven(2, heading=heading)
    square = [[text(F(x, 32)), text(F(y, 32))] for x in (-1, 1) for y in (-1, 1)]
    for one in done:
        one["problem"]["body"] = {"parts": [{"points": [0, 1], "vertices": square}]}
    if heading is None:
        assert "m, which never turns" in said(robot.episode(done))
        return
    with pytest.raises(checker.Rejected, match="a polygon does not turn with the robot"):
        check(robot.episode(done))


def test_what_was_measured_of_k_is_assumed():
    assert "assumed k: each was driven with its k, of which what is measured was so" in said(
        Robot(3).episode(Robot(3).driven(2))
    )


def test_a_time_is_told_whole():
    """2.8136 s was 2.814 s, up to which nothing had been shown."""
    assert seconds(F("2.8136")) == "2.8136 s" and seconds(F(-1, 4)) == "-0.25 s"
