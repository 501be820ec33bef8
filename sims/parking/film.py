"""A picture and a film of a case that was driven."""

from pathlib import Path

import numpy as np

from sims.parking import car as c
from sims.parking.cases import Case

STEP = 0.2  # [s] of the drive between frames
EVERY = 12  # records between outlines of the picture
COLUMNS = 4  # of pictures in a sheet of several cases
AROUND = 3.0  # [m] around the way that is shown


def draw(place: Path, case: Case, one, film: bool = False) -> None:
    """Write `place` as a picture of all of a `Parked`, or as a film."""
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.figure import Figure

    points = c.corners(*one.path.T)
    figure = Figure(figsize=(6, 6), dpi=80)
    axes = figure.add_axes((0, 0, 1, 1))
    width, height = _scene(axes, case, points)
    figure.set_figheight(6 * float(np.clip(height / width, 0.4, 1.6)))
    if not film:
        _cars(axes, points)
        figure.savefig(place)
        return
    (body,) = axes.fill(*points[0, 1:].T, color="tab:blue", alpha=0.8)
    (nose,) = axes.plot([], [], color="k", lw=2)
    moments = np.arange(0.0, one.times[-1] + 1.0, STEP)
    rows = np.clip(np.searchsorted(one.times, moments), 0, len(points) - 1)

    def show(row: int):
        body.set_xy(points[row, 1:])
        nose.set_data(*points[row, [1, 4]].T)
        return body, nose

    # seconds of the drive pass two times as fast
    FuncAnimation(figure, show, rows, cache_frame_data=False).save(
        place, writer=PillowWriter(fps=round(2 / STEP))
    )


def sheet(place: Path, cases: list[Case], driven: list) -> None:
    """Write `place` as one picture of several `Parked`, each of its case."""
    from matplotlib.figure import Figure

    rows = -(-len(cases) // COLUMNS)
    figure = Figure(figsize=(2.2 * COLUMNS, 2.2 * rows), dpi=90, layout="constrained")
    for i, (case, one) in enumerate(zip(cases, driven, strict=True)):
        axes, points = figure.add_subplot(rows, COLUMNS, i + 1), c.corners(*one.path.T)
        _scene(axes, case, points)
        _cars(axes, points)
        axes.set_title(
            case.name if one.reached and one.proved else f"{case.name}, not parked", fontsize=8
        )
    figure.savefig(place)


def _scene(axes, case: Case, points: np.ndarray) -> np.ndarray:
    """Draw what stands there, the goal and the way; returns width and height [m]."""
    goal = c.corners(*case.goal)[1:]
    seen = np.concatenate([points.reshape(-1, 2), goal])
    lo, hi = seen.min(axis=0) - AROUND, seen.max(axis=0) + AROUND
    axes.set(xlim=(lo[0], hi[0]), ylim=(lo[1], hi[1]), aspect="equal")
    axes.axis("off")
    for outline in case.outlines:
        axes.fill(*outline.T, color="0.6", lw=0)
    axes.fill(*goal.T, color="tab:green", alpha=0.3, lw=0)
    axes.plot(*points[:, 0].T, color="tab:blue", lw=1)
    return hi - lo


def _cars(axes, points: np.ndarray) -> None:
    for corners in [*points[::EVERY, 1:], points[-1, 1:]]:
        axes.fill(*corners.T, facecolor="none", edgecolor="tab:blue", lw=0.5, alpha=0.6)
