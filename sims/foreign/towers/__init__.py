"""JSBSim's Cessna 172P climbs and turns between two rows of towers, in turbulence. Needs
parc_jax[flight].
"""

from sims.foreign.towers.scenario import problem
from sims.foreign.towers.study import STUDY
from sims.foreign.towers.system import system

__all__ = ["STUDY", "problem", "system"]
