"""A way of the car: manoeuvres one after another, and when it is where."""

from typing import NamedTuple

import numpy as np

from sims.parking import car as c
from sims.parking.kinematics import UPTO, leaves, rolls, seconds, stand, steering


class Way(NamedTuple):
    """Manoeuvres k (n, 3): way, steering first and last; poses (n + 1, 3) where they begin and end.
    rolls_on (n,): does the car roll on from each into the next? stands (n,): share of the turn of
    its wheels for which it stands where it begins at rest, if that was chosen.
    """

    k: np.ndarray
    poses: np.ndarray
    rolls_on: np.ndarray
    stands: np.ndarray | None = None

    @property
    def upto(self) -> np.ndarray:
        """(n,) of each manoeuvre the share that is driven."""
        return np.where(self.rolls_on, UPTO, 1.0)

    def stopped(self, i: int) -> "Way":
        """The way on which the car rests after manoeuvre number i, where it rolled on."""
        k, rolls_on = self.k.copy(), self.rolls_on.copy()
        (size, first, last), rolls_on[i] = k[i], False
        share = c.most_steering(size) / c.most_steering(size * UPTO)
        k[i] = size * UPTO, share * first, share * (first + (last - first) * UPTO)
        return self._replace(k=k, rolls_on=rolls_on)


class Tried(NamedTuple):
    """A way as the car can drive it, how many of its manoeuvres it may not, and [s] that it takes,
    the wheels turned at rest as long as each manoeuvre asks for.
    """

    way: Way
    fails: int
    takes: float


def moments(way: Way, wheels: float) -> np.ndarray:
    """(n + 1,) [s] about, when a way passes its poses, from rest, its wheels [rad] there."""
    turned = steering(way.k)[0] - np.concatenate([[wheels], leaves(way.k, way.rolls_on)[:-1]])
    rolled, begins = np.concatenate([[False], way.rolls_on[:-1]]), 0.0
    each = []
    for k, begun, on in zip(way.k[:, None], rolled, way.rolls_on, strict=True):
        begins = begins if begun else 0.0
        (took,), (speed,) = rolls(k, begins)
        each.append(took if on else seconds(k, begins)[0])
        begins = speed
    stood = np.where(rolled, 0.0, stand(turned, way.k[:, 0]))
    return np.concatenate([[0.0], np.cumsum(stood + each)])


def lasts(way: Way, wheels: float) -> float:
    """[s] about, that a way takes from rest, its wheels [rad] there."""
    return float(moments(way, wheels)[-1])
