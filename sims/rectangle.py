"""The reference points of a vehicle with a rectangular outline: its centre and its true corners."""

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.problem.body import Body, hull
from parc_jax.problem.problem import goal_of_points

CORNERS = ("front left", "rear left", "rear right", "front right")
POINTS = ("centre", *CORNERS)
BODY = "rectangle"  # what the body of these points is called


def centre_and_corners(centre, heading, length: float, width: float):
    """Places (..., 5, 2) [m] of POINTS, from the centre (..., 2) and the heading (...) [rad]. NumPy
    or JAX.
    """
    xp = jnp if isinstance(centre, jax.Array) else np
    ahead = 0.5 * length * xp.stack([xp.cos(heading), xp.sin(heading)], axis=-1)
    left = 0.5 * width * xp.stack([-xp.sin(heading), xp.cos(heading)], axis=-1)
    around = [xp.zeros_like(ahead), ahead + left, left - ahead, -ahead - left, ahead - left]
    return centre[..., None, :] + xp.stack(around, axis=-2)


def goal_of_centre(lo, hi) -> HPolytope:
    """A goal box over the centre (x, y) and further states, for a robot with POINTS."""
    lo, hi = np.array(lo), np.array(hi)
    further = box(lo[2:], hi[2:]) if len(lo) > 2 else None
    return goal_of_points(POINTS, {"centre": box(lo[:2], hi[:2])}, further)


def require_body(body: str, bodies: tuple[str, ...]) -> None:
    """Refuse an unknown body. Raises InputError."""
    if body not in bodies:
        raise InputError(f"body: expected one of {', '.join(bodies)}; got {body!r}.")


def rectangle() -> Body:
    """The hull of the four corners: the rectangle wherever it stands and however it has turned."""
    return hull(*CORNERS)
