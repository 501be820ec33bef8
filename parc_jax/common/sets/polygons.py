"""Corners of many polygons at once, in float64, where it is known how far off they are.

Where two rows that follow one another meet at a small angle, or one cuts nothing off, nothing is
said of a polygon: exact arithmetic (`rational`) is asked then.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from parc_jax.common.sets.hpolytope import HPolytope

SINE = 0.05  # least of an angle at which two rows meet
# [largest coordinate] a corner may be off by: few roundings, divided by the least sine
OFF = 2.0**-44


def corners_of_many(polygons: Sequence[HPolytope]) -> list[np.ndarray | None]:
    """Corners (h, 2) of each polygon, counter-clockwise, all within OFF of its exact ones and none
    of these farther outside of their hull; None where exact arithmetic has to tell them, and for
    sets in space. A polygon with corners is bounded.
    """
    out: list[np.ndarray | None] = [None] * len(polygons)
    for some, A, b in alike(polygons):
        if A.shape[1] < 3 or A.shape[2] != 2:
            continue
        corners, known = _corners(A, b)
        for i, own, sure in zip(some, corners, known, strict=True):
            out[i] = own if sure else None
    return out


def alike(polytopes: Sequence[HPolytope]) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Those that have as many rows as one another: their numbers (m,), A (m, h, n), b (m, h)."""
    rows = np.array([len(p.b) for p in polytopes], int)
    for h in np.unique(rows):
        some = np.flatnonzero(rows == h)
        yield (
            some,
            np.stack([polytopes[i].A for i in some]),
            np.stack([polytopes[i].b for i in some]),
        )


def _corners(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (m, h, 2) of polygons A (m, h, 2), b (m, h), and of which they are known."""
    length = np.hypot(A[..., 0], A[..., 1])
    normal = A / length[..., None]
    order = np.argsort(np.arctan2(normal[..., 1], normal[..., 0]), axis=1, kind="stable")
    normal = np.take_along_axis(normal, order[..., None], axis=1)
    offset = np.take_along_axis(b / length, order, axis=1)
    following = np.roll(normal, -1, axis=1)
    bound = np.roll(offset, -1, axis=1)
    sine = normal[..., 0] * following[..., 1] - normal[..., 1] * following[..., 0]
    known = (sine > SINE).all(axis=1)
    divisor = np.where(sine > SINE, sine, 1.0)
    x = (offset * following[..., 1] - bound * normal[..., 1]) / divisor
    y = (bound * normal[..., 0] - offset * following[..., 0]) / divisor
    heights = normal[..., 0, None] * x[:, None] + normal[..., 1, None] * y[:, None]
    size = np.abs([x, y]).max(axis=(0, 2))
    inside = heights <= (offset + OFF * size[:, None])[..., None]
    return np.stack([x, y], axis=-1), known & inside.all(axis=(1, 2)) & np.isfinite(size)
