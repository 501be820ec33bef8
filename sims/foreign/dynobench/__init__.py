"""Dynobench's unicycles and its car with a trailer, in its scenes: park, kink, bugtrap. Needs a
Python of its own: `process.py`.
"""

from sims.foreign.dynobench.scenario import problem
from sims.foreign.dynobench.study import STUDY
from sims.foreign.dynobench.system import system

__all__ = ["STUDY", "problem", "system"]
