"""A bar that is carried straight ahead, across its way at first, and turns: through a slot that is
narrower than it is long it fits only turned. What is true of it is known in closed form.

k = (way [m], turn [rad]): the tail goes along x, the bar turns by k_1, clockwise, during the first
half of the second. The gust adds up to GUST [m] at the end, along each axis.
"""

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import BlackBox, toy

K = ((2.0, 0.0), (3.0, 0.5 * np.pi))
LENGTH = 0.6  # [m] from tail to nose
GUST = 0.02  # [m]
RECORDS, DT = 20, 0.05  # [s]
VARIANTS = ("", "calm")


def box(variant: str) -> BlackBox:
    """calm: no gust. Raises Refused."""
    if variant not in VARIANTS:
        raise Refused(f"bar: expected one of {', '.join(VARIANTS[1:])}; got {variant!r}.")

    return toy(
        f"bar:{variant}" if variant else "bar",
        2,
        lambda p0, k, u: _run(variant, p0, k, u),
        n_even=2,
        k_lo=K[0],
        k_hi=K[1],
        n_p=2,
        dt=DT,
        records=RECORDS,
        points=("tail", "nose"),
        q=("heading [rad]",),
    )


def _run(variant: str, p0, k, u):
    gust = GUST * (2 * u - 1) * (variant != "calm")
    t = np.linspace(0.0, 1.0, RECORDS + 1)[None, :]
    heading = 0.5 * np.pi - k[:, 1:] * np.minimum(1.0, 2 * t)
    tail = p0[:, None] + (t**2)[..., None] * gust[:, None]
    tail[..., 0] += t * k[:, :1]
    nose = tail + LENGTH * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return np.stack([tail, nose], axis=2), heading[:, -1:]
