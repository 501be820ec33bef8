"""The published decisions with LPs: one per Omega, one per avoid set for emptiness, one per avoid
set and sample.
"""

import enum

import numpy as np

from parc_jax.common.lp.status import LPStatus
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.neuralparc.answer import Tally
from parc_jax.neuralparc.bas import avoid_set, within_reach
from parc_jax.neuralparc.brs import ReachSet, reach_set
from parc_jax.neuralparc.cells import Cell
from parc_jax.neuralparc.scene import PaperScene
from parc_jax.neuralparc.sets.ahpolytope import AHPolytope
from parc_jax.neuralparc.sets.membership import find_point, membership


class Fault(enum.Enum):
    """Faults of published code that a caller may ask for, for parity. Each makes the answer
    "assumed".
    """

    TROUBLE_IS_SAFE = "an undecided LP counts as empty or not contained [A5]"
    START_BEFORE_HULL = "starts outside P0 are cut off before the hull is taken [A6]"


def reach_by_lp(cell: Cell, scene: PaperScene) -> ReachSet:
    """Omega of one cell."""
    goal = HPolytope(scene.goals.A, scene.goals.b[cell.bin])
    return reach_set(cell, goal, scene.goal_box, scene.start, scene.n_p)


def avoid_by_lp(
    cell: Cell, reach: ReachSet, scene: PaperScene, faults: frozenset[Fault], tally: Tally
) -> list[AHPolytope]:
    """Avoid sets of one cell, all intervals and obstacles, less those proved disjoint from the
    shadow of its Omega.
    """
    start = scene.start if Fault.START_BEFORE_HULL in faults else None
    kept = []
    for t, j in np.argwhere(scene.grown.active.T).tolist():
        avoid = avoid_set(cell, scene.grown.at(int(cell.bin), t, j), t, start)
        tally.avoid_sets += 1
        if _proved(find_point(within_reach(avoid, reach)).status, faults, tally):
            tally.avoid_empty += 1
        else:
            kept.append(avoid)
    return kept


def safe_by_lp(
    p0: np.ndarray, avoid_sets: list[AHPolytope], faults: frozenset[Fault], tally: Tally
) -> np.ndarray:
    """Which starts p0 (s, n_p) are proved outside every avoid set: (s,) bool."""
    safe = np.ones(len(p0), bool)
    for i, x in enumerate(p0):
        safe[i] = all(_proved(membership(avoid, x).status, faults, tally) for avoid in avoid_sets)
    return safe


def _proved(status: LPStatus, faults: frozenset[Fault], tally: Tally) -> bool:
    """Only a proof says empty or outside, unless the fault [A5] was asked for."""
    undecided = status is LPStatus.UNKNOWN
    tally.unknown += undecided
    assumed = undecided and Fault.TROUBLE_IS_SAFE in faults
    return status is LPStatus.INFEASIBLE or assumed
