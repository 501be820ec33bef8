"""A heading within an angle: maps of the plane whose mixtures are all its turns. [T22]"""

from typing import NamedTuple

import numpy as np


class Turn(NamedTuple):
    """maps (R, n_p, n_p): every turn by at most the angle is a mixture of them, for all vectors
    alike. sine: at least that of the angle. of_q (n_q,): what the other goal states turn by.
    """

    maps: np.ndarray
    sine: float
    of_q: np.ndarray

    def widened(self, widths: np.ndarray) -> np.ndarray:
        """Half widths (..., n_p) of errors that turn too."""
        if not self.sine:
            return widths
        return widths + self.sine * widths[..., ::-1]


def no_turn(n_p: int, n_q: int) -> Turn:
    """The heading is known."""
    return Turn(np.eye(n_p)[None], 0.0, np.zeros(n_q))
