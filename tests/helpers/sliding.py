"""A platform that slides, exactly as its model says, and messages that say where it is: it takes
over a commanded velocity with a lag, holds the command and stops.
"""

from types import SimpleNamespace as Some

import numpy as np

import parc_jax as pj

LAG, HELD = 0.1, 0.4  # [s]
DT = 0.1  # [s] between knots
E = 0.02  # [m] half width of the tube
T = np.linspace(0.0, 1.2, 13)
BEFORE, AFTER = np.minimum(T, HELD), np.maximum(T - HELD, 0.0)
FADES = LAG * (1 - np.exp(-BEFORE / LAG))  # [s] way of the velocity at the start
OF_START = FADES + np.exp(-HELD / LAG) * LAG * (1 - np.exp(-AFTER / LAG))
OF_COMMAND = BEFORE - FADES + (1 - np.exp(-HELD / LAG)) * LAG * (1 - np.exp(-AFTER / LAG))


def model() -> pj.types.TrajectoryModel:
    """k: velocity at the start, velocity commanded."""
    time = pj.learning.time_grid(dt=DT, t_f=1.2, dt_record=DT)
    ways = np.stack([OF_START, OF_COMMAND], axis=1)[1:]
    net = pj.learning.relu_network([np.kron(ways, np.eye(2))], [np.zeros(24)])
    tube = pj.learning.tube([[-1.0, 1.0]] * 4, np.full((1, 12, 2), E), np.full((1, 2), E))
    return pj.learning.trajectory_model(
        net, pj.learning.declared_claim(tube, "the tests declare it", net, time)
    )


def after(place, k, knots: int):
    """Place and velocity after so many knots of a manoeuvre."""
    start, command = np.reshape(k, (2, 2))
    i = min(knots, 12)
    there = place + OF_START[i] * start + OF_COMMAND[i] * command
    held = np.exp(-BEFORE[i] / LAG)
    return there, (command + (start - command) * held) * np.exp(-AFTER[i] / LAG)


def hall(posts=()) -> np.ndarray:
    """Cells (60, 120) of 0.05 m, from (-1, -1.5), free but for a border and boxes."""
    cells = np.full((60, 120), 100, np.int8)
    cells[2:-2, 2:-2] = 0
    for x0, y0, x1, y1 in posts:
        rows, columns = (
            (np.array(ends) * 20).round().astype(int)
            for ends in ((y0 + 1.5, y1 + 1.5), (x0 + 1.0, x1 + 1.0))
        )
        cells[slice(*rows), slice(*columns)] = 100
    return cells


def stamp(at: int):
    return Some(sec=at // 10**9, nanosec=at % 10**9)


def header(at: int, frame: str = "map"):
    return Some(stamp=stamp(at), frame_id=frame)


def pose(x, y, yaw=0.0, roll=0.0):
    turn = [f(yaw / 2) * g(roll / 2) for f in (np.cos, np.sin) for g in (np.sin, np.cos)]
    turn = Some(**dict(zip("xwyz", turn, strict=True)))
    return Some(position=Some(x=float(x), y=float(y), z=0.0), orientation=turn)


def posed(x, y, yaw=0.0, at=0, frame="map"):
    return Some(header=header(at, frame), pose=pose(x, y, yaw))


def odometry(place, speed, at, frame="map", yaw=0.0, roll=0.0):
    linear = Some(x=float(speed[0]), y=float(speed[1]), z=0.0)
    return Some(
        header=header(at, frame),
        child_frame_id="base_link",
        pose=Some(pose=pose(*place, yaw, roll)),
        twist=Some(twist=Some(linear=linear)),
    )


def map_of(cells, frame="map", resolution=0.05, origin=(-1.0, -1.5)):
    info = Some(
        resolution=resolution, height=cells.shape[0], width=cells.shape[1], origin=pose(*origin)
    )
    return Some(header=header(0, frame), info=info, data=cells.ravel().tolist())
