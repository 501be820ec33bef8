"""Results of the published search, and a verdict on every region of K: a safe plan, none found, or
a proof that the goal is out of reach.
"""

from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

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
    plans_k = [*answer.samples[:, model.n_p :], *(c.k for c in answer.corridors)]
    if answer.corridors:
        with suppress(InputError):  # too small a set for draws: the plans of the corridors remain
            plans_k += [*answer.sample(jax.random.PRNGKey(0), DRAWN)[:, model.n_p :]]
    with_plan = table.locate(np.reshape(plans_k, (len(plans_k), model.n_k)))
    verdict[with_plan[with_plan >= 0]] = OfRegion.SAFE
    if model.n_points > 1:
        return verdict
    open_regions = np.flatnonzero(verdict != OfRegion.SAFE)
    cells = [cell for i in open_regions for cell in cells_of(table, model.tube, int(i))]
    claimed = model.tube.claimed
    verdict[[int(cell.region) for cell in cells]] = OfRegion.UNREACHABLE
    without_tube = [int(cell.region) for cell in cells if not claimed[cell.bin]]
    verdict[without_tube] = OfRegion.NOT_FOUND
    judged = [cell for cell in cells if claimed[cell.bin]]
    if judged:
        goals = shrink(problem.goal, np.where(claimed[:, None], model.tube.final, 0.0))
        many = stack(judged)
        reach = reach_sets(many, goals, bounding_box(problem.goal), problem.start, model.n_p)
        verdict[many.region[reach.status != int(LPStatus.INFEASIBLE)]] = OfRegion.NOT_FOUND
    return verdict


@dataclass
class Tally:
    """Counts of a search: regions visited, and LPs that stayed undecided."""

    regions: int = 0
    unknown: int = 0


class PaperAnswer(NamedTuple):
    """Plans of the published search, safe by the region maps, read as the floats they are, inside
    the tube.

    samples: (n, n_p + n_k) starts and parameters. region: (n,) their regions. tally: counts.
    """

    samples: np.ndarray
    region: np.ndarray
    tally: Tally
