"""The parking cases of TPCAP (IEEE ITSC 2022): LICENSE.txt has their notice."""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

import parc_jax as pj
from sims.parking.car import LENGTH, WAY, corners

FILE = Path(__file__).with_name("cases.json")
GOAL = (0.1, np.radians(2.0))  # [m] along and across, [rad]: how far from the goal is in it
FAR = 200.0  # [m] from the start: goals that are farther are refused
# [m] from the rear axle: obstacles that are farther are reached by no manoeuvre
NEAR = WAY + LENGTH + 1.0


class Case(NamedTuple):
    """A case. name: as messages have it. start, goal (3,): x, y [m], heading [rad] of the rear
    axle, from the place of the start. outlines: polygons as they are given, (n, 2) [m] each.
    """

    name: str
    start: np.ndarray
    goal: np.ndarray
    outlines: tuple[np.ndarray, ...]

    @property
    def pieces(self) -> list:
        """Convex polytopes that cover the outlines, each with the outline that it is of."""
        return [
            (piece, shape)
            for one, shape in zip(self.outlines, self.shapes, strict=True)
            for piece in pj.problem.convex_pieces(one)
        ]

    @property
    def shapes(self) -> list:
        """The outlines as Shapely has them."""
        return [shapely.Polygon(one) for one in self.outlines]


def numbers(file: Path = FILE) -> tuple[int, ...]:
    """Of the cases of a file. Raises InputError."""
    return tuple(sorted(map(int, _read(file))))


def case(number: int, file: Path = FILE) -> Case:
    """A case of a file. Raises InputError, with the name of what is wrong."""
    listed = _read(file)
    if str(number) not in listed:
        known = ", ".join(sorted(listed, key=int))
        raise pj.InputError(f"case: expected one of {known}; got {number!r:.40}.")
    data = listed[str(number)]
    parts = ("start", "goal", "obstacles")
    if not isinstance(data, dict) or not all(isinstance(data.get(part), list) for part in parts):
        raise pj.InputError(f"case {number}: expected lists named {', '.join(parts)} in {file}.")
    return case_of(f"case {number}", *(data[part] for part in parts))


def case_of(name: str, start, goal, obstacles) -> Case:
    """A case of poses (3,) and corners of polygons, all in one frame. Raises InputError where one
    is broken, or is touched at the start or at the goal.
    """
    start, goal = (_numbers(pose) for pose in (start, goal))
    if start.shape != (3,) or goal.shape != (3,) or not np.isfinite([start, goal]).all():
        raise pj.InputError(f"{name}: expected a start and a goal of x, y [m] and heading [rad].")
    origin, outlines = start[:2].copy(), []
    for i, polygon in enumerate(obstacles):
        outline = _numbers(polygon)
        shape = (
            shapely.Polygon(outline - origin)
            if outline.ndim == 2 and outline.shape[1] == 2 and len(outline) > 2
            else None
        )
        if shape is None or not shape.is_valid or not shape.area > 0:
            why = (
                "not 3 or more corners of two numbers"
                if shape is None
                else shapely.is_valid_reason(shape)
            )
            raise pj.InputError(f"{name}: expected polygons; obstacle {i} is broken: {why}.")
        outlines.append(outline - origin)
    start, goal = start - [*origin, 0.0], goal - [*origin, 0.0]
    found = Case(name, start, goal, tuple(outlines))
    for word, pose in (("start", start), ("goal", goal)):
        body = shapely.Polygon(corners(*pose)[1:])
        for i, shape in enumerate(found.shapes):
            if body.intersects(shape):
                raise pj.InputError(
                    f"{name}: expected a {word} where the car touches nothing; there it touches "
                    f"obstacle {i}."
                )
    if not np.linalg.norm(goal[:2]) < FAR:
        raise pj.InputError(
            f"{name}: expected a goal within {FAR:.0f} m of the start; it is "
            f"{np.linalg.norm(goal[:2]):.0f} m away."
        )
    return found


def _numbers(given) -> np.ndarray:
    try:
        return np.asarray(given, np.float64)
    except (TypeError, ValueError):
        return np.empty(0)


def _read(file: Path) -> dict:
    try:
        listed = json.loads(file.read_text())
    except (OSError, ValueError) as error:
        raise pj.InputError(f"cases: expected a JSON file of cases; {file}: {error}.") from None
    if not isinstance(listed, dict) or not all(name.isdecimal() for name in listed):
        raise pj.InputError(f"cases: expected cases by their numbers in {file}.")
    return listed
