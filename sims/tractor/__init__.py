"""A tractor pulls a trailer round a corner into a bay: a body of two parts that turn against each
other.
"""

from sims.tractor.scenario import problem
from sims.tractor.study import STUDY
from sims.tractor.system import system

__all__ = ["STUDY", "problem", "system"]
