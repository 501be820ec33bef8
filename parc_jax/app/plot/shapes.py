"""Outlines of sets in the plane, or of their projections, ready to draw."""

from collections.abc import Sequence

import numpy as np

from parc_jax.app.plot import style
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.qhull import convex_hull
from parc_jax.common.sets.vertices import vertices
from parc_jax.problem.body import Disc, Part, Polygon

GROWN = {"facecolor": "#EBEBEB", "edgecolor": style.GREY, "linestyle": "--"}  # of an obstacle
ARC = 48  # points on the circle of a disc body


def hull(points: np.ndarray) -> np.ndarray:
    """Convex hull (v, 2) of points (n, 2), counter-clockwise; the points themselves where they
    enclose no area.
    """
    points = np.asarray(points, float)
    found = convex_hull(points)
    return points if found is None else points[found.vertices]


def shadow(poly: HPolytope, axes: tuple[int, int] = (0, 1)) -> np.ndarray:
    """Outline (v, 2) of the projection of a bounded polytope onto two of its coordinates.

    Coordinates that no row links to these, directly or over others, are left out: they may have
    any number, and no bounds.
    """
    part, at = linked(poly, axes)
    return hull(vertices(part)[:, at])


def linked(poly: HPolytope, axes: Sequence[int]) -> tuple[HPolytope, list[int]]:
    """The polytope over the coordinates that its rows link to some axes, and where these are among
    them.
    """
    used = poly.A != 0
    mine = np.isin(np.arange(poly.n), axes)
    while True:
        rows = used[:, mine].any(axis=1)
        more = mine | used[rows].any(axis=0)
        if (more == mine).all():
            break
        mine = more
    at = [int(mine[:axis].sum()) for axis in axes]
    return HPolytope(poly.A[np.ix_(rows, mine)], poly.b[rows]), at


def goals(goal: HPolytope, n_p: int, n_points: int, sides: Sequence[tuple[int, int]] = ((0, 1),)):
    """Where the reference points of a robot are to end, seen from some sides (pairs of axes): per
    region that the goal has for any of them the numbers of these points and its outlines (v, 2),
    one from each side. A region that is not bounded is left out.
    """
    found: list[tuple[list[int], list[np.ndarray]]] = []
    for point in range(n_points):
        columns = [tuple(point * n_p + axis for axis in axes) for axes in sides]
        try:
            outlines = [shadow(goal, pair) for pair in columns]
        except InputError:
            continue
        known = [points for points, others in found if all(map(_same, others, outlines))]
        if known:
            known[0].append(point)
        else:
            found.append(([point], outlines))
    return found


def part_outline(part: Part, places: np.ndarray, axes: tuple[int, int] = (0, 1)) -> np.ndarray:
    """Outline (v, 2) of a part of the body, seen along two axes, while its reference points are at
    places (i, n_p).
    """
    if isinstance(part.shape, Disc):
        around = disc(part.shape.radius) if part.shape.radius else np.zeros((1, 2))
    else:
        around = part.shape.vertices[:, list(axes)]
    return hull((places[:, None, list(axes)] + around).reshape(-1, 2))


def grows_obstacles(answer) -> bool:
    """Is the robot one point in the plane, whose obstacles are drawn grown by its body?"""
    return answer.model.n_c == 2 and len(answer.problem.parts) == 1


def grown(obstacle: HPolytope, part: Part) -> np.ndarray:
    """Outline (v, 2) of an obstacle in the plane grown by a part of the body, turned inside out."""
    turned = part.shape if isinstance(part.shape, Disc) else Polygon(-part.shape.vertices)
    return part_outline(part.replace(shape=turned), vertices(obstacle))


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and np.allclose(one, other)


def disc(radius: float) -> np.ndarray:
    """Outline (ARC, 2) of a disc about the origin, drawn just outside it."""
    angle = np.arange(ARC) * 2 * np.pi / ARC
    return radius / np.cos(np.pi / ARC) * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def name_first(points: tuple[str, ...]) -> str:
    """What a legend adds where, of several reference points, only the first is drawn: its name."""
    return "" if len(points) == 1 else f" ({points[0]})"


def footprints(
    parts: Sequence[Part], columns: np.ndarray, n_p: int, axes: tuple[int, int] = (0, 1)
) -> list[np.ndarray]:
    """Outlines (v, 2) of all parts of the body (`numbered`), seen along two axes, at poses (t, m
    n_p): the places of the m reference points.
    """
    poses = columns.reshape(len(columns), -1, n_p)
    return [
        part_outline(part, places[list(part.points)], axes) for places in poses for part in parts
    ]


def body_outline(body) -> np.ndarray:
    """Outline (v, 2) of a Disc or Polygon about its reference point."""
    return hull(body.vertices) if hasattr(body, "vertices") else disc(body.radius)


def placed(outline: np.ndarray, at: np.ndarray, heading: float = 0.0) -> np.ndarray:
    """An outline (v, 2) turned by `heading` [rad] and moved to `at` (2,)."""
    c, s = np.cos(heading), np.sin(heading)
    return outline @ np.array([[c, s], [-s, c]]) + at


def tubes(path: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Hexagons (..., T, 6, 2) swept by error boxes (..., T, 2) along the segments of a path (..., T
    + 1, 2).
    """
    a, b = path[..., :-1, :], path[..., 1:, :]
    sign = np.where(b >= a, 1.0, -1.0)
    behind, ahead = -sign * error, sign * error
    right = np.stack([ahead[..., 0], behind[..., 1]], axis=-1)
    left = np.stack([behind[..., 0], ahead[..., 1]], axis=-1)
    return np.stack([a + behind, a + right, b + right, b + ahead, b + left, a + left], axis=-2)


def span(*points: np.ndarray, room: float = 0.04) -> tuple[np.ndarray, np.ndarray]:
    """Corners of a box around point sets (n, 2), with some room."""
    flat = np.concatenate([np.asarray(p).reshape(-1, 2) for p in points])
    flat = flat[np.isfinite(flat).all(axis=1)]
    lo, hi = flat.min(axis=0), flat.max(axis=0)
    pad = room * max((hi - lo).max(), 1e-9)
    return lo - pad, hi + pad
