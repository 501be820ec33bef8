"""The CommonRoad BMW of 29 states pulls in between two parked cars. Needs parc_jax[cars]."""

from sims.foreign.kerb.scenario import problem
from sims.foreign.kerb.study import STUDY
from sims.foreign.kerb.system import system

__all__ = ["STUDY", "problem", "system"]
