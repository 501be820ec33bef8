"""Who moves: discs that were seen, and where they may be while a manoeuvre lasts. [T38]"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.system import TimeGrid
from parc_jax.problem.world.moving import moving
from parc_jax.ros.bags.fields import stamp_of
from parc_jax.ros.driving import Driving

EVERY = 3  # intervals of a manoeuvre for which a disc has one outline
SIDES = np.pi / 4 * np.arange(8)  # of an outline: a loop has room for as many corners
NORMALS = np.stack([np.cos(SIDES), np.sin(SIDES)], axis=1)


class Movers(NamedTuple):
    """stamp: [ns] when they were seen. places (n, 2) [m] of their middles."""

    stamp: int
    places: np.ndarray


def movers_in(message: Any) -> Movers:
    """Of a geometry_msgs/PoseArray, whose orientations say nothing. Raises InputError."""
    stamp = stamp_of(message)
    places = [(one.position.x, one.position.y) for one in message.poses]
    places = np.array(places, np.float64).reshape(-1, 2)
    if stamp is None or not np.isfinite(places).all():
        told = f"{places.tolist()!r:.80}"
        raise InputError(f"movers: expected finite places with a stamp; got {told}.")
    return Movers(stamp, places)


def among(movers: Movers, ways: Sequence, pose: np.ndarray, at: int, d: Driving, time: TimeGrid):
    """Obstacles and spans of a manoeuvre that begins at a pose (x, y, ..) at the time `at` [ns] and
    stays within the square of half width `reach` around it: ways, which stand still, and all places
    where movers may be meanwhile. Or a sentence why there are none to be had.
    """
    age = abs(at - movers.stamp) / 1e9
    radius = d.mover_radius + d.mover_speed * age + TOLERANCES.outline
    away = np.abs(movers.places - pose[:2]).max(axis=1)
    if (away <= radius).any():
        return (
            f"who moves may be where the robot is: seen {age:.3g} s apart from its pose, within "
            f"{radius:.3g} m by now"
        )
    obstacles, spans = list(ways), [None] * len(ways)
    for place in movers.places[away <= d.reach + radius + d.mover_speed * time.t_f]:
        now = hpolytope(NORMALS, NORMALS @ place + radius)
        whole = (0, time.n_steps - 1)
        parts, when = moving(now, [0.0, 0.0], whole, time.dt, every=EVERY, off_by=d.mover_speed)
        obstacles += parts
        spans += when
    return obstacles, spans
