"""The tubes of several models over time, assumed beside claimed; and one claim: its tube, the
largest scores over K, and the k of the worst runs.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot import style
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.measure import Scores
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.system import TimeGrid

WORST = 100  # runs shown as the worst
RUNS_PER_CELL = 16  # of the map of largest scores, on average


class Entry(NamedTuple):
    """One model of the comparison. name: as in the legend. assumed, claimed: claims about it;
    either may be None.
    """

    name: str
    assumed: ErrorClaim | None
    claimed: ErrorClaim | None


def errors(entries: Sequence[Entry], time: TimeGrid, to=None):
    """Half width of the tube over time, the widest axis of all reference points: median over K, and
    widest bin.

    entries: the models in order. time: their common grid. to: as in `style.sheet`; two Axes. Left:
    published kind of bound, the largest error over the training data, which is assumed. Right:
    claims. Raises InputError.
    """
    if not entries or any(e.assumed is None and e.claimed is None for e in entries):
        raise InputError(
            "errors: expected at least one model, each with an assumed or a claimed bound."
        )
    with style.sheet(to, (8.4, 3.5), columns=2, sharey=True) as sheet:
        for side, ax in enumerate(sheet.axes):
            for number, entry in enumerate(entries):
                if entry[1 + side] is not None:
                    _tube(ax, entry[1 + side], time, number)
            ax.set_yscale("log")
            ax.yaxis.set_major_formatter("{x:g}")
            ax.grid(True, axis="y")
            ax.set_xlim(0, time.t_f)
            ax.set_xlabel("time [s]")
        sheet.axes[0].set_ylabel("half width of the tube [m]")
        sheet.axes[0].set_title("assumed: largest error over training runs")
        sheet.axes[1].set_title(
            "claimed: " + _terms([e.claimed for e in entries if e.claimed is not None])
        )
        style.explain(sheet, _handles(entries), min(len(entries) + 2, 6))
    return sheet.out


def widths(claim: ErrorClaim) -> tuple[np.ndarray, np.ndarray]:
    """Half widths (b, T) [m] of the widest axis of all reference points in the bins with a claim,
    and the share (b,) of each in their volume.
    """
    tube = claim.tube
    used = np.flatnonzero(tube.claimed)
    boxes = [tube.bin_box(int(i)) for i in used]
    volume = np.array([np.prod(hi - lo) for lo, hi in boxes])
    return tube.interval[used].max(axis=2), volume / max(volume.sum(), np.finfo(float).tiny)


def quantile(values: np.ndarray, share: np.ndarray, level: float) -> np.ndarray:
    """Weighted quantile over the first axis: smallest value that at least `level` of the weight
    does not exceed.
    """
    order = np.argsort(values, axis=0)
    reached = np.cumsum(share[order], axis=0) >= level - 1e-12
    return np.take_along_axis(
        np.take_along_axis(values, order, axis=0), reached.argmax(axis=0)[None], axis=0
    )[0]


def _tube(ax, claim: ErrorClaim, time: TimeGrid, number: int) -> None:
    values, share = widths(claim)
    if len(values) == 0:
        return
    edges = np.arange(time.n_steps + 1) * time.dt
    looks = {"baseline": None, **style.line(number)}
    if len(values) > 1:
        ax.stairs(values.max(axis=0), edges, **looks, linewidth=0.7)
    ax.stairs(quantile(values, share, 0.5), edges, **looks, linewidth=1.7)


def _terms(claims: Sequence[ErrorClaim]) -> str:
    """The terms of the claims of a panel, where they have the same."""
    terms = list(dict.fromkeys(in_short(c) for c in claims))
    return terms[0] if len(terms) == 1 else "each on terms of its own" if terms else "none"


def _handles(entries: Sequence[Entry]) -> list:
    lines = [style.mark(e.name, **style.line(i), linewidth=1.7) for i, e in enumerate(entries)]
    claims = [c for e in entries for c in e[1:] if c is not None]
    if any(c.tube.n_bins > 1 for c in claims):
        lines += [
            style.mark("median over K", color=style.GREY, linewidth=1.7),
            style.mark("widest bin of K", color=style.GREY, linewidth=0.7),
        ]
    return lines


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
        _claimed_tube(sheet.axes[0], claimed, time)
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


def _claimed_tube(ax, claimed: ErrorClaim, time: TimeGrid) -> None:
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
