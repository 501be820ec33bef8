"""Which manoeuvre is liked: only preference, what it gets wrong costs time, never a proof."""

import numpy as np

import parc_jax as pj
from sims.dynabarn import plain

FAR = 6.0  # [m] who is farther away is left out


class Guidance:
    """Costs of manoeuvres from a pose (3,) with speeds (2,) among movers, as the plain planner has
    them: commands that are held on, movers that go straight on.
    """

    def __init__(self, pose, speeds, movers: list[pj.problem.Mover]):
        self._pose, self._speeds = pose, speeds
        self._costs: np.ndarray | None = None
        self._places = np.array([one.place for one in movers]).reshape(-1, 2)
        speed, heading = np.array([(one.k[0], one.heading) for one in movers]).reshape(-1, 2).T
        self._velocities = speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)

    def prefer(self, seen) -> np.ndarray:
        """Of an Outlook: costs (b,) [m]; of one step all are of the same commands."""
        if self._costs is None:
            rolled = plain.rolled(self._pose, self._speeds, seen.k[:, -2:])
            self._costs = plain.costs(rolled, self._places, self._velocities)
        return self._costs
