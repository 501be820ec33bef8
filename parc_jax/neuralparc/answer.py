"""What the published search found, with counts and times gathered while it ran."""

import time
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Tally:
    """What a search did.

    regions, reachable: regions visited, and those with a non-empty Omega.
    avoid_sets, avoid_empty: avoid sets of the reachable cells, and those pruned as empty.
    unknown: LPs that stayed undecided.
    seconds: wall time by part: "reach", "avoid", "samples", "check".
    """

    regions: int = 0
    reachable: int = 0
    avoid_sets: int = 0
    avoid_empty: int = 0
    unknown: int = 0
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def timed(self, part: str):
        """Add the wall time of a block to one part."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[part] = self.seconds.get(part, 0.0) + time.perf_counter() - begin


@dataclass(frozen=True)
class PaperAnswer:
    """What the published search found.

    samples: (n, n_p + n_k) starts and parameters, safe for the model inside the tube.
    region: (n,) their regions.
    label: "model" (safe by the region maps, read as the floats they are) or "assumed" (a fault was
        asked for).
    tally: counts and times.
    """

    samples: np.ndarray
    region: np.ndarray
    label: str
    tally: Tally
