"""Hard caps of one enumeration: they end in a message, not in swap."""

import os
import time

from parc_jax.common.errors import BudgetError
from parc_jax.proof.regions.complex import Complex

# peak memory of the next cut and of the finished table, per byte held now (measured: 1.7 to 3.7)
PEAK = 5
# faces of one dimension: a cut makes at most three of one, which 32 bits can then still count
MAX_FACES = 2**29


class Budget:
    """Caps on regions, seconds and bytes, checked after every cut; seconds also between exact
    evaluations.
    """

    def __init__(self, regions: int, seconds: float, memory: int | None, n_columns: int):
        self.regions = regions
        self.seconds = seconds
        self.memory = memory if memory is not None else _half_of_the_machine()
        self.n_columns = n_columns
        self.start = time.perf_counter()
        self.column = 0
        self.found = 1

    def check(self, lattice: Complex, column: int) -> None:
        """Called when `column` hyperplanes are cut. Raises BudgetError."""
        self.column = column
        self.found = lattice.n_cells
        if self.found > self.regions:
            self._stop(f"more than max_regions = {self.regions} regions")
        if max(lattice.count(k) for k in range(lattice.n + 1)) > MAX_FACES:
            self._stop(f"more than {MAX_FACES} faces of one dimension")
        if PEAK * lattice.nbytes > self.memory:
            self._stop(
                f"may need more than max_bytes = {self.memory} ({PEAK} x {lattice.nbytes} held)"
            )
        self.check_time()

    def check_time(self) -> None:
        """Raises BudgetError when the time is up."""
        if time.perf_counter() - self.start > self.seconds:
            self._stop(f"more than max_seconds = {self.seconds:g} s")

    def _stop(self, why: str) -> None:
        seconds = time.perf_counter() - self.start
        raise BudgetError(
            f"enumerate_regions: {why}, with {self.column} of {self.n_columns} hyperplanes cut, "
            f"{self.found} regions, {seconds:.1f} s. Nothing is returned, since a part would not "
            "cover the domain. Shrink the domain or the network, raise the cap, or march through "
            "the regions you need."
        )


def _half_of_the_machine() -> int:
    if not hasattr(os, "sysconf"):  # Windows
        return 4 << 30
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
