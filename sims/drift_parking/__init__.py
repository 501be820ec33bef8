"""Drift parallel parking: a car that accelerates, is thrown into a drift and brakes into a gap."""

from sims.drift_parking.scenario import BODIES, problem
from sims.drift_parking.study import STUDY
from sims.drift_parking.system import DriftParking, system

__all__ = ["BODIES", "STUDY", "DriftParking", "problem", "system"]
