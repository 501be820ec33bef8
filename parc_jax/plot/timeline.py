"""One plan over time: how far it stays from every obstacle, and the directions that prove it."""

from collections.abc import Sequence

import jax
import numpy as np

from parc_jax.arrays import x64
from parc_jax.checker import number
from parc_jax.errors import InputError
from parc_jax.obstacles.segment import separations
from parc_jax.plot import style
from parc_jax.plot.predict import predicted

SHORT = 0.035  # runs shorter than this share of the horizon have no room for an arrow


def timeline(
    answer,
    chosen: Sequence[int] = (0,),
    replay=None,
    to=None,
    *,
    names: Sequence[str] | None = None,
):
    """Clearance of chosen samples over time, above the runs of separating directions of their
    certificates.

    chosen: m numbers of samples, one column each. replay: Replay of the samples, adds the true
    clearance. names: of the obstacles. to: as in `style.sheet`; 2 m Axes, clearances first. Raises
    InputError.
    """
    n_o, model = len(answer.problem.obstacles), answer.model
    if not n_o or not len(chosen) or not all(0 <= i < len(answer.samples) for i in chosen):
        raise InputError(
            f"timeline: expected obstacles and numbers of samples below {len(answer.samples)}."
        )
    names = [f"obstacle {o}" for o in range(n_o)] if names is None else names
    edges = np.arange(model.time.n_steps + 1) * model.time.dt
    ratios = [2.6, 0.5 + 0.4 * n_o]
    with style.sheet(
        to, (4.6 * len(chosen) + 0.4, 2.6 + 0.45 * n_o), 2, len(chosen), height_ratios=ratios
    ) as sheet:
        for column, i in enumerate(chosen):
            above, below = sheet.axes[column], sheet.axes[len(chosen) + column]
            below.set_xlim(0, model.time.t_f)
            for o, gap in enumerate(clearances(answer, answer.samples[i])):
                above.stairs(gap, edges, baseline=None, **style.line(o), label=f"{names[o]}: tube")
            if replay is not None:
                _true(above, answer, replay.path[i], names)
            for o, runs in enumerate(direction_runs(answer, answer.sample_parts[i]["sep"])):
                _runs(below, n_o - 1 - o, runs, model.time.dt, style.line(o)["color"])
            _dress(above, below, answer, i, names, model.time.t_f)
        if sheet.out is sheet.figure:
            style.legend(sheet.figure, sheet.axes[0].get_legend_handles_labels()[0], 4)
        else:
            sheet.axes[0].legend(loc="upper right")
    return sheet.out


def clearances(answer, plan: np.ndarray) -> np.ndarray:
    """Gap (o, T) [m] of a plan (n_p + n_k,) from every obstacle grown by body and tube; NaN while
    it does not exist.
    """
    model, grown = answer.model, answer.scene.obstacles
    path, _, error = (part[0] for part in predicted(model, plan[None]))
    gaps = []
    for o in range(len(answer.problem.obstacles)):
        corners = grown.corner[o] + grown.sign[o] * error[:, None]
        with x64():
            gap = np.asarray(_gaps(path[:-1], path[1:], corners, grown.radius)[0])
        gaps.append(np.where(grown.active[o], gap, np.nan))
    return np.array(gaps)


def direction_runs(answer, sep) -> list[list[tuple[int, int, np.ndarray]]]:
    """Per obstacle the runs (first, end, unit direction (2,)) of one certificate's separations."""
    out = []
    for o, (obstacle, runs) in enumerate(zip(answer.problem.obstacles, sep, strict=True)):
        span = answer.problem.all_spans[o]
        first, mine = 0 if span is None else span[0], []
        for end, multipliers in runs:
            w = sum(float(number(value)) * obstacle.A[row] for row, value in multipliers)
            mine.append((first, end, w / np.linalg.norm(w)))
            first = end
        out.append(mine)
    return out


_gaps = jax.jit(separations)


def _true(ax, answer, path: np.ndarray, names) -> None:
    """Clearance of one recorded run from the obstacles grown by the body alone."""
    time, grown = answer.model.time, answer.scene.obstacles
    seconds = (np.arange(time.n_record) + 0.5) * time.dt_record
    for o in range(len(answer.problem.obstacles)):
        corners = np.broadcast_to(grown.corner[o], (time.n_record, *grown.corner[o].shape))
        with x64():
            gap = np.asarray(_gaps(path[:-1], path[1:], corners, grown.radius)[0])
        gap = np.where(grown.active[o].repeat(time.stride), gap, np.nan)
        ax.plot(
            seconds,
            gap,
            color=style.line(o)["color"],
            linewidth=0.8,
            alpha=0.8,
            label=f"{names[o]}: true run",
        )


def _runs(ax, level: int, runs, dt: float, color: str) -> None:
    for i, (first, end, w) in enumerate(runs):
        shade = 0.3 if i % 2 == 0 else 0.14
        ax.barh(
            level,
            (end - first) * dt,
            left=first * dt,
            height=0.8,
            color=color,
            alpha=shade,
            linewidth=0,
        )
        if (end - first) * dt < SHORT * ax.get_xlim()[1]:
            continue
        ax.quiver(
            0.5 * (first + end) * dt,
            level,
            w[0],
            w[1],
            angles="uv",
            scale_units="height",
            scale=4.5,
            pivot="mid",
            width=0.006,
            color=color,
        )


def _dress(above, below, answer, i: int, names, t_f: float) -> None:
    p0, k = answer.samples[i, : answer.model.n_p], answer.samples[i, answer.model.n_p :]
    above.set_title(f"sample {i}: p0 = ({_few(p0)}), k = ({_few(k)})")
    above.set_yscale("log")
    above.yaxis.set_major_formatter("{x:g}")
    above.set_ylabel("clearance [m]")
    above.grid(True, axis="y")
    above.set_xticklabels([])
    below.set_yticks(range(len(names)), list(names)[::-1])
    below.set_ylim(-0.6, len(names) - 0.4)
    below.set_xlabel("time [s]; arrows: separating direction")
    above.set_xlim(0, t_f)


def _few(values) -> str:
    return ", ".join(f"{v:.3g}" for v in values)
