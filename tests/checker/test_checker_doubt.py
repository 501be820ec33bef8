"""Boxes of doubt: every plan in one is safe, and what is not a box of safe plans is refused."""

import random
import tracemalloc

import answer_files as build
import known
import known_points
import pytest

from parc_jax import checker

# point 0 of the scene is at heights 0, h, 2 h with h = max(k, 0); the capsule reaches 1/2 down, the
# errors 1/4, and the obstacle lies below -1
KEPT = 1 / 4


def check(**changes):
    answer = known.change(known_points.points(), changes)
    context = checker.Context(*(answer[part] for part in checker.PARTS))
    return checker.check_doubt(context, answer["doubt"][0])


def test_room_for_p0_up_to_contact():
    check(doubt__0__room__p0=["1/8", build.text(KEPT - 2**-40)])
    with pytest.raises(checker.Rejected, match="obstacle 0 at knot 0, point 0 fails in the box"):
        check(doubt__0__room__p0=["1/8", build.text(KEPT)])


def test_a_box_fails_where_one_of_its_corners_does():
    """At k = 1 the end is at height 2, and at 3 with the second point: the goal ends at 4 - 1/4."""
    wide = {"doubt__0__room__k": ["1/2"]}
    check(**wide)
    check(**wide, problem__goal__b__3=build.text(3 + 1 / 4 + 1 / 8))
    with pytest.raises(checker.Rejected, match="goal row 3 fails in the box"):
        check(**wide, problem__goal__b__3=build.text(3 + 1 / 4 + 1 / 8 - 2**-40))


def test_a_box_without_room_is_its_plan():
    check(doubt__0__room={"p0": ["0", "0"], "k": ["0"]})
    with pytest.raises(checker.Rejected):
        check(doubt__0__room={"p0": ["0", "0"], "k": ["0"]}, doubt__0__p0=["0", "-1/4"])


def test_a_box_across_the_kink_of_the_network_is_looked_at_there():
    """For k in [-1/2, 1/2] the heights are those of |k| after a change of the network: the least at
    the kink, where no corner of the box is.
    """
    kink = {
        "network__weights": [
            [["1"], ["-1"]],
            [["0", "0"]] * 2 + [["0", "0"], ["1", "1"]] * 2 + [["0", "0"], ["2", "2"]] * 2,
        ],
        "network__biases__0": ["0", "0"],
        "samples": [],
        "sets": [],
        "corridors": [],
        "doubt__0__k": ["0"],
        "doubt__0__room__k": ["1/2"],
        "problem__obstacles__0__steps": [1, 1],
    }
    only_end = {"doubt__0__sep": [[[[2, known.TOP]]] * 2]}
    check(**kink, **only_end)
    with pytest.raises(checker.Rejected, match="obstacle 0 at knot 1"):
        check(**kink, **only_end, doubt__0__p0=["0", "-1/8"])


def test_boxes_are_told():
    report = checker.check_answer(known_points.points())
    assert report.doubt == 1
    lines = "\n".join(checker.summary(report))
    assert "  1 box of doubt: so does every (p0, k) within the room of one" in lines
    assert "boxes of doubt" not in "\n".join(checker.summary(checker.check_answer(known.plain())))


def test_a_file_that_claims_nothing_proves_nothing():
    """Its words ended in a colon, as if what was proved had been left out."""
    plain, words = known.plain(), "  nothing: the file holds no plan, and no proof of none"
    assert words not in checker.summary(checker.check_answer(plain))
    assert words in checker.summary(checker.check_answer(plain | {"samples": [], "sets": []}))


def long_and_wide(top, T=500, neurons=30):
    """A box over all of K of a robot on a line with many knots, above an obstacle: hundreds of
    cells, and T outputs at each of their vertices. It may start 1 below zero, and goes up only.
    """
    rng = random.Random(0)
    weights = [[str(rng.randint(-99, 99)) for _ in range(2)] for _ in range(neurons)]
    biases = [str(rng.randint(-60, 60)) for _ in weights]
    answer = known.line()
    answer["problem"] |= {
        "n_k": 2,
        "steps": T,
        "domain": {"lo": ["-1"] * 2, "hi": ["1"] * 2},
        "obstacles": [build.box_rows((-4,), (top,))],
    }
    answer["network"] = {
        "weights": [weights, [["1e-4"] * neurons], [["1"]] * T],
        "biases": [biases, ["0"], ["0"] * T],
    }
    answer["tube"] = {
        "edges": [["-1", "1"]] * 2,
        "interval": [[[["0"]]] * T],
        "final": [["0"]],
    }
    room = {"p0": ["1"], "k": ["1", "1"]}
    box = {"p0": ["0"], "k": ["0", "0"], "room": room, "sep": [[[[T, [[0, "1"]]]]]]}
    return build.rehash(answer | {"samples": [], "doubt": [box]})


@pytest.mark.slow
@pytest.mark.parametrize(("top", "safe"), [("-1.001", True), ("-0.999", False)])
def test_a_short_file_takes_little_memory(top, safe):
    """The outputs are known at one vertex at a time: at all of them they would be 5 MB."""
    answer = long_and_wide(top)
    tracemalloc.start()
    try:
        accepted = checker.check_answer(answer).doubt == 1
    except checker.Rejected as why:
        assert "fails in the box" in str(why)
        accepted = False
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert accepted == safe and peak < 2e6
