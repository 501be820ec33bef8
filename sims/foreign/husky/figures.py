"""Pictures of the study: errors in the tube, commands, and real paths through the bay."""

from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.plot import shapes, style
from parc_jax.app.plot.shapes import predicted
from parc_jax.learning.bound.measure import measure
from parc_jax.problem.body import numbered
from sims.foreign.husky import params as c
from sims.foreign.husky.learn import Halves
from sims.recorded import Recorded

SHOWN = (0.0, 0.03, 0.2, 0.4, 0.6, 0.95)  # replays drawn, of all from the farthest way on
KINDS = {"driving (both sides the same way)": 8, "turning (against each other)": 2}  # their bins


def draw_all(answer: Answer, runs: Halves, replayed: Recorded | None, out: Path) -> list[Path]:
    """Write every picture below `out` as PNG and PDF; the files."""
    drawn = [out / "errors.png", out / "commands.png"]
    errors(answer, runs, drawn[0])
    commands(answer, runs, replayed, drawn[1])
    if replayed is not None:
        drawn.append(out / "paths.png")
        paths(answer, replayed, drawn[-1])
    return drawn


def errors(answer: Answer, runs: Halves, to):
    """Largest error of any corner over time: every held-out run, under the tube."""
    from matplotlib.lines import Line2D

    model, held = answer.model, runs.held
    seen = measure(model.net, held).interval.max(axis=2)
    knots = np.arange(model.time.n_steps + 1) * model.time.dt
    sticking = (np.abs(held.k) < c.STICKING).any(axis=1)
    turning = held.k[:, 0] * held.k[:, 1] < 0
    chosen = (~sticking & ~turning, ~sticking & turning, sticking)
    with style.sheet(to, (10.0, 3.0), columns=3) as sheet:
        names = [*KINDS, "a wheel that may stick"]
        for ax, name, rows in zip(sheet.axes, names, chosen, strict=True):
            for run in seen[rows]:
                ax.stairs(100 * run, knots, baseline=None, color=style.BLUE, linewidth=0.5)
            if name in KINDS:
                half = model.tube.interval[KINDS[name]].max(axis=1)
                ax.stairs(100 * half, knots, baseline=None, color=style.RED, linewidth=1.6)
            ax.set(xlabel="time [s]", ylim=(0, None), title=f"{name}: {int(rows.sum())} runs")
        sheet.axes[0].set_ylabel("largest error of a corner [cm]")
        entries = [
            Line2D([], [], color=style.RED, linewidth=1.6, label="tube, widest bin of its kind"),
            Line2D([], [], color=style.BLUE, linewidth=0.5, label="a held-out run"),
        ]
        style.legend(sheet.figure, entries, 2)
    return sheet.out


def commands(answer: Answer, runs: Halves, replayed: Recorded | None, to):
    """Held-out commands: how far off the model was, and which have a start that is proved safe."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    model, held = answer.model, runs.held
    worst = 100 * measure(model.net, held).interval.max(axis=(1, 2))
    safe = np.zeros(held.n, bool) if replayed is None else replayed.with_start
    with style.sheet(to, (5.6, 4.6)) as sheet:
        (ax,) = sheet.axes
        for axis in (ax.axvspan, ax.axhspan):
            axis(-c.STICKING, c.STICKING, color="#EBEBEB", zorder=0)
        shown = ax.scatter(*held.k.T, s=34, c=worst, cmap="cividis", vmax=40, zorder=3)
        ax.scatter(
            *held.k[safe].T, s=80, facecolor="none", edgecolor=style.GREEN, linewidth=1.0, zorder=4
        )
        label = "largest error of a corner [cm]"
        sheet.figure.colorbar(shown, ax=ax, label=label, extend="max")
        ax.set(
            xlabel=model.labels.k[0],
            ylabel=model.labels.k[1],
            aspect="equal",
            title=f"{held.n} held-out commands; {int(safe.sum())} with a safe start",
        )
        ring = {"marker": "o", "fillstyle": "none", "linestyle": "none", "markersize": 9}
        entries = [
            Line2D([], [], color=style.GREEN, **ring, label="has a start that is proved safe"),
            Patch(facecolor="#EBEBEB", label="a wheel may stick"),
        ]
        style.legend(sheet.figure, entries, 2)
    return sheet.out


def paths(answer: Answer, replayed: Recorded, to):
    """Real paths over the tubes: a few plans with the footprint as it was recorded, then all."""
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    model, runs = answer.model, replayed.runs
    first = np.unique(replayed.row, return_index=True)[1]
    way = np.abs(runs.path[first, -1, :2] - runs.path[first, 0, :2]).sum(axis=1)
    ranks = (np.array(SHOWN) * len(first)).astype(int)
    chosen = first[np.argsort(-way)[ranks]]
    parts = numbered(answer.problem.body, model.points)
    walls = [shapes.shadow(o) for o in answer.problem.obstacles]
    ((_, (goal,)),) = shapes.goals(answer.problem.goal, 2, model.n_points, [(0, 1)])[:1]
    plans = replayed.plans
    every = model.time.stride
    with style.sheet(to, (10.5, 7.0), rows=2, columns=3) as sheet:
        sheet.axes[3].set(xlabel=model.labels.p[0], ylabel=model.labels.p[1])
        for ax, row in zip(sheet.axes, chosen, strict=True):
            columns, _, half = predicted(model, plans[row : row + 1])
            for point in range(1, model.n_points):
                own = slice(2 * point, 2 * point + 2)
                swept = shapes.tubes(columns[..., own], half[..., own]).reshape(-1, 6, 2)
                ax.add_collection(PolyCollection(swept, facecolors="#D6E8F5", zorder=1))
            corners = runs.path[row].reshape(-1, model.n_points, 2)[:, 1:].swapaxes(0, 1)
            ax.add_collection(LineCollection(corners, colors=style.BLACK, linewidths=0.8, zorder=4))
            prints = shapes.footprints(parts, runs.path[row, ::every], 2, (0, 1))
            looks = {"facecolors": "none", "edgecolors": style.BLUE, "linewidths": 0.5}
            ax.add_collection(PolyCollection(prints, **looks, zorder=3))
            for wall in walls:
                ax.fill(*wall.T, facecolor="#6E6E6E", zorder=2)
            ax.fill(*goal.T, facecolor=style.GREEN, alpha=0.2, zorder=0.5)
            left, right = plans[row, 2:]
            ax.set(aspect="equal", title=f"wheels {left:.1f}, {right:.1f} rad/s")
            lo, hi = shapes.span(*walls, corners.reshape(-1, 2))
            ax.set(xlim=(lo[0], hi[0]), ylim=(lo[1], hi[1]))
        entries = [
            Line2D([], [], color=style.BLACK, linewidth=0.8, label="recorded ways of the corners"),
            Line2D([], [], color=style.BLUE, linewidth=0.5, label="recorded footprint"),
            Patch(facecolor="#D6E8F5", label="tubes of the corners"),
            Patch(facecolor=style.GREEN, alpha=0.2, label="bay"),
            Patch(facecolor="#6E6E6E", label="wall"),
        ]
        style.legend(sheet.figure, entries, 5)
    return sheet.out
