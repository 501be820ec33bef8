"""The published decisions with LPs: one per Omega, one per avoid set for emptiness, one per avoid set and sample."""

import enum
from collections.abc import Iterator

import numpy as np

from parc_jax.avoid.bas import avoid_set, within_reach
from parc_jax.avoid.paper_scene import PaperScene
from parc_jax.avoid.tally import Tally
from parc_jax.lp.status import LPStatus
from parc_jax.reach.brs import ReachSet, reach_set
from parc_jax.reach.pieces import Piece
from parc_jax.sets.ahpolytope import AHPolytope
from parc_jax.sets.emptiness import find_point
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.sets.membership import membership


class Fault(enum.Enum):
    """Faults of published code that a caller may ask for, for parity. Each makes the answer "assumed"."""

    TROUBLE_IS_SAFE = "an undecided LP counts as empty or not contained (A5)"
    START_BEFORE_HULL = "starts outside P0 are cut off before the hull is taken (A6)"


def reach_by_lp(piece: Piece, scene: PaperScene) -> ReachSet:
    """Omega of one piece."""
    goal = HPolytope(scene.goals.A, scene.goals.b[piece.bin])
    return reach_set(piece, goal, scene.goal_box, scene.start, scene.n_p)


def avoid_by_lp(
    piece: Piece, reach: ReachSet, scene: PaperScene, faults: frozenset[Fault], tally: Tally
) -> list[AHPolytope]:
    """Avoid sets of one piece, all intervals and obstacles, less those proved disjoint from the shadow of its Omega."""
    return list(_not_empty(piece, reach, scene, faults, tally))


def safe_by_lp(p0: np.ndarray, avoid_sets: list[AHPolytope], faults: frozenset[Fault], tally: Tally) -> np.ndarray:
    """Which starts p0 (s, n_p) are proved outside every avoid set: (s,) bool."""
    return np.array(
        [all(_proved(membership(avoid, x).status, faults, tally) for avoid in avoid_sets) for x in p0], dtype=bool
    )


def _not_empty(piece, reach, scene: PaperScene, faults, tally: Tally) -> Iterator[AHPolytope]:
    start = scene.start if Fault.START_BEFORE_HULL in faults else None
    for t, j in zip(*np.nonzero(scene.grown.active.T), strict=True):
        avoid = avoid_set(piece, scene.grown.at(int(piece.bin), int(t), int(j)), int(t), start)
        tally.avoid_sets += 1
        if _proved(find_point(within_reach(avoid, reach)).status, faults, tally):
            tally.avoid_empty += 1
        else:
            yield avoid


def _proved(status: LPStatus, faults: frozenset[Fault], tally: Tally) -> bool:
    """Only a proof says empty or outside, unless the fault A5 was asked for."""
    tally.unknown += status is LPStatus.UNKNOWN
    return status is LPStatus.INFEASIBLE or (status is LPStatus.UNKNOWN and Fault.TROUBLE_IS_SAFE in faults)
