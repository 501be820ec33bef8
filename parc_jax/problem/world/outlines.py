"""Outlines as people have them, as valid geometry of Shapely, in metres."""

from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from parc_jax.common import on_use
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError

if TYPE_CHECKING:
    import shapely

FARTHEST = 1e5  # [m] from the origin: farther away floats round by more than is allowed for


def package(name: str, call: str):
    """A package of the extra `maps`. Raises InputError where it is not installed."""
    return on_use.package(name, call, "maps")


def outlines(name: str, value: object) -> list:
    """Polygons and lines, in the plane, of a Shapely geometry, a GeoJSON dict, anything with a
    `__geo_interface__`, or corners (n, 2). Raises InputError, which begins with `name`.
    """
    shapely = package("shapely", name)
    geometry = value if isinstance(value, shapely.Geometry) else _read(name, value, shapely)
    parts = shapely.get_parts(shapely.force_2d(geometry)).tolist()
    while any(hasattr(part, "geoms") for part in parts):
        parts = [one for part in parts for one in shapely.get_parts(part)]
    for part in parts:
        _check(name, part, shapely)
    if not parts:
        raise InputError(f"{name}: expected at least one polygon or line; got none.")
    return parts


def require_near(name: str, places: np.ndarray) -> None:
    """Raises InputError for places (..., 2) [m] farther than FARTHEST from the origin."""
    far = np.abs(places).max(initial=0.0)
    if not far <= FARTHEST:
        raise InputError(
            f"{name}: expected finite coordinates up to {FARTHEST:g} m; got {far:g}. Subtract an "
            "origin near by first."
        )


def _read(name: str, value: object, shapely: ModuleType):
    value = getattr(value, "__geo_interface__", value)
    if not isinstance(value, dict):
        return shapely.Polygon(_corners(name, value))
    features = value.get("features", [value])
    try:
        shapes = [shapely.geometry.shape(one.get("geometry", one)) for one in features]
    except Exception as error:  # whatever Shapely makes of a foreign dict
        raise InputError(
            f"{name}: expected a GeoJSON geometry, feature or collection; got {value!r:.60} "
            f"({type(error).__name__}: {error!s:.60})."
        ) from None
    return shapely.GeometryCollection(shapes)


def _corners(name: str, value: npt.ArrayLike) -> np.ndarray:
    corners = as_float64(f"{name} corners", value, (None, 2))
    if len(corners) < 3:
        raise InputError(f"{name}: expected at least three corners; got {len(corners)}.")
    return corners


def _check(name: str, part: "shapely.Geometry", shapely: ModuleType) -> None:
    if part.geom_type not in ("Polygon", "LineString", "LinearRing"):
        raise InputError(f"{name}: expected polygons and lines; got a {part.geom_type}.")
    if part.is_empty:
        raise InputError(f"{name}: expected a {part.geom_type} with corners; got an empty one.")
    require_near(name, shapely.get_coordinates(part))
    if not part.is_valid:
        why = shapely.is_valid_reason(part)
        raise InputError(
            f"{name}: expected a valid {part.geom_type}; got one with {why}. Try "
            "shapely.make_valid, and look at what it makes of it."
        )
