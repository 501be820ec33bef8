"""What the published search found, with counts and times gathered while it ran.

What is known of every region of K: a safe plan, none found, or a proof that the goal is out of
reach.
"""

import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.lp.program import LPStatus
from parc_jax.common.sets.bounding_box import bounding_box
from parc_jax.common.status import OfRegion
from parc_jax.neuralparc.brs import reach_sets
from parc_jax.neuralparc.cells import cells_of, stack
from parc_jax.neuralparc.sets.operations import shrink
from parc_jax.proof.regions.table import RegionTable

DRAWN = 2048  # plans of the corridors


def region_verdicts(answer, table: RegionTable) -> np.ndarray:
    """Verdict (r,) of each region of a table of the answer's network, as `OfRegion`.

    SAFE: a returned sample lies in it, the plan of a corridor, or one drawn from all. UNREACHABLE:
    the backward reachable set is proved empty in every bin of the tube that the region meets, which
    is tried for robots of one reference point only. NOT_FOUND: neither. Raises InputError.
    """
    model, problem = answer.model, answer.problem
    if table.net.hash != model.net.hash:
        raise InputError(
            "regions: expected the regions of the answer's network; these belong to another one."
        )
    verdict = np.full(table.count, int(OfRegion.NOT_FOUND))
    known = [*answer.samples[:, model.n_p :], *(c.k for c in answer.corridors)]
    if answer.corridors:
        with suppress(InputError):  # too small a set for draws: the plans of the corridors remain
            known += [*answer.sample(jax.random.PRNGKey(0), DRAWN)[:, model.n_p :]]
    found = table.locate(np.reshape(known, (len(known), model.n_k)))
    verdict[found[found >= 0]] = OfRegion.SAFE
    if model.n_points > 1:
        return verdict
    cells = []
    for region in np.flatnonzero(verdict != OfRegion.SAFE):
        cells += cells_of(table, model.tube, int(region))
    claimed = model.tube.claimed
    verdict[[int(cell.region) for cell in cells]] = OfRegion.UNREACHABLE
    verdict[[int(cell.region) for cell in cells if not claimed[cell.bin]]] = (
        OfRegion.NOT_FOUND  # no tube, nothing proved
    )
    judged = [cell for cell in cells if claimed[cell.bin]]
    if judged:
        goals = shrink(problem.goal, np.where(claimed[:, None], model.tube.final, 0.0))
        many = stack(judged)
        reach = reach_sets(many, goals, bounding_box(problem.goal), problem.start, model.n_p)
        verdict[many.region[reach.status != int(LPStatus.INFEASIBLE)]] = OfRegion.NOT_FOUND
    return verdict


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
