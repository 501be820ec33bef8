"""Measured shares: of the safe set that is covered over time, of goal-reaching plans over the width
of a gap, and bars with bounds by group.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot import style
from parc_jax.common.errors import InputError
from parc_jax.safe_set.corridors.search import Progress

CYCLE = (style.BLUE, style.RED, style.GREEN, style.PURPLE, style.ORANGE, style.SKY, style.BLACK)
DASHES = ("-", (0, (5, 1.6)), (0, (1, 1.2)), (0, (5, 1.4, 1, 1.4)))
SMALL = {"color": style.GREY, "fontsize": 8}  # of words within a picture


def note(ax, words: str, at, away: tuple[float, float], **looks) -> None:
    """Words beside a place, [points] away from it. looks: as of `Axes.annotate`."""
    ax.annotate(words, at, away, textcoords="offset points", **looks)


def line(number: int) -> dict:
    """Colour and dashes of the n-th line of a picture, so that lines differ in more than colour."""
    return {"color": CYCLE[number % len(CYCLE)], "linestyle": DASHES[number % len(DASHES)]}


class CoverCurve(NamedTuple):
    """One run. name: as in the legend. share (m,): covered, in [0, 1].

    number (m,): sets behind each share. seconds (m,): after the query began. Either may be None.
    """

    name: str
    share: np.ndarray
    number: np.ndarray | None = None
    seconds: np.ndarray | None = None


def cover(
    curves: Sequence[CoverCurve], to=None, *, target: float | None = 0.01, floor: float = 1e-3
):
    """Uncovered share on a logarithmic scale, against the number of sets and against time
    where these are known.

    target: uncovered share asked for. floor: shares below are drawn here. to: as in `style.sheet`;
        two Axes.
    Raises InputError.
    """
    if not curves or any(c.number is None and c.seconds is None for c in curves):
        raise InputError(
            "cover: expected at least one curve, each with a number of sets or a time per share."
        )
    with style.sheet(to, (8.0, 3.4), columns=2, sharey=True) as sheet:
        for index, curve in enumerate(curves):
            left = np.maximum(1 - np.asarray(curve.share, float), floor)
            for ax, along in zip(sheet.axes, (curve.number, curve.seconds), strict=True):
                if along is not None:
                    ax.step(along, left, where="post", **line(index), label=curve.name)
        for ax, label in zip(sheet.axes, ("number of corridors", "time [s]"), strict=True):
            if target is not None:
                ax.axhline(target, color=style.GREY, linewidth=0.8, linestyle=":")
                along = {"xycoords": ("axes fraction", "data"), "ha": "left", "va": "top"}
                note(ax, "target", (0, target), (3, -3), **along, **SMALL)
            ax.set_yscale("log")
            ax.yaxis.set_major_formatter("{x:g}")
            ax.set_ylim(floor, 1.2)
            ax.grid(True, axis="y")
            ax.set_xlabel(label)
        sheet.axes[0].set_xscale("log")
        sheet.axes[0].set_ylabel("share of the safe set not covered")
        if sheet.out is sheet.figure:
            handles = [style.mark(one.name, **line(i)) for i, one in enumerate(curves)]
            style.legend(sheet.figure, handles, min(len(curves), 4))
    return sheet.out


def of_history(history: Sequence[Progress]) -> list[CoverCurve]:
    """The curve of a search (`answer.cover.history`)."""
    progress = Progress(*(np.array(column) for column in zip(*history, strict=True)))
    return [CoverCurve("corridors", progress.covered, progress.corridors, progress.seconds)]


class GapCurve(NamedTuple):
    """One method. name: as in the legend. gaps (g,) [m]. share (g,) of the goal-reaching set kept
    as safe, in [0, 1].

    low, high: (g,) confidence bounds, or None.
    """

    name: str
    gaps: np.ndarray
    share: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None


class GapRoom(NamedTuple):
    """The narrowest gap with a plan, of one method: the room [m] that it leaves beside the circle
    around the body, negative where that does not fit, and beside the body itself. None where there
    is no such plan, or nothing is known of the body.
    """

    name: str
    circle: float | None
    body: float | None = None


def gap(
    curves: Sequence[GapCurve],
    to=None,
    *,
    published: float | None = None,
    label: str = "gap width [m]",
    rooms: Sequence[GapRoom] = (),
):
    """Safe share against gap width on a logarithmic scale; nothing kept is a hollow mark on the
    floor. With `rooms`, below that the narrowest gaps, two Axes.

    published: gap [m] of the published scene, marked by a line. to: as in `style.sheet`. Raises
        InputError.
    """
    if not curves or any(
        np.shape(c.gaps) != np.shape(c.share) or np.size(c.gaps) == 0 for c in curves
    ):
        raise InputError("gap: expected at least one curve, with one share per gap.")
    kept = np.concatenate([np.asarray(c.share, float) for c in curves])
    kept = kept[kept > 0]
    floor = 10.0 ** np.floor(np.log10(kept.min() if kept.size else 1e-2) - 0.3)
    more = 0.5 + 0.24 * len(rooms) if rooms else 0.0  # [inch]
    grid = {"height_ratios": (3.8, more)} if rooms else {}
    with style.sheet(to, (5.6, 3.8 + more), rows=1 + bool(rooms), **grid) as sheet:
        ax = sheet.axes[0]
        for number, curve in enumerate(curves):
            _curve(ax, curve, number, floor)
        if published is not None:
            ax.axvline(published, color=style.GREY, linewidth=0.8, linestyle=":")
            above = {"xycoords": ("data", "axes fraction"), "annotation_clip": False}
            looks = {"ha": "center", **SMALL}
            note(ax, "published scene", (published, 1.0), (3, 3), **above, **looks)
        ax.set_yscale("log")
        ax.set_ylim(0.8 * floor, 1.3)
        ticks = 10.0 ** np.arange(round(np.log10(floor)) + 1, 1)
        ax.set_yticks([floor, *ticks], ["none", *(f"{100 * t:g} %" for t in ticks)])
        ax.minorticks_off()
        ax.grid(True, axis="y")
        ax.set_xlabel(label)
        ax.set_ylabel("share of the goal-reaching set kept as safe")
        handles = ax.get_legend_handles_labels()[0]
        style.explain(sheet, handles, min(len(curves), 3), "lower right")
        if rooms:
            _narrowest(sheet.axes[1], rooms, [c.name for c in curves])
            both = np.array([ax.get_xlim() for ax in sheet.axes])
            for ax in sheet.axes:  # one scale: a hollow mark is where its curve ends
                ax.set_xlim(both[:, 0].min(), both[:, 1].max())
    return sheet.out


def _narrowest(ax, rooms: Sequence[GapRoom], curves: list[str]) -> None:
    """A line per method, from above: hollow where the circle, filled where the body is measured."""
    ax.axvline(0.0, color=style.GREY, linewidth=0.8)
    for row, room in enumerate(rooms):
        number = curves.index(room.name) if room.name in curves else len(curves)
        color = line(number)["color"]
        known = [x for x in (room.circle, room.body) if x is not None]
        ax.plot(known, [row] * len(known), color=color, linewidth=0.8)
        for x, marker, face in ((room.circle, "o", "white"), (room.body, "s", color)):
            if x is not None:
                ax.plot([x], [row], color=color, marker=marker, markerfacecolor=face)
        if not known:
            note(ax, "no plan", (0.0, row), (4, 0), va="center")
    ax.set_yticks(range(len(rooms)), [room.name for room in rooms])
    ax.set_ylim(len(rooms) - 0.5, -0.5)
    ax.grid(True, axis="x")
    ax.set_xlabel(
        "narrowest gap with a plan:\nroom beside the circle (hollow) and the body (filled) [m]"
    )


def _curve(ax, curve: GapCurve, number: int, floor: float) -> None:
    order = np.argsort(curve.gaps)
    gaps, share = np.asarray(curve.gaps, float)[order], np.asarray(curve.share, float)[order]
    looks = {"marker": "osD^v"[number % 5], **line(number)}
    ax.plot(gaps, np.maximum(share, floor), **looks, label=curve.name, markersize=4)
    none = gaps[share <= 0]
    looks |= {"linestyle": "none", "markerfacecolor": "white", "markersize": 5 + 3 * number}
    ax.plot(none, np.full(len(none), floor), **looks, zorder=3 - 0.1 * number)
    if curve.low is not None and curve.high is not None:
        bounds = (np.maximum(np.asarray(x, float)[order], floor) for x in (curve.low, curve.high))
        ax.fill_between(gaps, *bounds, color=looks["color"], alpha=0.18, linewidth=0)


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
                note(ax, f"{100 * bar.share:.0f} %", number_at, (4, 0), **looks)
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
