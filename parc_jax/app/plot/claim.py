"""One claim about the error: the tube over time, the largest scores over K, and where the worst
runs live.
"""

from collections.abc import Sequence

import numpy as np

from parc_jax.app.plot import style
from parc_jax.app.plot.errors import quantile, widths
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.measure import Scores
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.system import TimeGrid

WORST = 100  # runs shown as the worst
RUNS_PER_CELL = 16  # of the map of largest scores, on average


def claim(
    claimed: ErrorClaim,
    scores: Scores,
    time: TimeGrid,
    to=None,
    *,
    names: Sequence[str] | None = None,
    axes=(0, 1),
):
    """Picture of a claim and of the holdout runs behind it.

    claimed: the claim. scores: of n runs against its profile. time: the model's grid. names: labels
    with units of the coordinates of k. axes: the two coordinates of k shown. to: as in
    `style.sheet`; three Axes. Raises InputError.
    """
    if scores.k.shape[1] < 2:
        raise InputError(
            "claim: expected at least two parameters k to show K in the plane; got "
            f"{scores.k.shape[1]}."
        )
    with style.sheet(to, (10.5, 3.4), columns=3) as sheet:
        _tube(sheet.axes[0], claimed, time)
        k = scores.k[:, list(axes)]
        _largest(sheet, k, scores.score)
        _worst(sheet, k, scores, time, claimed.tube.n_c)
        for ax in sheet.axes[1:]:
            style.limits(ax, k.min(axis=0), k.max(axis=0))
            ax.set_xlabel(style.name_axis(names, axes[0], "k"))
            ax.set_ylabel(style.name_axis(names, axes[1], "k"))
    return sheet.out


def when(scores: Scores, n_steps: int, n_c: int) -> np.ndarray:
    """Model interval (n,) in which each run was worst; n_steps when that was in the final state.
    n_c: columns of the tube.
    """
    return np.minimum(scores.worst // n_c, n_steps)


def _tube(ax, claimed: ErrorClaim, time: TimeGrid) -> None:
    tube = claimed.tube
    used = np.flatnonzero(tube.claimed)
    _, share = widths(claimed)
    edges = np.arange(time.n_steps + 1) * time.dt
    for axis in range(tube.n_p if len(used) else 0):
        of_points = tube.interval[used].reshape(len(used), tube.n_steps, tube.n_points, tube.n_p)
        values = of_points[..., axis].max(axis=2)
        name = "xyz"[axis] + ("" if tube.n_points == 1 else " of the widest point")
        middle = quantile(values, share, 0.5)
        looks = {"baseline": None, **style.line(axis)}
        ax.stairs(middle, edges, **looks, linewidth=1.7, label=f"{name}, median over K")
        if len(used) > 1:
            widest = values.max(axis=0)
            ax.stairs(widest, edges, **looks, linewidth=0.7, label=f"{name}, widest bin")
    if any(claimed.intersample):
        ax.axhline(
            max(claimed.intersample), color=style.GREY, linewidth=0.7, label="part between records"
        )
    ax.set_xlim(0, time.t_f)
    ax.set_ylim(0, 1.35 * ax.get_ylim()[1])  # room for the legend
    ax.grid(True, axis="y")
    ax.set_xlabel("time [s]")
    ax.set_ylabel("half width of the tube [m]")
    if len(used):
        ax.legend(loc="upper left", ncols=2, handlelength=1.4)
    left_out = tube.n_bins - len(used)
    behind = f"tube of {claimed.n:,} {claimed.unit.many}"
    without = f"; {left_out} bins without" if left_out else ""
    ax.set_title(f"{behind}{without}\n{in_short(claimed)}")


def _largest(sheet, k, score) -> None:
    ax, finite = sheet.axes[1], np.isfinite(score)
    across = int(np.clip(np.sqrt(finite.sum() / RUNS_PER_CELL), 4, 48))
    cells = ax.hexbin(
        *k[finite].T,
        C=score[finite],
        reduce_C_function=np.max,
        gridsize=across,
        cmap=style.SEQUENTIAL,
        linewidths=0.2,
        rasterized=True,
    )
    sheet.figure.colorbar(
        cells, ax=ax, label="largest score [widths of the profile]", pad=0.02, aspect=30
    )
    ax.set_title("largest scores over K")
    if not finite.all():
        ax.scatter(
            *k[~finite].T, s=14, marker="x", color=style.RED, linewidth=1.0, label="failed run"
        )
        ax.legend(loc="upper right", frameon=True)


def _worst(sheet, k, scores: Scores, time: TimeGrid, n_c: int) -> None:
    ax = sheet.axes[2]
    top = np.argsort(scores.score)[-min(WORST, scores.n) :]
    seconds = when(scores, time.n_steps, n_c)[top] * time.dt
    ax.scatter(*k[scores.score < np.inf].T, s=1, color="#D9D9D9", linewidth=0, rasterized=True)
    dots = ax.scatter(
        *k[top].T,
        c=seconds,
        s=18,
        cmap=style.SEQUENTIAL,
        vmin=0,
        vmax=time.t_f,
        edgecolor=style.BLACK,
        linewidth=0.3,
    )
    ax.scatter(*k[top[-1]], s=70, facecolor="none", edgecolor=style.RED, linewidth=1.2)
    sheet.figure.colorbar(dots, ax=ax, label="when they were worst [s]", pad=0.02, aspect=30)
    ax.set_title(f"the {len(top)} worst runs (ring: the worst, {scores.score[top[-1]]:.2f})")
