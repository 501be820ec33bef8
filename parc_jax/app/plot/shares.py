"""Shares with their bounds as bars, by group: how much of what truly succeeds is certified."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot import style
from parc_jax.common.errors import InputError


class Bar(NamedTuple):
    """One share in [0, 1], with bounds."""

    name: str
    share: float
    low: float
    high: float


def shares(groups: Mapping[str, Sequence[Bar]], to=None, *, label: str = "share"):
    """Horizontal bars, groups below one another, each with its bounds and its number. to: as in
    `style.sheet`. Raises InputError.
    """
    if not groups or not all(groups.values()):
        raise InputError("shares: expected at least one group, and a bar in every group.")
    n = sum(map(len, groups.values()))
    with style.sheet(to, (6.2, 0.7 + 0.21 * n + 0.16 * len(groups))) as sheet:
        ax = sheet.axes[0]
        at, places, names = 0.0, [], []
        for number, (group, bars) in enumerate(groups.items()):
            first = at
            for rank, bar in enumerate(bars, 1):
                color = style.CYCLE[number % len(style.CYCLE)]
                ax.barh(at, 100 * bar.share, 0.78, color=color, alpha=0.3 + 0.7 * rank / len(bars))
                bounds = 100 * np.abs(np.array([[bar.low], [bar.high]]) - bar.share)
                ax.errorbar(100 * bar.share, at, xerr=bounds, color=style.BLACK, lw=0.8, capsize=2)
                number_at, looks = (100 * bar.high, at), {"va": "center", "fontsize": 7.5}
                style.note(ax, f"{100 * bar.share:.0f} %", number_at, (4, 0), **looks)
                places.append(at)
                names.append(bar.name)
                at += 1
            ax.annotate(
                group,
                (1.0, 0.5 * (first + at - 1)),
                xycoords=("axes fraction", "data"),
                va="center",
                fontsize=8,
            )
            at += 0.8
        ax.set_yticks(places, names)
        ax.invert_yaxis()
        ax.set_xlim(0, 100)
        ax.set_xlabel(f"{label} [%]")
        ax.grid(axis="x")
    return sheet.out
