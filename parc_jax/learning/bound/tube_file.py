"""A tube as arrays and as JSON, and back."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.spelling import hex_floats, hex_text
from parc_jax.learning.bound.faces import templates_of
from parc_jax.learning.bound.tube import Tube, fitted_tube, tube


def tube_to_json(error_tube: Tube) -> dict:
    """Edges and widths as nested lists of hex floats ("inf" in bins without claim)."""
    points = {} if error_tube.n_points == 1 else {"points": error_tube.n_points}
    arrays = {name: hex_text(array) for name, array in tube_arrays(error_tube).items()}
    edges = [arrays.pop(f"edges{axis}") for axis in range(error_tube.n_k)]
    return points | {"edges": edges} | arrays


def tube_from_json(data: dict) -> Tube:
    """The tube of `tube_to_json`."""
    arrays = {f"edges{axis}": edge for axis, edge in enumerate(data["edges"])} | data
    known = {name: arrays[name] for name in arrays if name not in ("edges", "points")}
    return tube_from_arrays(
        {name: hex_floats(values) for name, values in known.items()},
        len(data["edges"]),
        data.get("points", 1),
    )


def tube_arrays(error_tube: Tube) -> dict[str, np.ndarray]:
    """Everything a tube is made of but n_points, by name."""
    edges = {f"edges{axis}": edge for axis, edge in enumerate(error_tube.edges)}
    boxes = {"interval": error_tube.interval, "final": error_tube.final}
    faces = {} if error_tube.templates is None else error_tube.templates.arrays
    return edges | boxes | faces


def tube_from_arrays(arrays: Mapping[str, np.ndarray], n_k: int, n_points: int = 1) -> Tube:
    """The tube of `tube_arrays`. Raises InputError, also for boxes that are not those around the
    faces; KeyError when one is missing.
    """
    edges = [arrays[f"edges{axis}"] for axis in range(n_k)]
    boxes = tube(edges, arrays["interval"], arrays["final"], n_points)
    if "interval_directions" not in arrays:
        return boxes
    fitted = fitted_tube(edges, *templates_of(arrays))
    if replace(fitted, templates=None).hash != boxes.hash:
        raise InputError("tube: expected the boxes around its faces; got other ones.")
    return fitted
