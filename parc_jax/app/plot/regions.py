"""The regions of a network over K, coloured by verdict."""

from collections.abc import Sequence

import numpy as np

from parc_jax.app.plot import shapes, style
from parc_jax.common.errors import InputError
from parc_jax.common.lp.program import LPStatus
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.vertices import chebyshev_center
from parc_jax.common.spelling import counted
from parc_jax.common.status import OfRegion
from parc_jax.proof.regions.table import RegionTable

COLORS = ("#8CC8EC", style.ORANGE, "#D9D9D9")  # as OfRegion
EDGES = {"edgecolors": "white", "linewidths": 0.35}


def regions(
    table: RegionTable,
    verdict,
    to=None,
    *,
    names: Sequence[str] | None = None,
    axes=(0, 1),
    at=None,
    safe_k=None,
):
    """Regions coloured by verdict.

    table: RegionTable over a box. verdict: (r,) from `region_verdicts`. names: labels with units of
    the coordinates of k. axes: the two coordinates shown. at: (n_k,) where the other coordinates
    are cut, None = the middle of K. safe_k: (m, n_k) safe parameters shown as dots where n_k = 2.
    to: as in `style.sheet`, one Axes. Raises InputError.
    """
    verdict = np.asarray(verdict)
    if verdict.shape != (table.count,):
        raise InputError(f"regions: expected one verdict per region ({table.count}).")
    shown, outlines = slices(table, axes, at)
    dots = safe_k is not None and table.net.n_in == 2
    with style.sheet(to, (4.6, 4.2)) as sheet:
        (ax,) = sheet.axes
        style.areas(ax, outlines, facecolors=[COLORS[v] for v in verdict[shown]], **EDGES)
        if dots:
            ax.scatter(*np.asarray(safe_k)[:, axes].T, s=4, color=style.BLACK, linewidth=0)
        ax.set_title(_title(table, shown, names, axes, at))
        style.limits(ax, table.domain.lo[list(axes)], table.domain.hi[list(axes)])
        ax.set_xlabel(_name(names, axes[0]))
        ax.set_ylabel(_name(names, axes[1]))
        handles = _handles(verdict, dots)
        style.explain(sheet, handles, 2, "upper left")
    return sheet.out


def slices(table: RegionTable, axes=(0, 1), at=None) -> tuple[np.ndarray, list[np.ndarray]]:
    """Numbers (m,) and outlines (v, 2) of the regions that meet the plane through `at` along two
    axes of k.
    """
    if not isinstance(table.domain, Box):
        raise InputError("regions: expected regions over a box K; these are over another polytope.")
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
        ball = chebyshev_center(cut)
        if ball.status is LPStatus.FEASIBLE and ball.radius > 1e-9:
            numbers.append(i)
            outlines.append(shapes.shadow(cut))
    return np.array(numbers, int), outlines


def _name(names: Sequence[str] | None, axis: int) -> str:
    return f"k{axis}" if names is None else names[axis]


def _title(table, shown, names, axes, at) -> str:
    if table.net.n_in == 2:
        return counted(table.count, "region")
    at = table.domain.center if at is None else at
    others = [i for i in range(len(at)) if i not in axes]
    fixed = ", ".join(f"{_name(names, i)} = {at[i]:.3g}" for i in others)
    return f"{len(shown)} of {counted(table.count, 'region')}, cut at {fixed}"


def _handles(verdict, dots: bool) -> list:
    entries = [
        style.patch(f"{of.text} ({int((verdict == of).sum())})", facecolor=color)
        for of, color in zip(OfRegion, COLORS, strict=True)
    ]
    if dots:
        entries.append(style.mark("sample", color=style.BLACK, marker=".", linestyle="none"))
    return entries
