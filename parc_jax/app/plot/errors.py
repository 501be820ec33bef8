"""The tube of a model over time, assumed beside claimed."""

from textwrap import fill

import numpy as np

from parc_jax.app.plot import style
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.system import TimeGrid

LETTERS = 48  # of a line of a title above one of two panels


def errors(claim: ErrorClaim, assumed: ErrorClaim, to=None):
    """Half width of the tube over time, the widest axis of all reference points: median over K, and
    widest bin.

    claim: of the model, right. assumed: published kind of bound, the largest error over the
    training data, left, of the same robot. to: as in `style.sheet`; two Axes. Raises InputError.
    """
    claim.subject.agree("errors: claim and assumed", assumed.subject)
    if assumed.kind != "assumed":
        raise InputError(f"errors: expected an `assumed_claim` second; got {assumed!r}.")
    time = claim.subject.time
    with style.sheet(to, (8.4, 3.5), columns=2, sharey=True) as sheet:
        left, right = sheet.axes
        for ax, one in ((left, assumed), (right, claim)):
            _tube(ax, one, time)
            ax.set_yscale("log")
            ax.yaxis.set_major_formatter("{x:g}")
            ax.grid(True, axis="y")
            ax.set_xlim(0, time.t_f)
            ax.set_xlabel("time [s]")
        left.set_ylabel("half width of the tube [m]")
        left.set_title("assumed: largest error over training runs")
        right.set_title(fill(f"claimed: {in_short(claim)}", LETTERS))
        if max(one.tube.n_bins for one in (assumed, claim)) > 1:
            line = style.line(0)
            handles = [
                style.mark("median over bins with a claim", **line, linewidth=1.7),
                style.mark("widest of them", **line, linewidth=0.7),
            ]
            style.explain(sheet, handles, 2)
    return sheet.out


def _tube(ax, claim: ErrorClaim, time: TimeGrid) -> None:
    """Half widths (b, T) [m] of the bins with a claim: the widest, and the median by volume."""
    tube = claim.tube
    used = np.flatnonzero(tube.claimed)
    if not len(used):
        return
    values = tube.interval[used].max(axis=2)
    volume = np.array([np.prod(hi - lo) for lo, hi in map(tube.bin_box, used.tolist())])
    order = np.argsort(values, axis=0)
    half = np.cumsum(volume[order], axis=0) >= (0.5 - 1e-12) * volume.sum()
    ordered = np.take_along_axis(values, order, axis=0)
    median = np.take_along_axis(ordered, half.argmax(axis=0)[None], axis=0)[0]
    edges = np.arange(time.n_steps + 1) * time.dt
    looks = {"baseline": None, **style.line(0)}
    if len(values) > 1:
        ax.stairs(values.max(axis=0), edges, **looks, linewidth=0.7)
    ax.stairs(median, edges, **looks, linewidth=1.7)
