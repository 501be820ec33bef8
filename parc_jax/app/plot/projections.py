"""Projections of the safe polytopes onto pairs of coordinates."""

from collections.abc import Sequence
from itertools import combinations

import jax
import numpy as np

from parc_jax.app.plot import shapes, style
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import counted

COLUMNS = 3
FILL, OUTLINE = "#BBDDF2", 0.8  # colour, width [points] of the line around the union
SPREAD_OUT = 6  # dimensions of (p0, k) up to which polytopes are cut for a picture
MANY = 300  # polytopes: the edges of more of them hide each other


def projections(
    answer,
    polytopes=None,
    pairs: Sequence[tuple[int, int]] | None = None,
    to=None,
    *,
    names: Sequence[str] | None = None,
):
    """Projections of the safe polytopes onto pairs of coordinates of (p0, k), with the samples as
    dots.

    polytopes: of `answer.polytopes`; None cuts them, up to SPREAD_OUT dimensions of (p0, k). pairs:
    coordinates shown, None = starts, then parameters, then starts against parameters, six at
    most. names: labels with units of all coordinates of (p0, k), None = the model's. More than MANY
    polytopes are drawn as their union, with its outline. to: as in `style.sheet`, one Axes
    per pair. Raises InputError.
    """
    polytopes = _cut(answer) if polytopes is None else polytopes
    if not len(polytopes):
        raise InputError("projections: expected an answer with safe polytopes; this one has none.")
    if pairs is None:
        n_p = answer.model.n_p
        pairs = default_pairs(n_p, answer.model.n_k, answer.scene.at is not None)
        if not pairs:
            raise InputError("projections: expected at least two coordinates that plans differ in.")
    else:
        pairs = list(pairs)
    names = answer.model.labels.plan if names is None else names
    columns = min(COLUMNS, len(pairs))
    rows = -(-len(pairs) // columns)
    if rows * columns != len(pairs):
        raise InputError(
            f"projections: expected a number of pairs that fills rows of {columns}; got "
            f"{len(pairs)}."
        )
    with style.sheet(to, (3.3 * columns, 3.0 * rows), rows, columns) as sheet:
        for ax, pair in zip(sheet.axes, pairs, strict=True):
            _one(ax, answer, polytopes, pair, names)
        if sheet.out is sheet.figure:
            covered = f"{100 * polytopes.coverage.share:.1f} % of the model's safe set"
            title = f"{counted(len(polytopes), 'safe polytope')}, {covered}"
            sheet.figure.suptitle(title, x=0.01, ha="left", fontsize=9.5)
            style.legend(sheet.figure, _handles(len(polytopes) > MANY), 2)
    return sheet.out


def default_pairs(n_p: int, n_k: int, from_here: bool = False) -> list[tuple[int, int]]:
    """Starts, parameters, then mixed pairs: as many as fill rows, six at most. from_here:
    there is one start, and only parameters are shown.
    """
    first = list(combinations(range(n_p), 2))
    inner = [(n_p + i, n_p + j) for i, j in combinations(range(n_k), 2)]
    mixed = [(n_p + i, j) for i in range(n_k) for j in range(n_p)]
    pairs = inner[:6] if from_here else (first + inner + mixed)[:6]
    return pairs if len(pairs) < COLUMNS else pairs[: len(pairs) // COLUMNS * COLUMNS]


def _cut(answer):
    n = answer.model.n_k + (answer.model.n_p if answer.scene.at is None else 0)
    if n > SPREAD_OUT:
        raise InputError(
            f"projections: expected at most {SPREAD_OUT} dimensions of (p0, k); this answer has "
            f"{n}, whose polytopes may take minutes. Pass `answer.polytopes(key)`."
        )
    return answer.polytopes(jax.random.PRNGKey(0))


def _one(ax, answer, polytopes, pair, names) -> None:
    outlines = [shapes.hull(points) for points in polytopes.project(pair)]
    if len(outlines) > MANY:
        _union(ax, outlines)
    else:
        edges = {"facecolors": "none", "edgecolors": style.BLUE, "linewidths": 0.4, "alpha": 0.35}
        style.areas(ax, outlines, facecolors=FILL, edgecolors="none")
        style.areas(ax, outlines, **edges)
    ax.scatter(*answer.samples[:, list(pair)].T, s=5, color=style.BLACK, linewidth=0, zorder=3)
    corners = np.concatenate(outlines)
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    room = 0.04 * np.maximum(hi - lo, 1e-9)
    style.limits(ax, lo - room, hi + room)
    for axis, put in zip(pair, (ax.set_xlabel, ax.set_ylabel), strict=True):
        put(names[axis])
    if max(pair) < answer.model.n_p:
        ax.set_aspect("equal")


def _union(ax, outlines) -> None:
    """Many polygons as one area: fills cover the strokes inside the union, so that only
    those along its border remain.
    """
    stroke = {"facecolors": style.BLUE, "edgecolors": style.BLUE, "linewidths": 2 * OUTLINE}
    style.areas(ax, outlines, **stroke, rasterized=True, zorder=1)
    inside = {"facecolors": FILL, "edgecolors": "none"}
    style.areas(ax, outlines, **inside, rasterized=True, zorder=1.1)


def _handles(union: bool) -> list:
    words = "projection of all safe polytopes" if union else "projection of a safe polytope"
    return [
        style.patch(words, facecolor=FILL, edgecolor=style.BLUE),
        style.mark("safe sample", color=style.BLACK, marker=".", linestyle="none"),
    ]
