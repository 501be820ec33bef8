"""The regions of a network over K, and their verdicts, by which they are coloured."""

from contextlib import suppress
from textwrap import fill

import jax
import numpy as np

from parc_jax.app.plot import shapes, style
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import gamma, row_bounds
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import counted, hex_text
from parc_jax.common.status import OfRegion
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.proof.regions.table import RegionTable
from parc_jax.statement import told_under

COLORS = ("#8CC8EC", style.ORANGE, "#D9D9D9")  # as OfRegion
EDGES = {"edgecolors": "white", "linewidths": 0.35}
LETTERS, IN_LEGEND = 48, 36  # of a line of the title, and of the legend
DRAWN = 2048  # plans of the corridors, which tell where it is safe


def region_verdicts(answer, table: RegionTable) -> np.ndarray:
    """Verdict (r,) of each region of a table of the answer's network, as `OfRegion`.

    SAFE: a returned sample lies in it, the plan of a corridor, or one drawn from all. UNREACHABLE:
    a side of the shrunken goal is proved to be missed by all of the region, which is tried for
    robots of one reference point only. NOT_FOUND: neither. Raises InputError.
    """
    model = answer.model
    own, other = (
        [one.net.hash, hex_text([one.domain.lo, one.domain.hi])] for one in (model, table)
    )
    if own != other:
        raise InputError("regions: expected those of the answer's network over its K; got others.")
    verdict = np.full(table.count, int(OfRegion.NOT_FOUND))
    plans_k = [*answer.samples[:, model.n_p :], *(c.k for c in answer.corridors)]
    if answer.corridors:
        with suppress(InputError):  # too small a set for draws: the plans of the corridors remain
            plans_k += [*answer.sample(jax.random.PRNGKey(0), DRAWN)[:, model.n_p :]]
    with_plan = table.locate(np.reshape(plans_k, (len(plans_k), model.n_k)))
    verdict[with_plan[with_plan >= 0]] = OfRegion.SAFE
    if model.n_points == 1:
        left = np.flatnonzero(verdict != OfRegion.SAFE)
        missed = [i for i in left if _misses_goal(answer.problem, model, table, int(i))]
        verdict[missed] = OfRegion.UNREACHABLE
    return verdict


def _misses_goal(problem, model, table: RegionTable, region: int) -> bool:
    """Do all ends of a region lie beyond one row of the goal, less the errors of every bin that
    the region meets? Its ends are the hull of those of its vertices, for its map is affine.
    """
    goal, tube = problem.goal, model.tube
    corners, slip = table.region_vertices(region), table.point_error.max(axis=0)
    boxes = [tube.bin_box(i) for i in range(tube.n_bins)]
    low, high = corners.min(axis=0) - slip, corners.max(axis=0) + slip
    met = [i for i, (lo, hi) in enumerate(boxes) if (lo <= high).all() and (hi >= low).all()]
    if not tube.claimed[met].all():
        return False
    size = np.abs(goal.A)
    # of the errors as the verdict has them: faces may lie to one side of the model
    lost = np.array([tube.support_at_end(goal.A, i) for i in met])
    allowed = (goal.b - lost).max(axis=0)
    C, d = (part[0][-goal.n :] for part in table.maps(slice(region, region + 1)))
    ends = corners @ C.T + d
    start, part = problem.start, goal.A[:, : model.n_p]
    lo, hi = (-np.inf, np.inf) if start is None else row_bounds(start.A, start.b)
    at = (part * np.where(part > 0, lo, np.where(part < 0, hi, 0.0))).sum(axis=1)
    # vertices are floats, and all this is rounded
    reach = np.abs(C) @ np.maximum(np.abs(low), np.abs(high)) + np.abs(d)
    rounding = gamma(4 * goal.n + 2 * model.n_k + 8) * (size @ reach + np.abs(goal.b) + np.abs(at))
    slack = 2 * size @ (np.abs(C) @ slip) + rounding + TOLERANCES.lp_margin
    return bool(((ends @ goal.A.T).min(axis=0) + at > allowed + slack).any())


def regions(answer, table: RegionTable, to=None, *, axes=(0, 1), at=None):
    """Regions coloured by their verdict in an answer, with its samples as dots where n_k = 2.

    answer: Answer. table: regions of its network, over a box. axes: the two coordinates shown. at:
    (n_k,) where the other coordinates are cut, None = the middle of K. to: as in `style.sheet`, one
    Axes. Raises InputError.
    """
    verdict, names = region_verdicts(answer, table), answer.model.labels.k
    safe_k = answer.samples[:, answer.model.n_p :]
    doubt = answer.scene.nominal.uncertainty is not None
    shown, outlines = slices(table, axes, at)
    dots = len(safe_k) > 0 and table.net.n_in == 2
    with style.sheet(to, (4.6, 4.2)) as sheet:
        (ax,) = sheet.axes
        style.areas(ax, outlines, facecolors=[COLORS[v] for v in verdict[shown]], **EDGES)
        if dots:
            ax.scatter(*safe_k[:, axes].T, s=4, color=style.BLACK, linewidth=0)
        title, at = counted(table.count, "region"), table.domain.center if at is None else at
        others = [f"{names[i]} = {v:.3g}" for i, v in enumerate(at) if i not in axes]
        title = f"{len(shown)} of {title}, cut at {', '.join(others)}" if others else title
        ax.set_title(fill(f"{title}{told_under(answer)}", LETTERS))
        style.limits(ax, table.domain.lo[list(axes)], table.domain.hi[list(axes)])
        ax.set_xlabel(names[axes[0]])
        ax.set_ylabel(names[axes[1]])
        words = [f"{of.text(doubt)} ({int((verdict == of).sum())})" for of in OfRegion]
        entries = [
            style.patch(fill(text, IN_LEGEND), facecolor=color)
            for text, color in zip(words, COLORS, strict=True)
        ]
        mark = style.mark("sample", color=style.BLACK, marker=".", linestyle="none")
        style.explain(sheet, entries + [mark] * dots, 2, "upper left")
    return sheet.out


def slices(table: RegionTable, axes=(0, 1), at=None) -> tuple[np.ndarray, list[np.ndarray]]:
    """Numbers (m,), outlines (v, 2) of regions on the plane through `at` along two axes of k."""
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
        if len(outline := shapes.corners_of(cut)) > 2:
            numbers.append(i)
            outlines.append(outline)
    return np.array(numbers, int), outlines
