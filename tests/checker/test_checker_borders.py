"""On the borders of what is accepted: polytopes are open where bins meet, closed at the ends of K;
what is accepted on a border is safe by the definition. Many more points by one command:
python -m benchmarks.attacks borders.
"""

import collections
from fractions import Fraction as F

import answer_files as build
import borders
import known
import pytest
from rows_of_sets import set_rows

from parc_jax import checker


def wrong(tally):
    return {kind: count for kind, count in tally.items() if str(kind).startswith("wrong")}


@pytest.mark.slow
@pytest.mark.soundness
def test_a_thousand_points_on_borders():
    tally = sum((borders.look(seed, 20) for seed in range(10)), collections.Counter())
    assert not wrong(tally)
    on = {key: count for key, count in tally.items() if key[1] == "on"}
    assert sum(on.values()) > 1000
    for kind in ("polytope", "samples", "corridors"):
        assert on[kind, "on", "in"] > 5 and on[kind, "on", "out"] > 5
        assert tally[kind, "before", "in"] > 0 and tally[kind, "beyond", "out"] > 0


def closed(real):
    """The rows as they were: closed at all faces of the bin."""

    def rows(self, number):
        return [(name, False, a, c) for name, _, a, c in real(self, number)]

    return rows


def faces(answer, number):
    """(name, strict) of the rows of k for the set of an answer in a bin."""
    context = checker.Context(*(answer[part] for part in checker.PARTS))
    piece = answer["sets"][0] | {"bin": number}
    return [
        (strict, F(-c, a[-1]), a[-1] > 0)
        for name, strict, a, c in set_rows(context, piece)
        if name == "axis 0 of k"
    ]


def test_faces_towards_other_bins_are_open_and_ends_of_the_domain_closed():
    """Bins [-1, 0] and [0, 1] of K = [-1, 1]."""
    lower, upper = (faces(known.plain(), number) for number in (0, 1))
    assert sorted(lower) == [
        (False, -1, True),
        (False, -1, True),
        (False, 1, False),
        (True, 0, False),
    ]
    assert sorted(upper) == [
        (False, -1, True),
        (False, 1, False),
        (False, 1, False),
        (True, 0, True),
    ]


def test_an_end_of_the_domain_on_an_inner_edge_is_open():
    """There two tubes would have to hold, for a sample too."""
    answer = known.change(known.plain(), {"problem__domain__lo": ["0"]})
    assert (True, 0, True) in faces(answer, 1) and (False, 0, True) in faces(answer, 1)


def test_the_ends_of_the_domain_belong_to_samples():
    """k = 1.6 as the float that the domain ends with, spelled exactly; one more bit is outside."""
    end = F(1.6)
    answer = known.change(
        known.plain(),
        {
            "problem__domain__hi": [build.text(end)],
            "problem__goal__b__1": "9",
            "tube__edges": [["-1", "0", build.text(end)]],
            "samples__0__k": [build.text(end)],
        },
    )
    assert checker.check_answer(answer).samples == 1
    answer["samples"][0]["k"] = [build.text(end + F(1, 2**60))]
    with pytest.raises(checker.Rejected, match="k is outside the domain"):
        checker.check_answer(answer)


def test_on_a_border_each_bin_counts_and_no_mixture_of_bins():
    """Along the diagonal either bin reaches 1; axis by axis the widest of both would reach 3/2."""
    answer = known.change(
        known.plain(),
        {
            "problem__obstacles__0": {"A": [["1", "1"], ["-1", "0"], ["0", "-1"]]},
            "problem__obstacles__0__b": ["-2", "9", "9"],
            "tube__interval": [[[["1/4", "3/4"]]] * 2, [[["3/4", "1/4"]]] * 2],
            "samples__0__k": ["0"],
            "samples__0__sep": [[[[2, [[0, "1"]]]]]],
            "sets": [],
        },
    )
    assert checker.check_answer(answer).samples == 1
    wider = known.change(answer, {"tube__interval__0": [[["3/4", "3/4"]]] * 2})
    with pytest.raises(checker.Rejected, match="obstacle 0 at knot 0"):
        checker.check_answer(wider)
