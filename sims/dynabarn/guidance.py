"""Which manoeuvre is liked: only preference, what it gets wrong costs time, never a proof."""

import numpy as np

import parc_jax as pj
from sims.dynabarn import plain
from sims.dynabarn.worlds import RADIUS

TURNS = (-2.2, -1.2, -0.5, 0.5, 1.2, 2.2)  # [rad] by which a mover may turn right now ...
SOON = 1.0  # [s] ... and what comes of it until then counts: later the robot has another choice
TURNED = 2.0  # [m] of way that a contact costs after one of these turns
CLOSE = 0.3  # [m] less clearance counts as a part of a contact
FAR = 6.0  # [m] who is farther away is left out
AHEAD = round(SOON / plain.STEP)


class Guidance:
    """Costs of manoeuvres from a pose (3,) with speeds (2,) among movers: those of the plain
    planner, commands that are held on and movers that go straight on, and what contacts cost with
    movers that turn right now.
    """

    def __init__(self, pose, speeds, movers: list[pj.problem.Mover]):
        near = [one for one in movers if np.linalg.norm(one.place - pose[:2]) < FAR]
        self._pose, self._speeds = pose, speeds
        self._costs: np.ndarray | None = None
        self._places = np.array([one.place for one in near]).reshape(-1, 2)
        self._speed = np.array([one.k[0] for one in near])
        self._heading = np.array([one.heading for one in near])

    def _velocities(self, turn: float) -> np.ndarray:
        heading = self._heading + turn
        return self._speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)

    def of_commands(self, commands: np.ndarray) -> np.ndarray:
        """(b,) [m] of commands (b, 2)."""
        rolled = plain.rolled(self._pose, self._speeds, commands)
        found = plain.costs(rolled, self._places, self._velocities(0.0))
        times = plain.STEP * np.arange(1, AHEAD + 1)
        soon = rolled[:, :AHEAD, None, :2]
        for turn in TURNS:
            there = self._places + times[:, None, None] * self._velocities(turn)
            gap = np.linalg.norm(soon - there, axis=-1) - RADIUS - plain.INSIDE
            share = np.clip((CLOSE - gap) / CLOSE, 0.0, 1.0).max(axis=1, initial=0.0)
            found = found + TURNED * share.sum(axis=1)
        return found

    def prefer(self, seen) -> np.ndarray:
        """Of an Outlook: costs (b,); of one step all are of the same commands."""
        if self._costs is None:
            self._costs = self.of_commands(seen.k[:, -2:])
        return self._costs
