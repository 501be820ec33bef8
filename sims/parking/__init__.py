"""A car parks in TPCAP's cases, proved; `--case 7`.

The parking competition of IEEE ITSC 2022, with its car as a black box (LICENSE.txt has its notice).
"""

from sims.parking.car import system
from sims.parking.cases import Case, case, case_of, numbers
from sims.parking.job import job

__all__ = ["Case", "case", "case_of", "job", "numbers", "system"]
