"""Bars of shares: what is drawn is what was given."""

import pytest

from benchmarks.curves import Bar, shares
from parc_jax.common.errors import InputError


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
