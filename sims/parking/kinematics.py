"""Manoeuvres k = (way [m], steering first and last as shares) of a car without lags and errors; all
of the way, what it takes to stop included.
"""

import numpy as np

from sims.parking import car as c

# no farther to the edges of K than this: few runs come from there, so the network is worst there
LONGEST, MOST = 0.97 * c.WAY, 0.9  # [m], and share of the steering
# [m, rad] from a target: there; near enough to stop; and too far after 4 of 8 steps
THERE, SURELY, HOPELESS = 0.003, 3e-4, 0.1
PARTS = 16  # arcs of which a way is made, at least
UPTO = c.LEAVE / c.SHARES  # share of the way from whose end on the car may roll into the next one
SAMPLED = 0.3  # [m] of way between poses that are looked at
# [rad] by which wheels may be wrong where the car begins to drive from rest, on so long a way [m]
UNTURNED, FREE = 0.5, 3.0


def ends(k: np.ndarray, n: int = 1, upto=1.0) -> np.ndarray:
    """(b, n, 3) where the rear axle is after 1 / n, ..., n / n of a share of the way of manoeuvres
    k (b, 3) from the origin. upto: the share, of all or (b,).
    """
    parts = n * int(np.ceil(PARTS / n))
    first, last = steering(k)
    share = (np.arange(parts) + 0.5) / parts * np.reshape(upto, (-1, 1))
    step = k[:, :1] / parts * np.reshape(upto, (-1, 1))
    turn = step * np.tan(first[:, None] + (last - first)[:, None] * share) / c.WHEELBASE
    heading = np.cumsum(turn, axis=1)
    middle = heading - 0.5 * turn
    chord = step * (1.0 - turn**2 / 24)  # of an arc that turns little: off by its turn^4 / 1920
    x, y = (
        np.cumsum((chord * side).reshape(len(k), n, parts // n).sum(axis=2), axis=1)
        for side in (np.cos(middle), np.sin(middle))
    )
    return np.stack([x, y, heading[:, parts // n - 1 :: parts // n]], axis=-1)


def steering(k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(b,) [rad] first and last of manoeuvres k (b, 3)."""
    most = c.most_steering(k[:, 0])
    return most * k[:, 1], most * k[:, 2]


def leaves(k: np.ndarray, rolls_on: np.ndarray) -> np.ndarray:
    """(b,) [rad] of the wheels where manoeuvres k (b, 3) end, or where the car rolls on."""
    first, last = steering(k)
    return np.where(rolls_on, first + (last - first) * UPTO, last)


def backwards(k: np.ndarray) -> np.ndarray:
    """Manoeuvres (b, 3) that lead back from where k (b, 3) lead."""
    return k[:, [0, 2, 1]] * [-1, 1, 1]


def standing(turned, way):
    """Share of a turn of the wheels [rad] for which the car stands before a way [m]."""
    return 1.0 - np.minimum(
        1.0, UNTURNED * np.minimum(1.0, np.abs(way) / FREE) / np.maximum(np.abs(turned), 1e-9)
    )


def stand(turned, way):
    """[s] that the car stands while its wheels turn by so much [rad], before a way [m]."""
    return standing(turned, way) * (np.abs(turned) / (c.MARGIN * c.RATE) + c.SETTLE)


def compose(pose: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Poses (..., 3) after moves (..., 3) that are told from a pose (..., 3)."""
    cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y, turned = np.moveaxis(move, -1, 0)
    return np.stack(
        [pose[..., 0] + cos * x - sin * y, pose[..., 1] + sin * x + cos * y, pose[..., 2] + turned],
        axis=-1,
    )


def offset_from(pose: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(..., 3) another pose as told from a pose, its heading within half a turn."""
    cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y = other[..., 0] - pose[..., 0], other[..., 1] - pose[..., 1]
    turned = (other[..., 2] - pose[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return np.stack([cos * x + sin * y, cos * y - sin * x, turned], axis=-1)


def seconds(k: np.ndarray, begins=0.0) -> np.ndarray:
    """(b,) [s] that manoeuvres k (b, 3) drive, brake included. begins: [m/s] at their start."""
    return planned(k, begins).lasts + c.CREEP + c.SETTLE


def rolls(k: np.ndarray, begins=0.0) -> tuple[np.ndarray, np.ndarray]:
    """(b,) [s] until the car rolls on from manoeuvres k (b, 3), and its speed [m/s] there."""
    plan = planned(k, begins)
    return c.passes(plan, UPTO * plan.way)


def planned(k: np.ndarray, begins=0.0) -> c.Plan:
    """How manoeuvres k (b, 3) are driven from a speed [m/s]."""
    first, last = steering(k)
    return c.plan_of(np.maximum(np.abs(k[:, 0]), 1e-3), last - first, begins)


def reach_exactly(
    targets: np.ndarray, k: np.ndarray, predict=ends
) -> tuple[np.ndarray, np.ndarray]:
    """Manoeuvres (b, 3) from the origin that end at targets (b, 3), near k (b, 3), by Newton's
    method; and (b,) whether they do. predict: as `ends`.
    """
    step, most = np.diag([1e-3, 1e-3, 1e-3]), np.array([LONGEST, MOST, MOST])
    k, going = k.copy(), np.arange(len(k))
    for i in range(8):
        if not len(going):
            break
        around = k[going, None] + np.concatenate([np.zeros((1, 3)), step])
        end = predict(around.reshape(-1, 3))[:, -1].reshape(-1, 4, 3)
        off = end[:, 0] - targets[going]
        wrong = np.abs(off).max(axis=1)
        some = (wrong > SURELY) & ((wrong < HOPELESS) | (i < 4))
        going, off, end = going[some], off[some], end[some]
        slope = np.moveaxis((end[:, 1:] - end[:, :1]) / 1e-3, 1, 2) + 1e-6 * np.eye(3)
        change = np.linalg.solve(slope, off[..., None])[..., 0]
        k[going] = np.clip(k[going] - np.clip(change, -0.8, 0.8), -most, most)
    off = predict(k)[:, -1] - targets
    return k, np.abs(off).max(axis=1) < THERE


def joined(
    poses: np.ndarray, others: np.ndarray, upto: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Manoeuvres (n, 3) from poses (n, 3) to others (n, 3), and (n,) whether they lead there after
    a share of their way.
    """
    target = offset_from(poses, others)
    far = np.hypot(target[:, 0], target[:, 1]) / upto
    way = np.copysign(np.maximum(far, 0.1), target[:, 0])
    near = (far < LONGEST) & (np.abs(target[:, 2]) < c.BEND)
    bend = target[:, 2] / (upto * way) * c.WHEELBASE / np.tan(c.most_steering(way))
    most = np.array([LONGEST, MOST, MOST])
    k, there = np.clip(np.stack([way, bend, bend], axis=1), -most, most), np.zeros(len(far), bool)
    k[near], there[near] = reach_exactly(target[near], k[near], lambda k: ends(k, 1, upto))
    return k, there


def samples_of(k: np.ndarray) -> np.ndarray:
    """(b,) poses that are looked at along manoeuvres k (b, 3)."""
    return np.maximum(1, np.ceil(np.abs(k[:, 0]) / SAMPLED).astype(int))
