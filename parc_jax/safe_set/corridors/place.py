"""A place to draw from instead of everywhere: a slanted box in the space of ends and parameters, or
of parameters alone where all plans have one start.
"""

from typing import NamedTuple

import numpy as np

ROOM = 0.25  # of its sides that a box around some points is longer, at either end
LEAST_ROOM = 1e-9  # [sides of the whole] the same, at least


class Place(NamedTuple):
    """All middle + axes u with |u_i| <= 1, in the space of (z, k), predicted ends of the first
    point and parameters, or of k. middle (n,), axes (n, n) in columns; n = n_p + n_k, or n_k.
    """

    middle: np.ndarray
    axes: np.ndarray

    @property
    def volume(self) -> float:
        """In units of p0 and k multiplied."""
        return float(2.0 ** len(self.middle) * abs(np.linalg.det(self.axes)))

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners lo, hi (n,) of the box around it."""
        half = np.abs(self.axes).sum(axis=1)
        return self.middle - half, self.middle + half

    def draw(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """(n, n_p + n_k) or (n, n_k) uniform."""
        return self.middle + rng.uniform(-1, 1, (n, len(self.middle))) @ self.axes.T


def place_around(x: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> Place:
    """A place around points x (b, n), with room, along their principal axes when the sides of the
    whole box lo, hi (n,) have length one.
    """
    sides = np.where(hi > lo, hi - lo, 1.0)
    unit = (x - x.mean(axis=0)) / sides
    _, _, directions = np.linalg.svd(unit, full_matrices=True)
    along = unit @ directions.T
    least, most = along.min(axis=0), along.max(axis=0)
    half = 0.5 * (most - least) * (1 + 2 * ROOM) + LEAST_ROOM
    middle = 0.5 * (least + most) @ directions
    return Place(x.mean(axis=0) + sides * middle, sides[:, None] * directions.T * half)
