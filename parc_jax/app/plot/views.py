"""The sides that a workspace is seen from: one in the plane, three in space."""

from typing import NamedTuple

import numpy as np


class View(NamedTuple):
    """name: where one looks from. axes: the two coordinates that one sees."""

    name: str
    axes: tuple[int, int]

    def of(self, places: np.ndarray) -> np.ndarray:
        """What is seen (..., 2) of places or widths (..., n_p)."""
        return places[..., list(self.axes)]

    def of_points(self, columns: np.ndarray, n_p: int) -> np.ndarray:
        """What is seen (..., m, 2) of the columns (..., m n_p) of m reference points."""
        return self.of(columns.reshape(*columns.shape[:-1], -1, n_p))


TOP = View("from above", (0, 1))
SIDE = View("from the side", (0, 2))
FRONT = View("from the front", (1, 2))


def views_of(n_p: int) -> tuple[View, ...]:
    """The views of a workspace of n_p dimensions."""
    return (TOP,) if n_p == 2 else (TOP, SIDE, FRONT)
