"""crazyflow's Crazyflie dives through an inclined slot that it does not fit through while level."""

from sims.foreign.slot.scenario import problem
from sims.foreign.slot.study import STUDY
from sims.foreign.slot.system import system

__all__ = ["STUDY", "problem", "system"]
