"""A real Husky on a tile floor, from its log: 200 commands of 6 s, wheels that slip and stick."""

from sims.foreign.husky.job import job
from sims.foreign.husky.robot import Husky, system
from sims.foreign.husky.scenario import problem

__all__ = ["Husky", "job", "problem", "system"]
