"""A drone carries a box through a window: a body in space that tilts as it accelerates."""

from sims.drone.scenario import problem
from sims.drone.study import STUDY
from sims.drone.system import system

__all__ = ["STUDY", "problem", "system"]
