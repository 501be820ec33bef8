"""A bar that is carried straight ahead, across its way at first, and turns: through a slot that is
narrower than it is long it fits only turned. What is true of it is known in closed form.

k = (way [m], turn [rad]): the tail goes along x, the bar turns by k_1, clockwise, during the first
half of the second. The gust adds up to GUST [m] at the end, along each axis.
"""

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import BlackBox

K = ((2.0, 0.0), (3.0, 0.5 * np.pi))
LENGTH = 0.6  # [m] from tail to nose
GUST = 0.02  # [m]
RECORDS, DT = 20, 0.05  # [s]
VARIANTS = ("", "calm")


def box(variant: str) -> BlackBox:
    """calm: no gust. Raises Refused."""
    if variant not in VARIANTS:
        raise Refused(f"bar: expected one of {', '.join(VARIANTS[1:])}; got {variant!r}.")

    def rollout(p0, k, seed):
        return _run(variant, np.asarray(p0, float), np.asarray(k, float), seed)

    return BlackBox(
        f"bar:{variant}" if variant else "bar",
        rollout,
        *K,
        n_p=2,
        dt=DT,
        records=RECORDS,
        points=("tail", "nose"),
        q=("heading [rad]",),
    )


def _run(variant: str, p0, k, seed):
    gust = GUST * np.random.default_rng(seed).uniform(-1.0, 1.0, (len(k), 2)) * (variant != "calm")
    t = np.linspace(0.0, 1.0, RECORDS + 1)[None, :]
    heading = 0.5 * np.pi - k[:, 1:] * np.minimum(1.0, 2 * t)
    tail = p0[:, None] + (t**2)[..., None] * gust[:, None]
    tail[..., 0] += t * k[:, :1]
    nose = tail + LENGTH * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return np.stack([tail, nose], axis=2), heading[:, -1:]
