"""The regions of a network over K, coloured by whether they hold safe plans."""

from contextlib import suppress
from textwrap import fill

import jax
import numpy as np

from parc_jax.app.plot import shapes, style
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import counted, hex_text
from parc_jax.proof.regions.table import RegionTable
from parc_jax.statement import told_under

COLORS = "#8CC8EC", style.ORANGE  # with a safe plan that was found, and without
EDGES = {"edgecolors": "white", "linewidths": 0.35}
LETTERS = 48  # of a line of the title
DRAWN = 2048  # plans of the corridors, which tell where it is safe


def safe_regions(answer, table: RegionTable) -> np.ndarray:
    """Which regions (r,) of a table of the answer's network hold a safe plan that was found: a
    returned sample, the plan of a corridor, or one drawn from all. Raises InputError.
    """
    model = answer.model
    own, other = (
        [one.net.hash, hex_text([one.domain.lo, one.domain.hi])] for one in (model, table)
    )
    if own != other:
        raise InputError("regions: expected those of the answer's network over its K; got others.")
    plans_k = [*answer.samples[:, model.n_p :], *(c.k for c in answer.corridors)]
    if answer.corridors:
        with suppress(InputError):  # too small a set for draws: the plans of the corridors remain
            plans_k += [*answer.sample(jax.random.PRNGKey(0), DRAWN)[:, model.n_p :]]
    with_plan = table.locate(np.reshape(plans_k, (len(plans_k), model.n_k)))
    return np.isin(np.arange(table.count), with_plan)


def regions(answer, table: RegionTable, to=None, *, axes=(0, 1), at=None):
    """Regions coloured by whether they hold a safe plan of an answer, with its samples as dots
    where n_k = 2.

    answer: Answer. table: regions of its network, over a box. axes: the two coordinates shown. at:
    (n_k,) where the other coordinates are cut, None = the middle of K. to: as in `style.sheet`, one
    Axes. Raises InputError.
    """
    safe, names = safe_regions(answer, table), answer.model.labels.k
    safe_k = answer.samples[:, answer.model.n_p :]
    shown, outlines = slices(table, axes, at)
    dots = len(safe_k) > 0 and table.net.n_in == 2
    with style.sheet(to, (4.6, 4.2)) as sheet:
        (ax,) = sheet.axes
        style.areas(ax, outlines, facecolors=np.where(safe[shown], *COLORS), **EDGES)
        if dots:
            ax.scatter(*safe_k[:, axes].T, s=4, color=style.BLACK, linewidth=0)
        title, at = counted(table.count, "region"), table.domain.center if at is None else at
        others = [f"{names[i]} = {v:.3g}" for i, v in enumerate(at) if i not in axes]
        title = f"{len(shown)} of {title}, cut at {', '.join(others)}" if others else title
        ax.set_title(fill(f"{title}{told_under(answer.scene)}", LETTERS), wrap=True)
        style.limits(ax, table.domain.lo[list(axes)], table.domain.hi[list(axes)])
        ax.set_xlabel(names[axes[0]])
        ax.set_ylabel(names[axes[1]])
        counts = {"a": safe.sum(), "no": (~safe).sum()}
        entries = [
            style.patch(f"{some} safe plan found ({count})", facecolor=color)
            for color, (some, count) in zip(COLORS, counts.items(), strict=True)
        ]
        mark = style.mark("sample", color=style.BLACK, marker=".", linestyle="none")
        style.explain(sheet, entries + [mark] * dots, 2, "upper left")
    return sheet.out


def slices(table: RegionTable, axes=(0, 1), at=None) -> tuple[np.ndarray, list[np.ndarray]]:
    """Numbers (m,), outlines (v, 2) of regions on the plane through `at` along two axes of k."""
    if table.net.n_in == 2:
        every = np.arange(table.count)
        return every, [table.region_vertices(i)[:, list(axes)] for i in every]
    at = table.domain.center if at is None else np.asarray(at, float)
    others = [i for i in range(table.net.n_in) if i not in axes]
    numbers, outlines = [], []
    for i in range(table.count):
        corners = table.region_vertices(i)[:, others]
        if (corners.min(axis=0) > at[others]).any() or (corners.max(axis=0) < at[others]).any():
            continue
        region = table.region(i)
        cut = HPolytope(region.A[:, list(axes)], region.b - region.A[:, others] @ at[others])
        length = np.linalg.norm(cut.A, axis=1)
        cut = HPolytope(cut.A[length > 1e-12], cut.b[length > 1e-12])
        if len(outline := shapes.corners_of(cut)) > 2:
            numbers.append(i)
            outlines.append(outline)
    return np.array(numbers, int), outlines
