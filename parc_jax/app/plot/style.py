"""One look for every picture: fonts, colours that colour-blind readers distinguish, how figures
are made and saved.

Figures are built without pyplot, inside `rc_context`: no backend is chosen and no global setting
survives the call.
"""

import io
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.runs.files import write_atomic

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"  # Okabe and Ito's palette
SKY, PURPLE, BLACK, GREY = "#56B4E9", "#CC79A7", "#222222", "#8C8C8C"
TUBE, GOAL, OBSTACLE = "#D6E8F5", "#CBE8DF", "#6E6E6E"
SEE_THROUGH = 0.6  # obstacles in space, which hide the parts behind them
DPI = 200

RC = json.loads(Path(__file__).with_name("house.json").read_text(encoding="utf-8"))


class Sheet(NamedTuple):
    """The canvas of a figure function. axes: flat array of Axes. out: its return value."""

    figure: Any
    axes: np.ndarray
    out: Any


@contextmanager
def sheet(
    to, size: tuple[float, float], rows: int = 1, columns: int = 1, **grid
) -> Iterator[Sheet]:
    """Axes to draw on, in the house style.

    to: None for a new figure; a path, which is also saved to on leaving, as PNG and PDF; or
    existing Axes, one or rows x columns of them. size: [inch] of a new figure. grid: width_ratios,
    height_ratios, sharex, sharey. The function hands back the figure it made, or the Axes it was
    given. Raises InputError.
    """
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    with matplotlib.rc_context(RC):
        if to is None or isinstance(to, str | Path):
            figure = Figure(size, layout="constrained")
            axes = np.atleast_1d(figure.subplots(rows, columns, **grid)).ravel()
            yield Sheet(figure, axes, figure)
            if to is not None:
                save(figure, to)
            return
        given = list(to) if isinstance(to, Sequence | np.ndarray) else [to]
        if len(given) != rows * columns or not all(isinstance(ax, Axes) for ax in given):
            raise InputError(
                f"plot: expected None, a path, or {rows * columns} matplotlib Axes; got {to!r:.80}."
            )
        yield Sheet(given[0].figure, np.array(given, dtype=object), to)


def save(figure, path) -> tuple[Path, Path]:
    """Write a figure as PNG and PDF; each file appears complete or not at all. Same input, same
    bytes.

    path: with or without suffix; .png and .pdf replace it.
    """
    import matplotlib

    path = Path(path)
    stem = path.with_suffix("") if path.suffix in (".png", ".pdf") else path
    unstamped = {
        "png": {"Software": None},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    }
    done = []
    with matplotlib.rc_context(RC):
        figure.draw_without_rendering()  # of axes with equal scales the second layout alone fits
        for kind, metadata in unstamped.items():
            buffer = io.BytesIO()
            figure.savefig(buffer, format=kind, dpi=DPI, metadata=metadata)
            done.append(write_atomic(stem.with_name(f"{stem.name}.{kind}"), buffer.getvalue()))
    return done[0], done[1]


def legend(figure, handles, columns: int) -> None:
    """A legend below the axes, where it hides no data."""
    looks = {"loc": "outside lower center", "handlelength": 1.8, "columnspacing": 1.4}
    figure.legend(handles=handles, ncols=columns, **looks)


def explain(sheet: Sheet, handles, columns: int, loc: str = "best") -> None:
    """The legend of a sheet: below a new figure, within the first of given Axes, at `loc`."""
    if sheet.out is sheet.figure:
        legend(sheet.figure, handles, columns)
    else:
        sheet.axes[0].legend(handles=handles, loc=loc)


def mark(label: str, **looks):
    """A line or a marker in a legend. looks: as of Line2D."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **looks)


def patch(label: str, **looks):
    """An area in a legend. looks: as of Patch."""
    from matplotlib.patches import Patch

    return Patch(label=label, **looks)


def areas(ax, outlines, **looks):
    """Draw areas by their outlines (v, 2); returns them. looks: as of PolyCollection."""
    from matplotlib.collections import PolyCollection

    return ax.add_collection(PolyCollection(outlines, **looks))


def ways(ax, places, **looks) -> None:
    """Draw lines by their places (v, 2). looks: as of LineCollection."""
    from matplotlib.collections import LineCollection

    ax.add_collection(LineCollection(places, **looks))


def limits(ax, lo, hi) -> None:
    """Show the box with these corners (2,)."""
    ax.set_xlim(lo[0], hi[0])
    ax.set_ylim(lo[1], hi[1])
