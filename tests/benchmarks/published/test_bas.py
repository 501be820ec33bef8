"""Published avoid sets: LPs and supports agree, and the chain exact collision < joint hull <
projection holds. [T13]
"""

import numpy as np
import pytest
from gap_model import arc_tube, gap_problem, gap_table
from set_oracles import memberships

from benchmarks.neuralparc.by_lp import avoid_set, joint_avoid_set
from benchmarks.neuralparc.by_support import margins, shadows
from benchmarks.neuralparc.cells import cells_outward, stack
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.scene import grown_polytopes
from benchmarks.neuralparc.sets.affine import membership

T, BAND = 4, 1e-7
TUBE = arc_tube(T, (2, 1))
GROWN = grown_polytopes(gap_problem(2.0), TUBE)
CELLS = [p for region in cells_outward(gap_table(T), TUBE, np.array([5.0, 0.0])) for p in region]


def starts_near(rng, cell, t, obstacle, count):
    """Starts about the avoid set of interval t: obstacle minus the offset, and around."""
    C, d = cell.knot(t, 2)
    return (
        GROWN.corners[obstacle].mean(axis=0)
        - C @ cell.vertices.mean(axis=0)
        - d
        + rng.uniform(-3, 3, (count, 2))
    )


def one_by_one(s, x):
    return np.array([int(membership(s, q).status) for q in x])


def disagreements(rng, cells, count, decide=one_by_one):
    """(wrong verdicts, inside, in band) of LP membership against supports over all intervals and
    obstacles.
    """
    polygons, wrong, inside, band = shadows(stack(cells), GROWN), 0, 0, 0
    for i, cell in enumerate(cells):
        for t in range(T):
            for obstacle in range(2):
                x = starts_near(rng, cell, t, obstacle, count)
                all_starts = np.zeros((len(cells), count, 2))
                all_starts[i] = x
                margin = margins(polygons, all_starts)[i, :, t, obstacle]
                status = decide(avoid_set(cell, GROWN.at(int(cell.bin), t, obstacle), t), x)
                near = np.abs(margin) < BAND
                wrong += int(((status == LPStatus.INFEASIBLE) != (margin > 0))[~near].sum())
                wrong += int((status == LPStatus.UNKNOWN)[~near].sum())
                inside, band = (
                    inside + int((status == LPStatus.FEASIBLE).sum()),
                    band + int(near.sum()),
                )
    return wrong, inside, band


@pytest.mark.slow
def test_lp_and_supports_agree(rng):
    wrong, inside, _ = disagreements(rng, CELLS[:2], 24)
    assert wrong == 0 and 30 < inside < 350


@pytest.mark.night
@pytest.mark.soundness
def test_lp_and_supports_agree_on_a_hundred_thousand_points(rng):
    wrong, inside, band = disagreements(rng, CELLS[:13], 1000, memberships)
    assert wrong == 0 and inside > 10_000 and band < 100


@pytest.mark.soundness
def test_collisions_are_in_the_joint_hull_and_that_in_the_projection(rng):
    """Points (p0, k) whose swept prediction meets the grown obstacle, and others; [T13] (i) in both
    inclusions.
    """
    seen = []
    for cell in CELLS[:4]:
        for t, obstacle in ((2, 0), (3, 1)):
            grown = GROWN.at(int(cell.bin), t, obstacle)
            joint, workspace = joint_avoid_set(cell, grown, t), avoid_set(cell, grown, t)
            k = rng.dirichlet(np.ones(len(cell.vertices)), 24) @ cell.vertices
            p0 = starts_near(rng, cell, t, obstacle, 24)
            share = np.linspace(0, 1, 51)[:, None, None]
            ends = [k @ cell.knot(s, 2)[0].T + cell.knot(s, 2)[1] for s in (t, t + 1)]
            path = p0 + (1 - share) * ends[0] + share * ends[1]
            hit = grown.contains(path).any(axis=0)
            in_joint = np.array(
                [membership(joint, x).status is not LPStatus.INFEASIBLE for x in np.c_[p0, k]]
            )
            in_workspace = np.array(
                [membership(workspace, x).status is not LPStatus.INFEASIBLE for x in p0]
            )
            assert (in_joint | ~hit).all() and (in_workspace | ~in_joint).all()
            seen.append((hit.sum(), in_joint.sum(), in_workspace.sum(), len(k)))
    hit, in_joint, in_workspace, total = np.sum(seen, axis=0)
    assert 0 < hit <= in_joint < in_workspace < total


def test_grown_obstacles_contain_obstacle_plus_body_plus_error(rng):
    angle = rng.uniform(0, 2 * np.pi, 2000)
    body = (
        0.3
        * np.sqrt(rng.uniform(0, 1, 2000))[:, None]
        * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    )
    for bin_number, t, obstacle in ((0, 0, 0), (1, 3, 1)):
        grown = GROWN.at(bin_number, t, obstacle)
        o = gap_problem(2.0).obstacles[obstacle]
        lo, hi = -o.b[2:], o.b[:2]
        error = TUBE.interval[bin_number, t]
        x = rng.uniform(lo, hi, (2000, 2)) - body + error * rng.choice([-1, 1], (2000, 2))
        assert grown.contains(x).all()
        around = (0.3 / np.cos(np.pi / 10)) + error + 1e-9
        assert not grown.contains(np.concatenate([lo - around, hi + around]).reshape(2, 2)).any()
