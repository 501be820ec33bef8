"""How corridors cover the safe set: the uncovered share against their number and time."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot import style
from parc_jax.common.errors import InputError
from parc_jax.safe_set.corridors.found import Progress


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
                    ax.step(along, left, where="post", **style.line(index), label=curve.name)
        for ax, label in zip(sheet.axes, ("number of corridors", "time [s]"), strict=True):
            if target is not None:
                ax.axhline(target, color=style.GREY, linewidth=0.8, linestyle=":")
                along = {"xycoords": ("axes fraction", "data"), "ha": "left", "va": "top"}
                style.note(ax, "target", (0, target), (3, -3), **along, **style.SMALL)
            ax.set_yscale("log")
            ax.yaxis.set_major_formatter("{x:g}")
            ax.set_ylim(floor, 1.2)
            ax.grid(True, axis="y")
            ax.set_xlabel(label)
        sheet.axes[0].set_xscale("log")
        sheet.axes[0].set_ylabel("share of the safe set not covered")
        if sheet.out is sheet.figure:
            handles = [style.mark(one.name, **style.line(i)) for i, one in enumerate(curves)]
            style.legend(sheet.figure, handles, min(len(curves), 4))
    return sheet.out


def of_history(history: Sequence[Progress]) -> list[CoverCurve]:
    """The curve of a search (`answer.cover.history`)."""
    progress = Progress(*(np.array(column) for column in zip(*history, strict=True)))
    return [CoverCurve("corridors", progress.covered, progress.corridors, progress.seconds)]
