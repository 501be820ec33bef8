"""The running start: what was driven before it, so that all that is not measured, wheel
speeds, slip, the lean on the tyres, a ramp under way, is as it comes in a chain of manoeuvres.
"""

import numpy as np

from sims.jackal import params as c
from sims.jackal.floor import Draws
from sims.jackal.robots import Robots

TICKS = round(c.RUN_IN / c.TICK)


def running(jackal, draws: Draws, k: np.ndarray, poses: np.ndarray) -> Robots:
    """Robots of a black box that have driven RUN_IN from poses (B, 3) and now measure the first two
    of k (B, n_k), forward speed [m/s] and turning [rad/s]; a new manoeuvre begins.

    Of each of the two, the last command before was held since long, or is being approached from
    below or from above; what it was is drawn, or is a part of k. What still misses the speeds is
    added to robot and wheels alike (`missed` of the robots, (B, 2)).
    """
    measured = k[:, :2]
    off = np.array([s.uniform(-1.0, 1.0, 2) for s in draws.before]) * jackal.floor.sensed
    speeds = measured + off
    robots = Robots(jackal.floor, draws, poses, jackal.threads)
    path = before(jackal, draws, speeds, k[:, 2:4] if jackal.waits else None)
    robots.push(path[0])
    for set_point in path:
        robots.step(set_point)
    robots.missed = speeds - robots.speeds[:, [0, 2]]
    robots.push(robots.missed)
    if not jackal.waits:
        robots.begin(measured)
    return robots


def before(jackal, draws: Draws, speeds: np.ndarray, command: np.ndarray | None) -> np.ndarray:
    """Set points (TICKS, B, 2) of the controllers that end where the robots about have `speeds`
    (B, 2), on their way to the command (B, 2), where it is known.
    """
    way = np.array([s.integers(-1, 2, 2) for s in draws.before])
    since = np.array([s.uniform(0.0, c.LAST, 2) for s in draws.before])
    ago = c.TICK * np.arange(TICKS - 1, -1, -1)[:, None, None]
    ramp, lag = np.minimum(jackal.ramp, c.MOST_CHANGE), np.array(c.LAG)
    if command is not None:
        # held already, where the speeds may be its own, slip included, or still approached
        missing = command - speeds
        own = np.abs(missing) <= lag * ramp + c.SLIPPED * np.abs(command)
        slope = np.where((way == 0) & own, 0.0, np.sign(missing) * ramp)
        ahead = np.abs(slope) * lag * (1 - np.exp(-since / lag))
        end = speeds + np.sign(missing) * np.minimum(np.abs(missing), ahead)
        end = np.where(slope == 0, command, end)
    else:
        slope = way * ramp
        end = speeds + slope * lag * (1 - np.exp(-since / lag))
    # a command is inside its box, except where the speeds asked for are outside
    least = np.minimum(np.asarray(jackal.domain.lo)[-2:], speeds)
    most = np.maximum(np.asarray(jackal.domain.hi)[-2:], speeds)
    end = np.clip(end, least, most)
    return np.clip(end - slope * np.minimum(ago, since), least, most)
