"""Outlines and triangles of sets, bodies, paths and tubes, ready to draw, and the views
of a workspace. Pictures only: corners are rounded, and far parts are cut off.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot import style
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.extent import bounding_box, chebyshev_center
from parc_jax.common.sets.hpolytope import HPolytope, coupled, from_box
from parc_jax.common.sets.hull import convex_hull, solid
from parc_jax.common.sets.rational import rational_vertices
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import moved_to, trajectories
from parc_jax.problem.body import Disc, Part, Polygon, numbered
from parc_jax.problem.robust.pose import Pose

GROWN = {"facecolor": "#EBEBEB", "edgecolor": style.GREY, "linestyle": "--"}  # of an obstacle
ARC = 48  # points on the circle of a disc body
AROUND = 20.0  # [m] around a manoeuvre that is drawn


def hull(points: np.ndarray) -> np.ndarray:
    """Convex hull (v, 2) of points (n, 2), counter-clockwise; of no area, the points themselves."""
    points = np.asarray(points, float)
    boundary = convex_hull(points)
    return points if boundary is None else points[boundary.vertices]


def corners_of(poly: HPolytope) -> np.ndarray:
    """(v, n) of a bounded polytope, none of an empty one. Raises InputError for another one, and
    for a flat one beyond space.
    """
    if poly.n <= 3:
        return np.array(rational_vertices(poly, "picture"), float).reshape(-1, poly.n)
    bounded = np.isfinite(bounding_box(poly).volume)
    found = solid(poly, chebyshev_center(poly).center) if bounded else None
    if found is None:
        raise InputError("picture: expected a bounded set with volume; got another. Link less.")
    return found.vertices


def shadow(poly: HPolytope, axes: tuple[int, int] = (0, 1)) -> np.ndarray:
    """Outline (v, 2) of the projection of a bounded polytope onto two of its coordinates.

    Coordinates that no row links to these, directly or over others, are left out: they may have
    any number, and no bounds.
    """
    part, at = linked(poly, axes)
    return hull(corners_of(part)[:, at])


def linked(poly: HPolytope, axes: Sequence[int]) -> tuple[HPolytope, list[int]]:
    """The polytope over coordinates that rows link to some axes, and where these are among them."""
    columns, rows = coupled(poly.A, axes)
    at = [columns.index(axis) for axis in axes]
    return HPolytope(poly.A[np.ix_(rows, columns)], poly.b[rows]), at


def goals(goal: HPolytope, n_p: int, n_points: int, sides: Sequence[tuple[int, int]] = ((0, 1),)):
    """Where the reference points of a robot are to end, from some sides (pairs of axes): per
    region that the goal has for any of them the numbers of these points and its outlines (v, 2),
    one from each side. A region that is not bounded is left out.
    """
    regions: list[tuple[list[int], list[np.ndarray]]] = []
    for point in range(n_points):
        columns = [tuple(point * n_p + axis for axis in axes) for axes in sides]
        try:
            outlines = [shadow(goal, pair) for pair in columns]
        except InputError:
            continue
        alike = lambda x, y: x.shape == y.shape and np.allclose(x, y)  # noqa: E731
        same = [points for points, others in regions if all(map(alike, others, outlines))]
        if same:
            same[0].append(point)
        else:
            regions.append(([point], outlines))
    return regions


def part_outline(part: Part, places: np.ndarray, axes: tuple[int, int] = (0, 1)) -> np.ndarray:
    """Outline (v, 2), along two axes, of a part of the body with its points at places (i, n_p)."""
    if isinstance(part.shape, Disc):
        around = disc(part.shape.radius) if part.shape.radius else np.zeros((1, 2))
    else:
        around = part.shape.vertices[:, list(axes)]
    return hull((places[:, None, list(axes)] + around).reshape(-1, 2))


def grown(obstacle: HPolytope, part: Part) -> np.ndarray:
    """Outline (v, 2) of an obstacle in the plane grown by a part of the body, turned inside out."""
    turned = part.shape if isinstance(part.shape, Disc) else Polygon(-part.shape.vertices)
    return part_outline(part.replace(shape=turned), corners_of(obstacle))


def disc(radius: float) -> np.ndarray:
    """Outline (ARC, 2) of a disc about the origin, drawn just outside it."""
    angle = np.arange(ARC) * 2 * np.pi / ARC
    return radius / np.cos(np.pi / ARC) * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def names(answer) -> tuple[str, str, str]:
    """Of the legend of a picture: of obstacles, of goals, and what it adds to a word for a way."""
    if answer.scene.nominal.uncertainty is not None:
        # what is drawn is the nominal problem, whose first point is that in the first realisation
        of = "what is uncertain"
        return f"obstacle, grown by {of}", f"goal, less {of}", " (one possible run)"
    points = answer.model.points
    return "obstacle", "goal", "" if len(points) == 1 else f" ({points[0]})"


def footprints(
    parts: Sequence[Part], columns: np.ndarray, n_p: int, axes: tuple[int, int] = (0, 1)
) -> list[np.ndarray]:
    """Outlines (v, 2) of all parts of the body (`numbered`), along two axes, at poses (t, m
    n_p): the places of the m reference points.
    """
    poses = columns.reshape(len(columns), -1, n_p)
    return [part_outline(one, places[list(one.points)], axes) for places in poses for one in parts]


def placed(outline: np.ndarray, at: np.ndarray, heading: float = 0.0) -> np.ndarray:
    """An outline (v, 2) turned by `heading` [rad] and moved to `at` (2,)."""
    c, s = np.cos(heading), np.sin(heading)
    return outline @ np.array([[c, s], [-s, c]]) + at


def tubes(path: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Hexagons (..., T, 6, 2) swept by error boxes (..., T, 2) along a path (..., T + 1, 2)."""
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


def ratio(lo: np.ndarray, hi: np.ndarray) -> float:
    """Width over height of a box with these corners (2,)."""
    return (hi[0] - lo[0]) / (hi[1] - lo[1])


class View(NamedTuple):
    """name: where one looks from. axes: the two coordinates that one sees."""

    name: str
    axes: tuple[int, int]

    def of(self, places: np.ndarray) -> np.ndarray:
        """Places or widths (..., n_p) in the view, (..., 2)."""
        return places[..., list(self.axes)]


TOP = View("from above", (0, 1))
SIDE = View("from the side", (0, 2))
FRONT = View("from the front", (1, 2))


def views_of(n_p: int) -> tuple[View, ...]:
    """The views of a workspace of n_p dimensions."""
    return (TOP,) if n_p == 2 else (TOP, SIDE, FRONT)


def axes_of(answer) -> list[str]:
    """Labels of the axes of an answer's workspace, which name the frame where it is the robot's."""
    frame = ", robot's frame" * answer.scene.nominal.turned
    return [label + frame for label in answer.model.labels.p]


class SceneView:
    """The scene of an answer in one view: outlines of its goals and obstacles, the parts of its
    body, and, where the body is one point, the obstacles grown by it.
    """

    def __init__(self, answer, view: View):
        model, problem = answer.model, answer.problem
        self.view, self.n_p, self.labels = view, model.n_p, axes_of(answer)
        self.parts = numbered(problem.body, model.points)
        self.obstacles = [shadow(o, view.axes) for o in problem.obstacles]
        self.single = model.n_c == 2 and len(problem.parts) == 1
        self.grown = [grown(o, self.parts[0]) for o in problem.obstacles if self.single]
        regions = goals(problem.goal, model.n_p, model.n_points, [view.axes])
        self.goals = [outline for _, (outline,) in regions]

    def of_points(self, columns: np.ndarray) -> np.ndarray:
        """Columns (..., t, n_c) of m reference points in the view, (..., m, t, 2)."""
        places = columns.reshape(*columns.shape[:-1], -1, self.n_p)
        return self.view.of(places).swapaxes(-3, -2)

    def bodies(self, columns: np.ndarray) -> list[np.ndarray]:
        """Outlines (v, 2) of all parts of the body at poses (t, n_c)."""
        return footprints(self.parts, columns, self.n_p, self.view.axes)

    def label(self, ax) -> None:
        """Names and equal scales of the axes."""
        ax.set_aspect("equal")
        ax.set_xlabel(self.labels[self.view.axes[0]])
        ax.set_ylabel(self.labels[self.view.axes[1]])


def predicted(
    model: TrajectoryModel, plans: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of plans (n, n_p + n_k), in float64, for drawing and not for verdicts: paths (n, T + 1, n_c)
    [m] of all reference points, goal states (n, n_q), half widths (n, T, n_c) [m] of their tubes.
    """
    p0, k = plans[:, : model.n_p], plans[:, model.n_p :]
    offsets, q = trajectories(model.net, model.layout, k)
    return moved_to(p0, offsets), q, model.tube.widest_at(k)[0]


def in_world(points: np.ndarray, pose: Pose | None) -> np.ndarray:
    """Points (..., n_p) in the frame of a pose with a heading, as (..., 3) in the world."""
    if pose is not None and pose.heading is not None:
        points = placed(points, pose.place, pose.heading)
    return np.concatenate([points, np.zeros((*points.shape[:-1], 3 - points.shape[-1]))], axis=-1)


def obstacle_triangles(obstacles: Sequence[HPolytope], about: np.ndarray) -> np.ndarray:
    """(t, 3, n_p) of the obstacles, near places (..., n_p)."""
    flat = about.reshape(-1, about.shape[-1])
    lo, hi = flat.min(axis=0) - AROUND, flat.max(axis=0) + AROUND
    # walls of maps may be unbounded: a box around the manoeuvre bounds them
    around = from_box(Box(lo, hi))
    cut = [HPolytope(np.r_[o.A, around.A], np.r_[o.b, around.b]) for o in obstacles]
    drawn = [triangles(corners_of(poly)) for poly in cut]
    return np.concatenate([np.zeros((0, 3, len(lo))), *drawn])


def tube_triangles(parts: Sequence[Part], places: np.ndarray, tube: np.ndarray) -> np.ndarray:
    """(t, 3, n_p): all that the body may reach of a path (T + 1, m, n_p) with the half widths
    (T, m, n_p) of its tube, interval by interval; none of an interval without a claim.
    """
    _, m, n_p = places.shape
    drawn = [np.zeros((0, 3, n_p))]
    for t, half in enumerate(tube):
        if np.isfinite(half).all():
            # (corner, knot, m, n_p)
            corners = places[t : t + 2] + _signs(n_p)[:, None, None] * half
            drawn.append(reached(parts, np.moveaxis(corners, 2, 0).reshape(m, -1, n_p)))
    return np.concatenate(drawn)


def reached(parts: Sequence[Part], places: np.ndarray) -> np.ndarray:
    """(t, 3, n_p) of a body each of whose points is anywhere in the hull of places (m, v, n_p)."""
    grown = [_grown(part, np.concatenate(places[list(part.points)])) for part in parts]
    return np.concatenate([triangles(points) for points in grown])


def _grown(part: Part, places: np.ndarray) -> np.ndarray:
    """Points (v, n_p) whose hull is a part of the body with its reference points at places; a ball
    in space is drawn as the cube around it.
    """
    n_p = places.shape[1]
    if n_p == 2:
        return part_outline(part, places)
    ball = isinstance(part.shape, Disc)
    around = part.shape.radius * _signs(n_p) if ball else part.shape.vertices
    return (places[:, None] + around).reshape(-1, n_p)


def _signs(n_p: int) -> np.ndarray:
    """(2^n_p, n_p) corners of the cube of half width 1."""
    return np.array(list(itertools.product((-1.0, 1.0), repeat=n_p)))


def triangles(points: np.ndarray) -> np.ndarray:
    """(t, 3, n_p) of the hull of points (v, n_p): plane area or surface in space; none if flat."""
    n_p = points.shape[1]
    if len(points) <= n_p:
        return np.zeros((0, 3, n_p))
    if n_p == 2:
        around = hull(points)
        fan = [around[[0, i, i + 1]] for i in range(1, len(around) - 1)]
        return np.array(fan).reshape(-1, 3, 2)
    boundary = convex_hull(points)
    return np.zeros((0, 3, n_p)) if boundary is None else points[boundary.simplices]
