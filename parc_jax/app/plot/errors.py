"""The tubes of several models over time, assumed beside claimed."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot import style
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.system import TimeGrid


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
        claims = [e.claimed for e in entries if e.claimed is not None]
        sheet.axes[1].set_title(f"claimed: {_terms(claims)}")
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
    ordered = np.take_along_axis(values, order, axis=0)
    return np.take_along_axis(ordered, reached.argmax(axis=0)[None], axis=0)[0]


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
