"""The outline of a robot, as Nav2 spells it, as a body with corner points."""

import json
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.problem.body import Body, Disc, Part, body_of
from parc_jax.problem.world.outlines import outlines
from parc_jax.problem.world.outlines import convex_parts

BASE = "base"


@dataclass(frozen=True, eq=False)
class Footprint:
    """Reference points of a robot, from its outline: build with `read_footprint`.

    points: ("base", "corner 0", ...), names for a system's or a file's `points`. places: (n, 2) [m]
    in the robot's frame, the base first, at (0, 0). body: for `reach_avoid`, hulls of corners.
    """

    points: tuple[str, ...]
    places: np.ndarray
    body: Body

    def at(self, pose: npt.ArrayLike):
        """Places (..., n, 2) [m] of all points for poses (..., 3) = (x, y, heading). NumPy or
        JAX.
        """
        xp = jnp if isinstance(pose, jax.Array) else np
        pose = xp.asarray(pose)
        c, s = xp.cos(pose[..., 2]), xp.sin(pose[..., 2])
        turn = xp.stack([xp.stack([c, s], axis=-1), xp.stack([-s, c], axis=-1)], axis=-2)
        return pose[..., None, :2] + xp.asarray(self.places, pose.dtype) @ turn

    def corners(self, pose: npt.ArrayLike):
        """Places (..., n - 1, 2) [m] of the corners alone: for `free_place` and `holds`."""
        return self.at(pose)[..., 1:, :]


def read_footprint(outline: str | npt.ArrayLike) -> Footprint:
    """A body with corner points from a Nav2 footprint.

    outline: "[[0.2, 0.1], [0.2, -0.1], ...]" [m], or the numbers (n, 2), in order, either way
    round; base_link is at (0, 0). What is not convex becomes several parts. Raises InputError.
    """
    if isinstance(outline, str):
        try:
            outline = json.loads(outline)
        except json.JSONDecodeError as error:
            raise InputError(
                f'footprint: expected "[[x, y], [x, y], ...]"; got {outline!r:.60} ({error.msg}).'
            ) from None
    corners = as_float64("footprint", outline, (None, 2))
    (polygon,) = outlines("footprint", corners)
    names = [f"corner {i}" for i in range(len(corners))]
    named = dict(zip(map(tuple, corners.tolist()), names, strict=True))
    parts = [
        Part(tuple(named[corner] for corner in part), Disc(0.0)) for part in convex_parts(polygon)
    ]
    places = np.concatenate([np.zeros((1, 2)), corners])
    return Footprint((BASE, *names), places, body_of(parts))
