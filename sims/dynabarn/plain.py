"""The bar: a plain sampled planner, of the kind that practice has. 143 commands, each held on, or
for a moment before the robot goes straight on; movers go straight on at the velocity that is seen,
or turn, as they now and then do; nothing proved.
"""

from functools import cache

import numpy as np

from sims.dynabarn.robot import RAMP, SPEED, TURNING, robot
from sims.dynabarn.sight import Known, Seen, Sighting, straight_on
from sims.dynabarn.worlds import GOAL, RADIUS, START, TIMEOUT, World, clearances, reached
from sims.jackal.driven import Driven
from sims.jackal.learn import HELD

AHEAD, STEP = 1.8, 0.1  # [s] predicted, and between predictions
WAITS = 0.1  # [s] from measuring to the first moment at which a command shows, about
TURNS = 0.6  # [s] for which it turns, where it then goes straight on
INSIDE = 0.31  # [m] radius of a disc that holds the robot
CLEAR, GROWS = 1.0, 0.5  # [m] less clearance than this costs, and [m/s] more of it later
DEAR, FADES = 14.0, 2.0  # [m] of way that no clearance at all costs now, and [s] until a third
CONTACT, LATER = 40.0, 3.0  # [m] of way that a contact costs now, and [s] until a third
BLURRED = 0.15  # [m] by which a gap may be wrong: from there on, more and more, it is a contact
STRAIGHT = 2.6  # [s] that a mover goes straight on, in the mean
BY = np.outer([1, -1], [0.05, 0.24, 0.62, 1.64, 2.69]).ravel()  # [rad] then: middles of fifths
SINCE = np.arange(0.0, 1.0, 0.2)  # [s] when it may turn, each until the next
NEW = 1.6 * np.exp(1j * np.pi / 8 * np.arange(16))  # [m/s] of whom only the place is known
FACING = 0.1  # [m] of way that each [rad] costs by which the robot does not face the goal


def commands() -> np.ndarray:
    """Commands (143, 2): 13 speeds [m/s] by 11 rates of turning [rad/s]."""
    v, w = np.linspace(-SPEED, SPEED, 13), np.linspace(-TURNING, TURNING, 11)
    return np.stack(np.meshgrid(v, w, indexing="ij"), axis=-1).reshape(-1, 2)


def rolled(pose, speeds, before, asked: np.ndarray) -> np.ndarray:
    """Places (2, b, n, 3) of an ideal unicycle with speeds (2,) that follows the command before
    (2,) for as long as it WAITS, then each of those asked for (b, 2): held on, or until it goes
    straight on; STEP apart, up to AHEAD.
    """
    both = np.concatenate([asked, asked])
    then = np.concatenate([asked, asked * [1.0, 0.0]])
    state, speeds = np.tile(pose, (len(both), 1)), np.tile(speeds, (len(both), 1))
    most, places = STEP * np.array(RAMP), []
    for i in range(round(AHEAD / STEP)):
        since = STEP * i - WAITS + 1e-9
        command = before if since < 0 else both if since < TURNS else then
        following = speeds + np.clip(command - speeds, -most, most)
        v, w = ((speeds + following) / 2).T
        middle = state[:, 2] + STEP * w / 2
        state = state + STEP * np.stack([v * np.cos(middle), v * np.sin(middle), w], axis=1)
        speeds = following
        places.append(state)
    return np.stack(places, axis=1).reshape(2, len(asked), -1, 3)


@cache
def futures(n: int) -> tuple[np.ndarray, np.ndarray]:
    """(f, n) places, as complex numbers STEP apart, of a mover that comes along the real axis with
    1 m/s: straight on first, then turning; and (f,) how probable each is.
    """
    times, took = STEP * np.arange(1, n + 1), SINCE[1] - SINCE[0]
    since, by = (each.ravel()[:, None] for each in np.meshgrid(SINCE, BY))
    turns = since + took / 2
    turned = np.minimum(times, turns) + np.maximum(0.0, times - turns) * np.exp(1j * by)
    chance = np.exp(-since[:, 0] / STRAIGHT) * (1.0 - np.exp(-took / STRAIGHT)) / len(BY)
    return np.vstack([times, turned]), np.append(1.0 - chance.sum(), chance)


def expected(one: Sighting, now: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    """As of `futures`, of a mover as it is known now: on the way that it is remembered for, else
    straight on, or turning; anywhere where only its place is known.
    """
    if one.again is not None:
        times = now + STEP * np.arange(1, n + 1)
        return np.interp(times, *one.again)[None], np.ones(1)
    if not one.velocity.any():
        walked = one.place @ [1, 1j] + NEW[:, None] * STEP * np.arange(1, n + 1)
        return walked, np.full(len(NEW), 1 / len(NEW))
    walked, chance = futures(n)
    return straight_on(one, now) @ [1, 1j] + one.velocity @ [1, 1j] * walked, chance


def costs(places: np.ndarray, movers: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """(...,) [m] of predicted places (..., n, 3) among movers, each as of `expected`."""
    times = STEP * np.arange(1, places.shape[-2] + 1)
    x, y = np.moveaxis(places[..., None, :, :2], -1, 0).astype(np.float32)
    here, most = places[(0,) * (places.ndim - 2)][0, :2] @ [1, 1j], times[-1] * SPEED
    reach = most + RADIUS + INSIDE + CLEAR
    fades, later = (np.exp(-times / s).astype(np.float32) for s in (FADES, LATER))
    close, apart = RADIUS + INSIDE + BLURRED * np.array([-1.0, 1.0])
    away, clear = np.full(x[..., 0, :].shape, np.inf, np.float32), np.ones(x.shape[:-2])
    for walked, chance in movers:
        if np.abs(walked[0] - here).min() > reach:
            continue
        there = walked.astype(np.complex64)
        squared = (x - there.real) ** 2 + (y - there.imag) ** 2
        away = np.minimum(away, squared[..., 0, :])
        touches = np.clip((apart**2 - squared) / (apart**2 - close**2), 0.0, 1.0)
        clear *= 1.0 - (later * touches).max(axis=-1) @ chance
    gap = np.sqrt(away) - RADIUS - INSIDE
    near = np.maximum(0.0, 1.0 - gap / (CLEAR + GROWS * times)) ** 2
    last = places[..., -1, :]
    to_goal = np.arctan2(GOAL[1] - last[..., 1], GOAL[0] - last[..., 0]) - last[..., 2]
    beside = np.abs(np.arctan2(np.sin(to_goal), np.cos(to_goal)))
    way = np.linalg.norm(last[..., :2] - GOAL, axis=-1) + FACING * beside
    return way + DEAR * (fades * near).max(axis=-1) + CONTACT * (1.0 - clear)


def best(pose, speeds, before, asked, movers, now: float, unseen: float) -> np.ndarray:
    """(b,) [m] what each command asked for (b, 2) costs, as it is better followed, among movers as
    they were seen. unseen: [m] that each [m] costs to where nobody looks, behind the robot.
    """
    movers = [expected(one, now, round(AHEAD / STEP)) for one in movers]
    places = rolled(pose, speeds, before, asked)
    ahead = (places[..., :2] - pose[:2]) @ [np.cos(pose[2]), np.sin(pose[2])]
    behind = unseen * np.maximum(0.0, -ahead.min(axis=-1))
    return (costs(places, movers) + behind).min(axis=0)


def drive(world: World, key, sight: Known | Seen) -> dict:
    """Drive from the start to the goal, or until something is touched or the time is out, with a
    new command as often as the loop; what came of it.
    """
    system, asked, command = robot(), commands(), np.zeros(2)
    driven, touched = Driven(system, START, key), False
    while driven.time < TIMEOUT and not reached(driven.pose) and not touched:
        first = len(driven.path) - 1
        around, now = [*sight.look(driven), *sight.hidden], driven.time
        costing = best(driven.pose, driven.measured, command, asked, around, now, sight.unseen)
        command = asked[np.argmin(costing)]
        driven.begin(*command)
        driven.drive(HELD)
        touched = bool(clearances(world, driven.path, system.size, first).min() <= 0)
    nearest = float(clearances(world, driven.path, system.size).min())
    return {
        "reached": reached(driven.pose) and nearest > 0,
        "seconds": round(driven.time, 2),
        "clearance": nearest,
        "cause": "nothing is proved" if nearest <= 0 else "",
    }
