"""The running start: what was driven before it, so that all that is not measured, wheel
speeds, slip, the lean on the tyres, a ramp under way, is as it comes in a chain of manoeuvres.
"""

import numpy as np

from sims.jackal import params as c
from sims.jackal.floor import Draws, Law
from sims.jackal.robots import Robots

TICKS = round(c.RUN_IN / c.TICK)


def running(floor: Law, ramp, draws: Draws, measured, poses, threads: int = 0) -> Robots:
    """Robots that have driven RUN_IN from poses (B, 3) and now measure speeds (B, 2), forward [m/s]
    and turning [rad/s]; a new manoeuvre begins.

    Of each of the two, the last command before was held since long, or is being approached from
    below or from above; what it was is drawn. What still misses the speeds is added to robot and
    wheels alike (`missed` of the robots, (B, 2)).
    """
    off = np.array([s.uniform(-1.0, 1.0, 2) for s in draws.before]) * floor.sensed
    speeds = measured + off
    robots = Robots(floor, draws, poses, threads)
    path = before(draws, speeds, ramp)
    robots.push(path[0])
    for set_point in path:
        robots.step(set_point)
    robots.missed = speeds - robots.speeds[:, [0, 2]]
    robots.push(robots.missed)
    robots.begin(measured)
    return robots


def before(draws: Draws, speeds: np.ndarray, ramp) -> np.ndarray:
    """Set points (TICKS, B, 2) of the controllers that end where the robots about have `speeds`
    (B, 2).
    """
    way = np.array([s.integers(-1, 2, 2) for s in draws.before])
    since = np.array([s.uniform(0.0, c.LAST, 2) for s in draws.before])
    slope = way * np.minimum(ramp, c.MOST_CHANGE)
    lag = np.array(c.LAG)
    # a command is inside its box, except where the speeds asked for are outside
    least = np.minimum([c.SPEED[0], -c.TURNING], speeds)
    most = np.maximum([c.SPEED[1], c.TURNING], speeds)
    end = np.clip(speeds + slope * lag * (1 - np.exp(-since / lag)), least, most)
    ago = c.TICK * np.arange(TICKS - 1, -1, -1)[:, None, None]
    return np.clip(end - slope * np.minimum(ago, since), least, most)
