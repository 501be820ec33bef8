"""A sled that is pushed twice, after a delay that nobody sees the second time; it slips sideways by
more the faster it goes, now and then by much more, and in one run of fifty a runner sticks.

k = (x, y) of the first push and (x, y) of the second [m], each of a second.
"""

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import BlackBox, toy

K = ((0.5, -0.6, 0.2, -0.6), (1.2, 0.6, 1.0, 0.6))
DELAY = 0.15  # [s] at most, before the second push
SLIP = 0.012  # [m] sideways for a metre ahead, times a number with heavy tails
STICKS, STUCK = 0.02, 0.15  # how often; of the second push, which is lost
RECORDS, DT = 20, 0.1  # [s]
ENDS = 1e-3  # of the spread is left out at either end


def box(variant: str) -> BlackBox:
    """It has no variants. Raises Refused."""
    if variant:
        raise Refused(f"sled: expected no variant; got {variant!r}.")
    about = {"k_lo": K[0], "k_hi": K[1], "n_p": 2, "dt": DT, "records": RECORDS}
    return toy("sled", 3, _run, n_even=2, chance=STICKS, **about)


def spread(u: np.ndarray) -> np.ndarray:
    """A Student's t of three degrees of freedom at the quantiles u, without its ends."""
    u = np.clip(u, ENDS, 1 - ENDS)
    low, high = np.full(u.shape, -0.5 * np.pi), np.full(u.shape, 0.5 * np.pi)
    for _ in range(50):  # u = 1/2 + (a + sin a cos a) / pi where x = sqrt(3) tan a
        a = 0.5 * (low + high)
        below = 0.5 + (a + np.sin(a) * np.cos(a)) / np.pi < u
        low, high = np.where(below, a, low), np.where(below, high, a)
    return np.sqrt(3.0) * np.tan(low)


def _run(p0, k, u):
    t = np.linspace(0.0, RECORDS * DT, RECORDS + 1)[None, :, None]
    late = (DELAY * u[:, 0])[:, None, None]
    first = np.clip(t, 0.0, 1.0) * k[:, None, :2]
    lost = np.where(u[:, 2] < STICKS, 1 - STUCK, 1.0)[:, None, None]
    second = np.clip(t - 1.0 - late, 0.0, 1.0) * lost * k[:, None, 2:]
    p = p0[:, None] + first + second
    ahead = p[..., 0] - p0[:, :1]
    p[..., 1] += SLIP * spread(u[:, 1])[:, None] * ahead
    return p[:, :, None], np.empty((len(k), 0))
