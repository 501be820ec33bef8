"""What a shield asks of CRAX's Point: `pj.drive.Shield(env, crax.model(), **crax.door())`.

Where everything stands is known. The robot is the disc around its outline; a solid hazard is its
box, or a polygon around its circle; a flat one, which the robot's middle has to keep out of, is a
polygon around its circle less the robot's radius.
"""

from functools import lru_cache

import numpy as np

import parc_jax as pj
from parc_jax.common.sets.box import box
from parc_jax.learning.system import time_grid
from sims.crax.judge import SQUARE
from sims.crax.world import POINT, SIDES, THICK, WALLS
from sims.point import sensing
from sims.point.manoeuvre import Brake, Point

T_FINAL, KNOT, RECORD = 1.6, 0.04, 0.02  # [s]
AHEAD, ASIDE, TURNING = 1.5, 1.1, 3.1  # [m/s], [m/s], [rad/s] most that is measured at a start
REST = 0.035  # [m] creep after the last knot, at most: `sims.point.learn` measures it
ROOM = 0.02  # [m] asked of a new manoeuvre: tubes of a robot at rest are that much wider
OUTLINE = sensing.OUTLINE  # [m] the robots are the same
CORNERS, PIECES = 16, 6  # of a polygon around a circle; of a wall in a batch
BRAKE = Brake(POINT, 0.216, 3.0)


def system(threads: int = 0) -> Point:
    """The black box: the Point's manoeuvre with steps four times as long."""
    most = np.array([AHEAD, ASIDE, TURNING, 1.0, 1.0])
    grid = time_grid(KNOT, T_FINAL, RECORD)
    return Point(box(-most, most), grid, threads, BRAKE, "crax point")


def door() -> dict:
    """Arguments of `pj.drive.Shield`."""
    return {
        "system": system(1),
        "body": OUTLINE + REST,
        "every": POINT.step,
        "sense": sense,
        "ask": sensing.ask,
        "act": BRAKE.action,
        "room": ROOM,
        "assumed": sensing.creeping(REST),
    }


def sense(env, observation) -> pj.drive.Sensed:
    """Pose, speeds, and what stands in the way, from the true state."""
    world = env.unwrapped.world
    return pj.drive.Sensed(world.pose, world.speeds, obstacles(world))


@lru_cache(maxsize=128)  # as many worlds as are driven in step
def corners(world) -> np.ndarray:
    """(o, CORNERS, 2) [m] of the same, for `BatchShield.step`, those of boxes repeated. Walls are
    in pieces: a box around a whole one, turned as the robot is, would hold half of the room.
    """
    turn = 2 * np.pi / CORNERS * (np.arange(CORNERS) + 0.5)
    round_ = np.stack([np.cos(turn), np.sin(turn)], axis=1) / np.cos(np.pi / CORNERS)
    box = np.repeat(SQUARE, CORNERS // 4, axis=0)
    shapes = np.where((world.square & world.solid)[:, None, None], box, round_)
    sizes = world.sizes - OUTLINE * ~world.solid
    hazards = world.hazards[:, None] + sizes[:, None, None] * shapes
    long = SIDES > THICK
    along = (2 * np.arange(PIECES)[:, None, None] + 1 - PIECES) / PIECES * long * SIDES
    pieces = (WALLS + along)[:, :, None] + (SIDES / np.where(long, PIECES, 1))[:, None] * box
    return np.concatenate([pieces.reshape(-1, CORNERS, 2), hazards])


@lru_cache(maxsize=8)
def obstacles(world) -> list:
    """Hazards and walls of a world, which do not move."""
    turn = 2 * np.pi / CORNERS * np.arange(CORNERS)
    round_ = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    sides = np.concatenate([np.eye(2), -np.eye(2)])
    found = [
        pj.hpolytope(sides, sides @ place + np.tile(half, 2))
        for place, half in zip(WALLS, SIDES, strict=True)
    ]
    for place, size, square, solid in zip(
        world.hazards, world.sizes, world.square, world.solid, strict=True
    ):
        rows = sides if square and solid else round_
        found.append(pj.hpolytope(rows, rows @ place + size - OUTLINE * (not solid)))
    return found
