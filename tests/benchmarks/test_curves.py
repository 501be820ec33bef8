"""Curves and bars of shares, as benchmarks draw them."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from benchmarks.curves import Bar, CoverCurve, GapCurve, GapRoom, cover, gap, of_history, shares
from parc_jax.common.errors import InputError
from parc_jax.safe_set.corridors.search import Progress


def test_every_bar_stands_where_its_share_and_bounds_say():
    groups = {"one": [Bar("a", 0.2, 0.1, 0.35)], "two": [Bar("b", 0.5, 0.5, 0.5)]}
    ax = shares(groups).axes[0]
    assert [bar.get_width() for bar in ax.patches] == [20, 50]
    assert [t.get_text() for t in ax.get_yticklabels()] == ["a", "b"]
    assert {"20 %", "50 %", "one", "two"} <= {t.get_text() for t in ax.texts}
    ends = ax.collections[0].get_segments()[0][:, 0]
    assert ends.tolist() == pytest.approx([10, 35])


def test_nothing_to_draw_is_refused():
    for nothing in ({}, {"one": []}):
        with pytest.raises(InputError, match="at least one group"):
            shares(nothing)


def test_gap_marks_methods_that_keep_nothing():
    gaps = np.array([6.5, 6.0, 5.5])
    joint = GapCurve("joint", gaps, [0.5, 0.1, 0.01], [0.4, 0.08, 0.0], [0.6, 0.2, 0.02])
    drawn = gap([joint, GapCurve("old", gaps, [0.001, 0, 0])], published=6.5)
    ax = drawn.axes[0]
    assert ax.get_yticklabels()[0].get_text() == "none"
    hollow = [
        line for line in ax.lines if line.get_markerfacecolor() == "white" and len(line.get_xdata())
    ]
    assert [sorted(line.get_xdata()) for line in hollow] == [[5.5, 6.0]]
    assert isinstance(gap([GapCurve("none at all", gaps, [0, 0, 0])]), Figure)
    with pytest.raises(InputError):
        gap([])


def test_the_narrowest_gap_has_a_mark_for_the_circle_and_one_for_the_body():
    curve = GapCurve("disc", np.array([0.5, 1.0]), [0.1, 0.5])
    rooms = [GapRoom("disc", 0.4, 0.7), GapRoom("outline", -0.1, 0.2), GapRoom("neither", None)]
    share, narrowest = gap([curve], rooms=rooms).axes
    assert [label.get_text() for label in narrowest.get_yticklabels()] == [r.name for r in rooms]
    marks = {
        (line.get_marker(), *line.get_xydata()[0]): line
        for line in narrowest.lines
        if line.get_marker() != "None"
    }
    assert set(marks) == {("o", 0.4, 0), ("s", 0.7, 0), ("o", -0.1, 1), ("s", 0.2, 1)}
    for (marker, _, row), mark in marks.items():
        filled = mark.get_markerfacecolor() == mark.get_color()
        assert filled is (marker == "s")
        assert (mark.get_color() == share.lines[0].get_color()) == (row == 0)
    assert [said.get_text() for said in narrowest.texts] == ["no plan"]
    assert share.get_xlim() == narrowest.get_xlim() and share.get_xlim()[0] < -0.1
    with pytest.raises(InputError, match="2 matplotlib Axes"):
        gap([curve], share, rooms=rooms)


def test_cover_draws_each_curve():
    looks = [Progress(0.1, 2, 0.7), Progress(0.2, 5, 1.0)]
    drawn = cover([*of_history(looks), CoverCurve("by size", [0.2, 0.9], [1, 2])])
    count, seconds = drawn.axes
    assert (
        len(
            [
                line
                for line in count.lines
                if len(line.get_xdata()) == 2 and line.get_linestyle() != ":"
            ]
        )
        == 2
    )
    assert seconds.get_xlabel() == "time [s]"
    assert count.lines[0].get_ydata()[-1] == 1e-3  # all covered: drawn at the floor
    with pytest.raises(InputError):
        cover([CoverCurve("nothing to draw against", [0.1])])
