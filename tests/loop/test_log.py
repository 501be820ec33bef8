"""An episode as a file: all of it is proved, and every way of breaking it is told."""

import json
import math
from fractions import Fraction

import numpy as np
import pytest
from episodes import driven

import parc_jax as pj
from parc_jax import checker
from parc_jax.checker.answer import allowance_of
from parc_jax.checker.turns import OFF, cosine_and_sine
from parc_jax.errors import InputError
from parc_jax.loop.log import episode_part


def check(file: dict):
    return checker.check_episode(json.loads(json.dumps(file)), allowance_of)


@pytest.mark.parametrize("turning", [False, True])
def test_an_episode_is_accepted_and_says_from_when_to_when(turning, tmp_path, capsys):
    done = driven(turning)
    report = check(episode_part(done))
    assert report.manoeuvres == 4 and report.rests == 0
    assert report.begin == 0 and report.end == done[-1].end
    path = pj.loop.save_episode(tmp_path / "episode.json", done, {"robot": "toy"})
    assert checker.main([str(path)]) == 0
    assert "4 manoeuvres, each from its pose to its end" in capsys.readouterr().out
    assert checker.main([str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["manoeuvres"] == 4


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


def a_wrong_doubt(file):
    file["doubt"] = ["-1", "0", "0"]
    return "doubt"


@pytest.mark.parametrize(
    "broken",
    [
        moved_away,
        plan_from_elsewhere,
        out_of_order,
        too_long_under_way,
        something_in_the_way,
        another_tube,
        a_wrong_doubt,
    ],
)
def test_what_is_broken_is_rejected(broken):
    file = json.loads(json.dumps(episode_part(driven(False))))
    words = broken(file)
    with pytest.raises(checker.Rejected, match=words):
        check(file)


def test_a_robot_that_rested_in_between_is_where_it_rested():
    done = driven(False, 1)
    file = episode_part(done)
    again = json.loads(json.dumps(file["manoeuvres"][0]))
    again["begin"] = "7"
    file["manoeuvres"].append(again)
    with pytest.raises(checker.Rejected, match="outside of the tube"):
        check(file)  # it moved on, and rests elsewhere


@pytest.mark.parametrize("turned", [False, True])
def test_odometry_may_be_off_by_the_drift_that_is_declared(turned):
    """The robot moved on; told to be where it was, it is as far off as it drove."""
    done = driven(turned, 2)
    off = float(np.linalg.norm(done[1].asked.pose.place - done[0].asked.pose.place))

    def told_to_stand(drift):
        file = json.loads(json.dumps(episode_part(done, drift=drift)))
        file["manoeuvres"][1] = file["manoeuvres"][0] | {"begin": file["manoeuvres"][1]["begin"]}
        return file

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
    with pytest.raises(InputError, match="at least one commitment"):
        episode_part([])
    with pytest.raises(InputError, match="drift >= 0 m; got -1"):
        episode_part(driven(False, 1), drift=-1)
    with pytest.raises(InputError, match="of one loop"):
        episode_part([*driven(False, 1), *driven(True, 1)])
