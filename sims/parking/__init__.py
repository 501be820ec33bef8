"""TPCAP's parking cases, and the competition's car as a black box."""

from sims.parking.car import system
from sims.parking.cases import Case, case, case_of, numbers

__all__ = ["Case", "case", "case_of", "numbers", "system"]
