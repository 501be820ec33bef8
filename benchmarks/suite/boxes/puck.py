"""A puck that is pushed and slides straight for a second, in a gust; what is true of it is known in
closed form. Its variants are traps.

k = (x, y) [m], where it would end from the origin. Beyond 2.5 m the push slips: it gains 0.4 m for
every metre. So the push is piecewise affine, and the gust adds up to GUST [m] along each axis.
"""

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import BlackBox, toy

K = ((1.0, -1.0), (3.0, 1.0))
SLIPS, GAIN = 2.5, 0.4  # [m] asked for, beyond which a metre brings so much
GUST = 0.03  # [m] at most at the end, along each axis
RECORDS, DT = 20, 0.05  # [s]
JUMP, JUMPS, FAST = 0.6, 1e-3, 2.0  # [m] sideways, how often, for pushes beyond [m]
CASTER, SWINGS = 0.4, 0.02  # [m] to the left, how often,
GENTLE, LEFT = 1.4, 0.8  # for pushes ahead of less, to the left of more [m]: a corner of K
SLOPE = 0.25  # [m] that the start moves the end
VARIANTS = ("", "calm", "jumps", "hidden", "sparse", "slope")
CHANCES = {"jumps": JUMPS, "hidden": SWINGS}


def pushed(k: np.ndarray) -> np.ndarray:
    """Where k (n, 2) would bring it (n, 2) [m] without a gust."""
    x, y = k.T
    return np.stack([np.minimum(x, SLIPS + GAIN * (x - SLIPS)), y], axis=1)


def box(variant: str) -> BlackBox:
    """calm: no gust. jumps: one fast run in a thousand is thrown aside halfway. hidden: a caster
    that nobody sees swings out in a fiftieth of the runs of a corner of K, which holds a fiftieth
    of K. sparse: a quarter of a second between records. slope: where it starts bends where it ends.
    Raises Refused.
    """
    if variant not in VARIANTS:
        raise Refused(f"puck: expected one of {', '.join(VARIANTS[1:])}; got {variant!r}.")
    fine = 5 if variant == "sparse" else 1
    return toy(
        f"puck:{variant}" if variant else "puck",
        3,
        lambda p0, k, u: _run(variant, p0, k, u),
        n_even=2,
        chance=CHANCES.get(variant),
        k_lo=K[0],
        k_hi=K[1],
        n_p=2,
        dt=DT * fine,
        records=RECORDS // fine,
        fine=fine,
        speed=2.8 if variant == "sparse" else None,
    )


def _run(variant: str, p0, k, u):
    n = len(k)
    gust = GUST * (2 * u[:, :2] - 1) * (variant != "calm")
    t = np.linspace(0.0, 1.0, RECORDS + 1)[None, :, None]
    p = p0[:, None] + t * pushed(k)[:, None] + t**2 * gust[:, None]
    if variant == "jumps":
        thrown = (k[:, 0] > FAST) & (u[:, 2] < JUMPS)
        p[thrown, RECORDS // 2 :, 1] += JUMP
    if variant == "hidden":
        swung = (k[:, 0] < GENTLE) & (k[:, 1] > LEFT) & (u[:, 2] < SWINGS)
        p[..., 1] += np.where(swung, CASTER, 0.0)[:, None] * t[..., 0] ** 2
    if variant == "slope":
        p[..., 1] += SLOPE * np.sin(2 * p0[:, :1]) * t[..., 0] ** 2
    return p[:, :, None], np.empty((n, 0))
