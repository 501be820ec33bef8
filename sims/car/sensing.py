"""What a shield asks of the Car: `pj.drive.Shield(env, sims.car.model(), **sims.car.door())`.

Where hazards and vases are is known. A hazard is a place that the robot's middle keeps 0.2 m from,
so the radius is the robot's, and the hazard its middle. A vase is its box, wider by what the
robot's outline is beyond that radius.
"""

import jax
import jax.numpy as jnp
import numpy as np

import parc_jax as pj
from sims.car import manoeuvre
from sims.point import sensing
from sims.point.world import HAZARD

REST = 0.001  # [m] creep after the last knot, at most: `sims.point.learn` measures it
RADIUS = HAZARD + REST  # [m] of the robot as a shield has it
OUTLINE = 0.2158  # [m] from its middle to the outer edge of a wheel
CUT = HAZARD - OUTLINE  # [m] by which a vase is smaller on every side: it is larger
ROOM = 0.02  # [m] asked of a new manoeuvre


def door() -> dict:
    """Arguments of `pj.drive.Shield`."""
    return {
        "system": manoeuvre.system(1),
        "body": RADIUS,
        "every": manoeuvre.STEP,
        "sense": sense,
        "ask": ask,
        "act": manoeuvre.action,
        "room": ROOM,
        "assumed": sensing.creeping(REST),
    }


def corners(world) -> np.ndarray:
    """(o, 4, 2) [m] of all obstacles, for `BatchShield.step`."""
    return sensing.corners(world, CUT)


def sense(env, observation) -> pj.drive.Sensed:
    """Pose, speeds, and what stands in the way, from the true state."""
    world = env.unwrapped.world
    boxes = sensing.vases(world.vase_boxes())
    wider = [pj.hpolytope(box.A, box.b + sensing.CUT - CUT) for box in boxes]
    seen = sensing.sense(env, observation)
    dots = list(seen.obstacles)[: len(world.hazards)]
    return pj.drive.Sensed(world.pose, world.speeds, dots + wider)


def ask(action: np.ndarray) -> np.ndarray:
    """Torques (2,) of the manoeuvre that begins with an action, as shares of the greatest."""
    xp = jnp if isinstance(action, jax.Array) else np
    return xp.clip(action / manoeuvre.TORQUE, -1.0, 1.0)
