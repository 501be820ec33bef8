"""Which manoeuvre is liked: only preference, what it gets wrong costs time, never a proof."""

import numpy as np

from sims.dynabarn import plain
from sims.dynabarn.sight import Sighting


class Guidance:
    """Costs of manoeuvres from a pose (3,) with speeds (2,) among movers, as the plain planner has
    them: commands that are held on, or turn for a moment, and movers that go straight on. unseen:
    as of the sight.
    """

    def __init__(self, pose, speeds, movers: list[Sighting], now: float, unseen: float):
        self._pose, self._speeds, self._unseen = pose, speeds, unseen
        self._costs: np.ndarray | None = None
        self._around = movers, now

    def prefer(self, seen) -> np.ndarray:
        """Of an Outlook: costs (b,) [m]; of one step all are of the same commands."""
        if self._costs is None:
            before, asked = seen.k[0, 2:4], seen.k[:, -2:]
            known = self._pose, self._speeds, before, asked, *self._around, self._unseen
            self._costs = plain.best(*known)
        return self._costs
