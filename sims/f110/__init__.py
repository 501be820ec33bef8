"""A 1:10 car that drifts into a parking space, learned from few runs, each different: the stand-in
for hardware.
"""

from sims.f110.disturbance import LAWS, Law
from sims.f110.job import job
from sims.f110.scenario import BODIES, problem
from sims.f110.study import STUDY
from sims.f110.system import F110, system

__all__ = ["BODIES", "F110", "LAWS", "STUDY", "Law", "film_of", "job", "problem", "system"]
