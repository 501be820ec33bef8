"""What a shield asks of the Point: `pj.drive.Shield(env, sims.point.model(), **sims.point.door())`.

Where hazards and vases are is known. A hazard is a place that the robot's middle keeps 0.2 m from,
so the radius is the robot's, and the hazard its middle. A vase is its box, cut back so far that the
same radius holds the robot's own outline. How far the robot creeps after a manoeuvre has ended is
assumed, and in the tube of the model that comes along: its last interval is that much wider.
"""

from collections.abc import Callable
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np

import parc_jax as pj
from parc_jax.common.sets.hpolytope import from_box
from sims.point import manoeuvre
from sims.point.world import HAZARD, STEP, VASE

# [mm] creep after the last knot, at most, by bins of the tube: from speeds backwards to ahead, and
# from one side to the other, at the start. `sims.point.learn` measures it
CREEP = [6, 5, 4, 5, 6], [13, 6, 5, 6, 13], [35, 19, 13, 19, 35], [23, 16, 13, 16, 23]
REST = np.ravel([*CREEP, [17, 14, 9, 14, 17]]) / 1000  # [m]
OUTLINE = 0.1582  # [m] from its middle to the corner of its arrow
# A box smaller by this much on every side, grown by HAZARD, holds the box grown by OUTLINE
CUT = (HAZARD - OUTLINE) / np.sqrt(2) - 1e-4
ROOM = 0.01  # [m] asked of a new manoeuvre: tubes of a robot at rest are wider
FAR = 20.0  # [m] farther away than anything is in a batch
DOT = 1e-6  # [m] half the edge of the box that is a hazard's middle


def door() -> dict:
    """Arguments of `pj.drive.Shield`."""
    return {
        "system": manoeuvre.system(1),
        "body": HAZARD,
        "every": STEP,
        "sense": sense,
        "ask": ask,
        "act": manoeuvre.action,
        "room": ROOM,
        "assumed": {
            "creep": f"at most {REST.min():g} to {REST.max():g} m once a manoeuvre has ended, by "
            "its speeds at the start, by which the last interval of the tube is wider"
        },
    }


def creeping(rest: float) -> dict[str, str]:
    """What certificates assume of a robot that creeps at most so far [m] once it has braked."""
    return {"creep": f"at most {rest:g} m once a manoeuvre has ended, by which the body is grown"}


def batch_door(door: Callable[[], dict] = door) -> dict:
    """Arguments of `pj.drive.BatchShield`: those of a robot's door, of arrays."""
    one = door()
    same = {name: one[name] for name in ("system", "every", "ask", "act", "room")}
    return same | {"radius": one["body"], "far": FAR}


def corners(world, cut: float = CUT) -> np.ndarray:
    """(o, 4, 2) [m] of all obstacles, for `BatchShield.step`. cut: [m] as CUT."""
    dots = world.hazards[:, None] + DOT * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    boxes = world.vase_boxes()
    middles = boxes.mean(axis=1, keepdims=True)
    return np.concatenate([dots, middles + (1 - cut / VASE) * (boxes - middles)])


def sense(env, observation) -> pj.drive.Sensed:
    """Pose, speeds, and what stands in the way, from the true state."""
    world = env.unwrapped.world
    return pj.drive.Sensed(world.pose, world.speeds, _dots(world) + vases(world.vase_boxes()))


@lru_cache(maxsize=64)
def _dots(world) -> list:
    """Its hazards, which do not move."""
    return [from_box(pj.box(place - DOT, place + DOT)) for place in world.hazards]


def vases(boxes: np.ndarray) -> list:
    """Obstacles of boxes (n, 4, 2), by their sides."""
    found = []
    for corners in boxes:
        middle, sides = corners.mean(axis=0), np.diff(corners[:3], axis=0)
        normals = sides / np.linalg.norm(sides, axis=1, keepdims=True)
        normals = np.concatenate([normals, -normals])
        found.append(pj.hpolytope(normals, normals @ middle + VASE - CUT))
    return found


def ask(action: np.ndarray) -> np.ndarray:
    """Thrust and turning (2,) of the manoeuvre that begins with an action. NumPy or JAX."""
    xp = jnp if isinstance(action, jax.Array) else np
    thrust, turning = xp.clip(action, -1.0, 1.0)
    return xp.array([xp.clip(thrust / manoeuvre.THRUST, -1.0, 1.0), turning])
