"""One plan over time: how far it stays from every obstacle, and the directions that prove it."""

from collections.abc import Sequence

import jax
import numpy as np

from parc_jax.app.plot import style
from parc_jax.app.plot.shapes import predicted
from parc_jax.checker import number
from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.safe_set.verdict.scene import unpruned_scene

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
    certificates, one row for every obstacle and part of the body.

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
    n = len(answer.problem.parts)
    parts = [""] if n == 1 else [f", part {part}" for part in range(n)]  # of the body
    rows = [f"{name}{part}" for name in names for part in parts]
    ratios = [2.6, 0.5 + 0.4 * len(rows)]
    size = 4.6 * len(chosen) + 0.4, 2.6 + 0.45 * len(rows)
    with style.sheet(to, size, 2, len(chosen), height_ratios=ratios) as sheet:
        for column, i in enumerate(chosen):
            above, below = sheet.axes[column], sheet.axes[len(chosen) + column]
            below.set_xlim(0, model.time.t_f)
            for o, gap in enumerate(clearances(answer, answer.samples[i])):
                above.stairs(gap, edges, baseline=None, **style.line(o), label=f"{names[o]}: tube")
            if replay is not None:
                _true(above, answer, replay.path[i], names)
            for row, runs in enumerate(direction_runs(answer, answer.certificates[i]["sep"])):
                color = style.line(row // len(parts))["color"]
                _runs(below, len(rows) - 1 - row, runs, model.time.dt, color)
            _dress(above, below, answer, i, rows, model.time.t_f)
        handles = sheet.axes[0].get_legend_handles_labels()[0]
        style.explain(sheet, handles, 4, "upper right")
    return sheet.out


def clearances(answer, plan: np.ndarray) -> np.ndarray:
    """Gap (o, T) [m] of a plan (n_p + n_k,) from every obstacle, of body and tube, the least over
    the parts of the body; NaN while the obstacle does not exist.
    """
    model = answer.model
    path = predicted(model, plan[None]).path[0]
    bins = model.tube.bins_of(plan[None, model.n_p :])[0]
    return np.min([_clearances(answer, path, model.tube.during(b)) for b in bins], axis=0)


def direction_runs(answer, sep) -> list[list[tuple[int, int, np.ndarray]]]:
    """Per obstacle and part the runs (first, end, unit direction (n_p,)) of one certificate's
    separations.
    """
    out = []
    for o, (obstacle, parts) in enumerate(zip(answer.problem.obstacles, sep, strict=True)):
        span = answer.problem.all_spans[o]
        for runs in parts:
            first, directions = 0 if span is None else span[0], []
            for end, multipliers in runs:
                w = sum(float(number(value)) * obstacle.A[row] for row, value in multipliers)
                directions.append((first, end, w / np.linalg.norm(w)))
                first = end
            out.append(directions)
    return out


_gaps = jax.jit(lambda obstacles, path, errors: obstacles.gaps(path, errors)[0])


def _clearances(answer, path: np.ndarray, errors) -> np.ndarray:
    """Gap (o, t) [m] of a path (t + 1, n_c) with errors (t, n_points) from every obstacle, the
    least over the parts; NaN while the obstacle does not exist.
    """
    obstacles = unpruned_scene(answer.scene).obstacles
    n_parts = len(answer.problem.parts)
    n = len(answer.problem.obstacles)
    with x64():
        gaps = np.asarray(_gaps(obstacles, path, errors))
    stride = (len(path) - 1) // obstacles.active.shape[1]
    gaps = np.where(obstacles.active.repeat(stride, axis=1), gaps, np.nan)
    return gaps[: n * n_parts].reshape(n, n_parts, -1).min(axis=1)


def _true(ax, answer, path: np.ndarray, names) -> None:
    """Clearance of one recorded run (n_record + 1, n_c), of the body alone."""
    time, model = answer.model.time, answer.model
    seconds = (np.arange(time.n_record) + 0.5) * time.dt_record
    still = ErrorBox(np.zeros((time.n_record, model.n_points, model.n_p)))
    for o, gap in enumerate(_clearances(answer, path, still)):
        looks = {"color": style.line(o)["color"], "linewidth": 0.8, "alpha": 0.8}
        ax.plot(seconds, gap, **looks, label=f"{names[o]}: true run")


def _runs(ax, level: int, runs, dt: float, color: str) -> None:
    for i, (first, end, w) in enumerate(runs):
        shade = 0.3 if i % 2 == 0 else 0.14
        begin, lasts = first * dt, (end - first) * dt
        looks = {"height": 0.8, "color": color, "alpha": shade, "linewidth": 0}
        ax.barh(level, lasts, left=begin, **looks)
        if lasts < SHORT * ax.get_xlim()[1]:
            continue
        looks = {"angles": "uv", "scale_units": "height", "scale": 4.5, "pivot": "mid"}
        ax.quiver(0.5 * (first + end) * dt, level, *w[:2], **looks, width=0.006, color=color)


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
    view = "" if answer.model.n_p == 2 else ", from above"
    below.set_xlabel(f"time [s]; arrows: separating direction{view}")
    above.set_xlim(0, t_f)


def _few(values) -> str:
    return ", ".join(f"{v:.3g}" for v in values)
