"""Hard caps of one enumeration: they end in a message, not in swap."""

import os
import time

from parc_jax.errors import BudgetError
from parc_jax.pwa.complex import Complex

ROOM = 4  # peak memory of the next cut and of the finished table, per byte held now (measured: 1.5 to 2.6)


class Budget:
    """Caps on regions, seconds and bytes, checked after every cut; seconds also between exact evaluations."""

    def __init__(self, regions: int, seconds: float, memory: int | None, n_columns: int):
        self.regions, self.seconds, self.n_columns = regions, seconds, n_columns
        self.memory = memory if memory is not None else _half_of_the_machine()
        self.start, self.column, self.found = time.perf_counter(), 0, 1

    def check(self, lattice: Complex, column: int) -> None:
        """Called when `column` hyperplanes are cut. Raises BudgetError."""
        self.column, self.found = column, lattice.n_cells
        if self.found > self.regions:
            self._stop(f"more than max_regions = {self.regions} regions")
        if ROOM * lattice.nbytes > self.memory:
            self._stop(f"may need more than max_bytes = {self.memory} ({ROOM} x {lattice.nbytes} held)")
        self.check_time()

    def check_time(self) -> None:
        """Raises BudgetError when the time is up."""
        if time.perf_counter() - self.start > self.seconds:
            self._stop(f"more than max_seconds = {self.seconds:g} s")

    def _stop(self, why: str) -> None:
        raise BudgetError(
            f"enumerate_regions: {why}, with {self.column} of {self.n_columns} hyperplanes cut, {self.found} regions, "
            f"{time.perf_counter() - self.start:.1f} s. Nothing is returned, since a part would not cover the domain. "
            "Shrink the domain or the network, raise the cap, or march through the regions you need."
        )


def _half_of_the_machine() -> int:
    if not hasattr(os, "sysconf"):  # Windows
        return 4 << 30
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
