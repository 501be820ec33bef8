"""Sentences that differ in numbers alone are told as one, which holds for each of them."""

import re

import numpy as np
import pytest

import parc_jax as pj
from parc_jax.common.said import about_said, most_and_often, slot, together, without_braces
from parc_jax.drive.loop.statement import about_loops
from parc_jax.drive.loop.workers import Driven
from parc_jax.problem.problem import Span
from parc_jax.problem.world.free_space import FreeSpace


def test_numbers_are_told_from_the_least_to_the_most_rounded_outward():
    texts = ["Off by {0.0123} m.", "Off by {1e-05 to 0.5} m.", "Off by {0.0313} m.", "It is."]
    one = together(texts)
    assert [*one] == texts and {one[x] for x in texts} == {"Off by {1e-05 to 0.5} m.", "It is."}
    assert without_braces(together(texts[::2])[texts[0]]) == "Off by 0.012 to 0.032 m."
    assert without_braces("Off by {0.0123} m, {inf} m.") == "Off by 0.0123 m, {inf} m."
    assert slot("0.10", "0.1") == "{0.10}" and slot("-1", "2e3", "10") == "{-1 to 2e3}"


def test_other_words_other_numbers_and_braces_of_others_stay_as_they_are():
    texts = ["By {1} m.", "By {1} rad.", "By 1 m.", "By 2 m.", "Of {a}.", "Of {b}.", "{1,5}", "{}"]
    assert together(texts) == dict(zip(texts, texts, strict=True))
    assert [without_braces(x) for x in texts[2:]] == texts[2:]
    # of each text every number keeps its place
    one = together(["{1} m and {9} rad", "{2} m and {3} rad"])
    assert {*one.values()} == {"{1 to 2} m and {3 to 9} rad"}


def test_at_a_time_there_are_as_many_as_of_all_such_texts_together(rng):
    """Against a count in each interval, of obstacles that come and go."""
    for n in (1, 3, 40):
        first = rng.integers(0, 12, n)
        pairs = np.stack([first, first + rng.integers(0, 6, n)], axis=1)
        off = rng.uniform(size=n)
        said = [f"Off by {{{x}}} m." for x in off]
        spans = [Span(pair, said=x) for pair, x in zip(pairs.tolist(), said, strict=True)]
        there = [((pairs[:, 0] <= t) & (t <= pairs[:, 1])).sum() for t in range(20)]
        problem = pj.reach_avoid(pj.box([0], [1]), [pj.box([5], [6])] * n, 0.1, spans=spans)
        ((said, most),) = problem.rests_on.items()
        assert most == max(there)
        assert said == f"Off by {slot(str(off.min()), str(off.max()))} m."


def test_edges_are_there_at_every_time_beside_what_comes_and_goes():
    shapely = pytest.importorskip("shapely")
    free = FreeSpace(shapely.box(0, 0, 2, 2), 0.1)
    edges = free.obstacles()
    said = edges[0].rests_on.replace("0.1", "0.2")
    spans = [None] * len(edges) + [Span((0, 0), said=said), Span((1, 1), said=said)]
    goal, post = pj.box([0, 0], [1, 1]), pj.box([5, 5], [6, 6])
    problem = pj.reach_avoid(goal, [*edges, post, post], 0.1, spans=spans)
    assert list(problem.rests_on.values()) == [len(edges) + 1]
    (text,) = problem.rests_on
    assert "at least 0.1 to 0.2 m wide" in without_braces(text)


def test_a_manoeuvre_counts_once_and_the_most_at_a_time_is_that_of_one(rng):
    of = [({f"By {{{i}}} m.": n, "It is.": 2}, {f"By {{{i}}} m.": 1}) for i, n in enumerate((4, 9))]
    most, often = most_and_often([*of, ({"It is.": 7}, {"It is.": 3})])
    assert most == {"By {0 to 1} m.": 9, "It is.": 7}
    assert often == {"By {0 to 1} m.": 2, "It is.": 3}
    assert about_said(most, often, 5) == (
        "Of at most 9 at a time, in 2 of 5 manoeuvres alone: By 0 to 1 m. "
        "Of at most 7 at a time, in 3 of 5 manoeuvres alone: It is."
    )


def test_many_episodes_in_free_space_are_told_in_few_words(rng):
    """Each cycle has drifted by another sum, and its bounds are others: one text tells of all."""
    shapely = pytest.importorskip("shapely")
    driven = []
    for number in range(40):
        free, told = FreeSpace(shapely.box(0, 0, 2, 2), 0.15), []
        for off, by in rng.uniform(1e-5, 1e-3, (30, 2)).tolist():
            free = free.drifted((1.0, 1.0), off, by)
            scene = pj.reach_avoid(pj.box([0, 0], [1, 1]), free.obstacles(), 0.1)
            told.append((scene.rests_on, dict.fromkeys(scene.rests_on, 1)))
        kept = [*map(dict, most_and_often(told)), ["one"] * 30]
        driven.append(Driven(number, False, False, "", {}, ["a loop"], None, False, *kept))
    said = about_loops(driven)
    assert len(said) < 1500 and said.count("at a time") == 1
    (moved,) = re.findall(r"drifts by (\S+) to (\S+) m, it turns", said)
    assert float(moved[0]) <= 2e-5 and 9.9e-4 <= float(moved[1]) <= 1e-3
