"""What a guide knows of the car: how wide its tubes are, which manoeuvres surely end in the goal,
and what of a way it can drive. Nothing (`Exact`), or what a model says (`Learned`).
"""

from itertools import product

import numpy as np

import parc_jax as pj
from sims.parking.cases import GOAL, Case
from sims.parking.kinematics import compose, offset_from
from sims.parking.predict import tube_of
from sims.parking.prove import Moving
from sims.parking.rehearse import aimed, mended
from sims.parking.space import Space
from sims.parking.way import Tried, Way, lasts

ROOMY = 0.9  # share of the goal that the tube of the last manoeuvre may take
STEERED = 0.75  # share of the steering that it may ask for: what is left corrects where it begins


class Exact:
    """A car that drives as it is told, in tubes of a width [m] all the same. aims (n, 3): poses at
    which a way in a case may end.
    """

    def __init__(self, case: Case, tube: float = 0.08):
        self.aims, self._tube = case.goal[None], tube

    def width(self, k: np.ndarray, begins: float = 0.0) -> np.ndarray:
        """(b,) [m] of the tubes of manoeuvres k (b, 3), begun at a speed [m/s], at their widest."""
        return np.full(len(k), self._tube)

    def sure(self, k: np.ndarray, aim: np.ndarray, begins: float = 0.0) -> np.ndarray:
        """(b,) whether manoeuvres k (b, 3), begun at a speed [m/s] and aimed at a pose (3,), may be
        the last.
        """
        return np.ones(len(k), bool)

    def mend(self, way: Way, pose: np.ndarray, wheels: float, space: Space) -> Tried:
        """A way from a pose (3,) at rest, and steering [rad], as the car can drive it."""
        return Tried(way, 0, lasts(way, wheels))


class Learned:
    """A car that a model knows. within: [m], [rad] from the middle of the goal to its sides.
    uncertainty: of the poses that are measured.
    """

    def __init__(self, case: Case, model, within=GOAL, uncertainty: pj.Uncertainty | None = None):
        uncertainty = uncertainty or pj.Uncertainty()
        self.model, self._goal, self._within = model, case.goal, within
        self._shift = float(np.linalg.norm(uncertainty.shifts(2)))
        self._heading = float(uncertainty.heading or 0.0)
        # a goal that is wider than GOAL leaves a choice of where in it to end
        spare = np.maximum(np.subtract(within, GOAL), 0.0)[[0, 0, 1]]
        offsets = np.unique(spare * list(product((0, -1, 1), repeat=3)), axis=0)
        self.aims = compose(case.goal, offsets)

    def width(self, k: np.ndarray, begins: float = 0.0) -> np.ndarray:
        """As of `Exact`."""
        return tube_of(self.model, k, begins)[0]

    def sure(self, k: np.ndarray, aim: np.ndarray, begins: float = 0.0) -> np.ndarray:
        """As of `Exact`: those that leave room in the goal, for their tube and for poses that are
        measured wrongly, and steering to correct.
        """
        return (self.wants(k, tube_of(self.model, k, begins)[1], aim) < 0).all(axis=1)

    def wants(self, k: np.ndarray, final: np.ndarray, aim: np.ndarray) -> np.ndarray:
        """(b, 3) [m], [rad], share of steering that manoeuvres k (b, 3), of tubes (b, 11) at rest,
        aimed at a pose (3,), lack to be sure; below 0 where they are.
        """
        off = offset_from(self._goal, aim)
        place = np.hypot(final[:, 0], final[:, 1]) + self._shift + self._heading * np.abs(k[:, 0])
        steered = np.abs(k[:, 1:]).max(axis=1)
        turned = final[:, -1] + self._heading
        room, turn = self._within[0] - np.abs(off[:2]).max(), self._within[1] - abs(off[2])
        return np.stack([place - ROOMY * room, turned - ROOMY * turn, steered - STEERED], axis=1)

    def mend(self, way: Way, pose: np.ndarray, wheels: float, space: Space) -> Tried:
        """As of `Exact`, as the network leads along it."""
        return mended(
            way, Moving(pose, wheels), self.model, lambda *at: aimed(self.model, space, *at)
        )


Known = Exact | Learned
