"""The bar: a plain sampled planner, of the kind that practice has. 143 arcs, movers go on straight
at the velocity that is seen, 2.5 s ahead, positions known, nothing proved.
"""

import numpy as np

from sims.dynabarn.sight import Known, Seen, straight_on
from sims.dynabarn.worlds import GOAL, RADIUS, START, TIMEOUT, World, clearances, reached
from sims.jackal.driven import Driven
from sims.jackal.learn import BACKWARD, SPEED, TURNING, robot

AHEAD, STEP = 2.5, 0.1  # [s] predicted, and between predictions
RAMPS = (3.0, 6.0)  # [m/s^2], [rad/s^2] of the robot
INSIDE = 0.31  # [m] radius of a disc that holds the robot
CLEAR, DEAR = 1.0, 10.0  # [m] less clearance than this costs, each [m] of it so many [m] of way
LATER = 3.0  # a contact that is predicted later costs less: [m] of way per [s]
CONTACT = 20.0  # [m] of way that a contact which is predicted now costs


def arcs(speed: float, turning: float, backward: float) -> np.ndarray:
    """Commands (143, 2): 13 speeds [m/s] by 11 rates of turning [rad/s]."""
    v, w = np.linspace(-backward, speed, 13), np.linspace(-turning, turning, 11)
    return np.stack(np.meshgrid(v, w, indexing="ij"), axis=-1).reshape(-1, 2)


def rolled(pose, speeds, commands: np.ndarray) -> np.ndarray:
    """Places (b, n, 3) of an ideal unicycle that follows each of commands (b, 2) from speeds (2,),
    STEP apart, up to AHEAD.
    """
    state = np.tile(pose, (len(commands), 1))
    speeds = np.tile(speeds, (len(commands), 1))
    most, places = STEP * np.array(RAMPS), []
    for _ in range(round(AHEAD / STEP)):
        following = speeds + np.clip(commands - speeds, -most, most)
        v, w = ((speeds + following) / 2).T
        middle = state[:, 2] + STEP * w / 2
        state = state + STEP * np.stack([v * np.cos(middle), v * np.sin(middle), w], axis=1)
        speeds = following
        places.append(state)
    return np.stack(places, axis=1)


def costs(places: np.ndarray, movers: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """(b,) [m] of predicted places (b, n, 3) among movers (m, 2) [m] with velocities (m, 2)."""
    times = STEP * np.arange(1, places.shape[1] + 1)
    there = movers + times[:, None, None] * velocities
    away = np.linalg.norm(places[:, :, None, :2] - there[None], axis=-1)
    gap = away.min(axis=2, initial=np.inf) - RADIUS - INSIDE
    hit = gap <= 0
    first = np.where(hit.any(axis=1), times[hit.argmax(axis=1)], np.inf)
    contact = np.where(hit.any(axis=1), CONTACT - LATER * np.minimum(first, AHEAD), 0.0)
    near = DEAR * np.maximum(0.0, CLEAR - gap).max(axis=1)
    last = places[:, -1]
    to_goal = np.arctan2(GOAL[1] - last[:, 1], GOAL[0] - last[:, 0]) - last[:, 2]
    away = np.abs(np.arctan2(np.sin(to_goal), np.cos(to_goal)))
    return np.linalg.norm(last[:, :2] - GOAL, axis=1) + 0.3 * away + near + contact


def choose(pose, speeds, movers, velocities, commands) -> np.ndarray:
    """The command (2,) of least cost."""
    return commands[np.argmin(costs(rolled(pose, speeds, commands), movers, velocities))]


def drive(world: World, key, sight: Known | Seen, again: float = 0.1) -> dict:
    """Drive from the start to the goal, or until something is touched or the time is out, with a
    new command every `again` seconds; what came of it.
    """
    system, commands = robot(), arcs(SPEED, TURNING, BACKWARD)
    driven, touched = Driven(system, START, key), False
    while driven.time < TIMEOUT and not reached(driven.pose) and not touched:
        first = len(driven.path) - 1
        movers, velocities = straight_on(sight.look(driven), driven.time)
        command = choose(driven.pose, driven.measured, movers, velocities, commands)
        driven.begin(*command)
        driven.drive(again)
        touched = bool(clearances(world, driven.path, system.size, first).min() <= 0)
    nearest = float(clearances(world, driven.path, system.size).min())
    return {
        "reached": reached(driven.pose) and nearest > 0,
        "seconds": round(driven.time, 2),
        "clearance": nearest,
        "cause": "nothing is proved" if nearest <= 0 else "",
    }
