"""An episode as a file: all of it is proved, and every way of breaking it is told."""

import json
import math
from dataclasses import fields, replace
from fractions import Fraction

import numpy as np
import pytest
from episode_files import sealed
from episodes import PATIENT, driven
from toy_models import line_model

import parc_jax as pj
from parc_jax import checker
from parc_jax.checker.answer import allowance_of
from parc_jax.checker.turns import OFF, cosine_and_sine
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.episode_file import episode_part

KNOWN = pj.Uncertainty(start=0.01)
UNSURE = ({"sensing_eps": 0.05}, {"obstacles": pj.box([-0.01, -0.01], [0.01, 0.01])})


def check(file: dict):
    return checker.check_episode(json.loads(json.dumps(file)), allowance_of)


@pytest.mark.parametrize("turning", [False, True])
def test_an_episode_is_accepted_and_says_from_when_to_when(turning, tmp_path, capsys):
    done = driven(turning)
    report = check(episode_part(done))
    assert report.manoeuvres == 4 and report.rests == 0
    assert report.begin == 0 and report.end == done[-1].end
    path = pj.drive.save_episode(tmp_path / "episode.json", done, {"robot": "toy"})
    assert checker.main([str(path)]) == 0
    assert "4 manoeuvres, each from its stated pose to its last knot" in capsys.readouterr().out
    assert checker.main([str(path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["manoeuvres"] == 4 and told["premises"][0][:2] == ["manoeuvres", "checked"]


def test_a_part_of_an_episode_says_what_is_not_in_it(tmp_path):
    """Its last manoeuvre was left for one of which the file tells nothing."""
    done, told = driven(False), {}
    for name, some in {"all": done, "head": done[:2], "part": done[2:3]}.items():
        told[name] = {x: value for x, _, value in check(episode_part(some)).premises}
    with pytest.raises(InputError, match=r"expected an answer .* got an episode\."):
        pj.load_answer(pj.drive.save_episode(tmp_path / "episode.json", done))
    assert "NOT_IN_THE_FILE" not in told["all"] and told["all"]["measured of k"] == ["k1"]
    left = [
        f"those from {checker.rests_on.seconds(done[i].begin)} on, until when the last was followed"
        for i in (2, 3)
    ]
    assert told["head"]["NOT_IN_THE_FILE"] == left[:1]
    before = "those before number 2, the first of these"
    assert told["part"]["NOT_IN_THE_FILE"] == [before, left[1]]
    assert "what is measured of its k was so (k1)" in done[0].loop


def test_of_what_moves_nothing_is_said_while_the_robot_rests():
    still, moves = (check(episode_part(driven(False, 2, spans))) for spans in (None, [(0, 3)]))
    assert (still.moving, moves.moving) == (0, 2)
    said = ["\n".join(checker.episode.summary_of_episode(report)) for report in (still, moves)]
    assert "NOT PROVED" not in said[0] and "in 2 manoeuvres obstacles" in said[1]


def moved_away(file):
    """The robot is suddenly elsewhere; its plan from there is as good as before."""
    entry = file["manoeuvres"][2]
    entry["pose"][0] = entry["sample"]["p0"][0] = str(Fraction(entry["pose"][0] and "5"))
    return "the plan does not start at the pose|began outside of the tube|fails"


def plan_from_elsewhere(file):
    file["manoeuvres"][1]["sample"]["p0"][0] = "1/3"
    return "does not start at the pose"


def out_of_order(file):
    file["manoeuvres"][1]["begin"] = "0"
    return "began before the one before it"


def too_long_under_way(file):
    """Left later than it says: the robot would be farther on."""
    for entry in file["manoeuvres"][2:]:
        entry["begin"] = str(Fraction(entry["begin"]) + 5)
    return "outside of the tube"


def something_in_the_way(file):
    obstacle = file["manoeuvres"][3]["problem"]["obstacles"][0]
    obstacle["b"] = ["100"] * len(obstacle["b"])
    return "fails|direction"


def another_tube(file):
    file["tube"]["interval"][0][0][0][0] = "0x0.0p+0"
    return "hash"


def a_wrong_uncertainty(file):
    file["doubt"] = ["-1", "0", "0", "0"]
    return "hash"


@pytest.mark.parametrize(
    "broken",
    [
        moved_away,
        plan_from_elsewhere,
        out_of_order,
        too_long_under_way,
        something_in_the_way,
        another_tube,
        a_wrong_uncertainty,
    ],
)
def test_what_is_broken_is_rejected(broken):
    file = json.loads(json.dumps(episode_part(driven(False))))
    words = broken(file)
    if broken not in (another_tube, a_wrong_uncertainty):
        file = sealed(file)
    with pytest.raises(checker.Rejected, match=words):
        check(file)


def test_a_robot_that_rested_in_between_is_where_it_rested():
    done = driven(False, 1)
    file = episode_part(done)
    again = json.loads(json.dumps(file["manoeuvres"][0]))
    again["begin"] = "7"
    file["manoeuvres"].append(again)
    with pytest.raises(checker.Rejected, match="outside of the tube"):
        check(sealed(file))  # it moved on, and rests elsewhere


@pytest.mark.parametrize("turned", [False, True])
def test_odometry_may_be_off_by_the_drift_that_is_declared(turned):
    """The robot moved on; told to be where it was, it is as far off as it drove."""
    done = driven(turned, 2)
    off = float(np.linalg.norm(done[1].asked.pose.place - done[0].asked.pose.place))

    def told_to_stand(drift):
        file = json.loads(json.dumps(episode_part(done, drift=drift)))
        file["manoeuvres"][1] = file["manoeuvres"][0] | {"begin": file["manoeuvres"][1]["begin"]}
        return sealed(file)

    assert check(told_to_stand(off)).manoeuvres == 2
    with pytest.raises(checker.Rejected, match="outside of the tube"):
        check(told_to_stand(0.5 * off))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.7, -3.2, 6.3, 7.99])
def test_cosine_and_sine_are_enclosed(angle):
    cosine, sine = cosine_and_sine(Fraction(angle))
    assert abs(cosine**2 + sine**2 - 1) < 8 * OFF
    assert float(cosine) == pytest.approx(math.cos(angle), abs=1e-15)
    assert float(sine) == pytest.approx(math.sin(angle), abs=1e-15)


def test_what_is_no_episode_is_refused():
    one, wrong = driven(False, 1)[0], "expected a list of commitments alone; got"
    for listed in ([], one, [None], [one, None], "one"):
        with pytest.raises(InputError, match=wrong):
            pj.drive.save_episode("nothing.json", listed)
        with pytest.raises(InputError, match=wrong):
            pj.drive.left_tube(listed, np.zeros((20, 2)))
    for drift in (-1, "a", None):
        with pytest.raises(InputError, match="episode drift: expected"):
            episode_part(driven(False, 1), drift=drift)
    for meta in ({"a": object()}, {(1, 2): 3}):
        with pytest.raises(InputError, match="meta: expected plain values, as JSON has them"):
            pj.drive.save_episode("nothing.json", driven(False, 1), meta)
    with pytest.raises(InputError, match=r"of one loop: .*model is .*; frame is told in the world"):
        episode_part([*driven(False, 1), *driven(True, 1)])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"body": 0.06}, "body is point 0 grown by 0.05 m, beside point 0 grown by 0.06 m"),
        (
            {"uncertainty": pj.Uncertainty(start=0.02)},
            r"start is \(0.01,\), beside \(0.02,\)",
        ),
        ({"model": 0.02}, "model is "),
        *(({"uncertainty": replace(KNOWN, **one)}, f"{next(iter(one))} is ") for one in UNSURE),
    ],
)
def test_a_manoeuvre_and_the_next_agree_on_all_that_they_share(options, words):
    """Commitments of two loops, of which one thing is not the same."""
    done, loops = [], []
    for own in ({}, options):
        model = line_model(4, own.get("model", 0.01), rests=True)
        uncertainty = own.get("uncertainty", pj.Uncertainty(start=0.01))
        loop = pj.drive.Loop(
            model,
            own.get("body", 0.05),
            leave=0.5,
            given=(1,),
            uncertainty=uncertainty,
            effort=PATIENT,
        )
        step = loop.step([0.0, 0.0], [0.1], [], lambda seen: -seen.path[:, -1, 0], at=len(done))
        done.append(step.committed)
        loops.append(loop)
    with pytest.raises(InputError, match=words):
        episode_part(done)
    with pytest.raises(InputError, match="restart: expected what this loop began last"):
        loops[1].restart(done[0])  # it would go on with what another loop has proved
    loops[1].restart()
    loops[1].restart(done[1])
    assert loops[1].under_way is done[1]


def test_each_field_of_an_uncertainty_is_shared_or_no_loop_takes_it():
    none = {"k", "given", "unknown", "goal", "heading"}  # heading: in the plane, with rotation
    named = {field.name for field in fields(pj.Uncertainty)}
    assert named == {*none, *(name for one in (*UNSURE, {"start": 0}) for name in one)}
    (one,) = driven(False, 1)
    others = {
        "given": replace(one, given=()),
        "command": replace(one, command="a cycle late"),
        "frame": replace(one, asked=replace(one.asked, pose=one.asked.pose._replace(heading=0.5))),
    }
    for name, other in others.items():
        with pytest.raises(InputError, match=rf"agree; {name} is "):
            episode_part([one, other])
    # and what was compared above; a new entry is compared in one of the two
    assert {entry.name for entry in one.shared} == named | {"model", "body"} | others.keys()
    for name in none - {"heading"}:
        with pytest.raises(InputError):
            pj.drive.Loop(
                line_model(4, 0.01, rests=True),
                0.05,
                leave=0.5,
                uncertainty=pj.Uncertainty(**{name: 0.1 if name == "goal" else {"k0": 0.1}}),
            )


def test_the_errors_that_problems_allow_for_are_told(tmp_path, capsys):
    """Of obstacles and of the sensor, too: the problems have them inside their grown parts."""

    def told(**known):
        known = replace(KNOWN, **known)
        loop = pj.drive.Loop(
            line_model(4, 0.01, rests=True), 0.05, leave=0.5, uncertainty=known, effort=PATIENT
        )
        at = (lambda seen: -seen.path[:, -1, 0],)
        block = [pj.box([30.0, 30.0], [31.0, 31.0])]
        one = loop.step([0.0, 0.0], [], block, *at, at=0.0).committed
        pj.drive.save_episode(tmp_path / "drive.json", [one])
        assert checker.main([str(tmp_path / "drive.json")]) == 0
        (line,) = [x for x in capsys.readouterr().out.splitlines() if "errors allowed for" in x]
        return line

    assert (
        told() == "  assumed errors allowed for: every start within ±0.01 m of the one asked about"
    )
    sensed, moved = (told(**one) for one in UNSURE)
    assert ", but for a probability of at most 0.05 each time that what is measured is" in sensed
    assert (
        "every obstacle moved by an error of its set, which lies within -0.01 to 0.01, -" in moved
    )


def test_what_else_is_assumed_is_told(tmp_path, capsys):
    path = tmp_path / "drive.json"
    pj.drive.save_episode(path, driven(False, 1), assumed={"sweep": "0.1 s, as one moment"})
    assert checker.main([str(path)]) == 0
    assert "  assumed sweep: 0.1 s, as one moment\n" in capsys.readouterr().out


def test_what_was_driven_in_between_is_not_left_out():
    done = driven(False)
    with pytest.raises(pj.InputError, match=r"committed to in between.* number 2 after 0"):
        episode_part([done[0], *done[2:]])
    assert check(episode_part(done[1:])).manoeuvres == 3


def test_a_drive_is_of_one_robot():
    """Of another of the same kind, in the same place, numbers and places would fit."""
    with pytest.raises(pj.InputError, match=r"one robot's loop .* got number 2 of another after 1"):
        episode_part([*driven(False, 2), *driven(False, 4)[2:]])


def test_a_file_allows_for_as_much_drift_as_the_loop_was_told():
    done = [replace(one, drift=0.25 * (one.number == 2)) for one in driven(False)]
    assert episode_part(done)["doubt"][-1] == (0.25).hex()
    assert episode_part(done, drift=0.5)["doubt"][-1] == (0.5).hex()


def test_how_far_a_frame_may_have_drifted_in_all_is_told():
    """Of what stands, and of a goal: they are proved where they were told to be in that frame."""

    def told(done, **known):
        return {name: value for name, _, value in episode_part(done, **known)["premises"]}

    done = [replace(one, drift=0.01, drifted=0.01 * (one.number + 1)) for one in driven(False)]
    off = "may have turned, and drifted by {} m where the robot is, since the episode began"
    name = "drift of the frame"
    assert told(done)[name].endswith(f"told to be, in a frame that {off.format(0.04)}")
    assert told(done[3:])[name].endswith(off.format(0.04))
    assert told(done, drift=0.02)[name] == told(done[3:], drift=0.02)[name]
    assert told(done, drift=0.02)[name].endswith(off.format(0.08))
    assert done[2].certificate()["meta"]["rests_on"][-1].endswith(off.format("0.03"))
    still = driven(False)
    assert name not in told(still) and "drift" not in str(still[0].certificate()["meta"])
