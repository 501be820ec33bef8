"""A Clearpath Jackal, four wheels that skid, from a running start: drive on a moment, then stop."""

from sims.jackal.driven import Driven
from sims.jackal.scenario import problem
from sims.jackal.study import STUDY
from sims.jackal.system import Jackal, system

__all__ = ["STUDY", "Driven", "Jackal", "problem", "system"]
