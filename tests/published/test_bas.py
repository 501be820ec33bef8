"""Published avoid sets: LPs and supports agree, and the chain exact collision < joint hull <
projection holds. [T13]
"""

import numpy as np
import pytest
from gap_model import HI, LO, arc_tube, gap_problem, gap_table

from parc_jax.common.lp.status import LPStatus
from parc_jax.common.sets.bounding_box import bounding_box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.neuralparc import by_support as shadow_module
from parc_jax.neuralparc.bas import avoid_set, joint_avoid_set, knot_set, within_reach
from parc_jax.neuralparc.brs import reach_set
from parc_jax.neuralparc.by_support import clear_of_reach, margins, outside, shadows
from parc_jax.neuralparc.cells import cells_outward, stack
from parc_jax.neuralparc.grown_polytopes import grown_polytopes
from parc_jax.neuralparc.sets.membership import find_point, membership, memberships
from parc_jax.neuralparc.sets.pontryagin import shrink
from parc_jax.problem.body import Polygon
from parc_jax.problem.problem import reach_avoid

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


@pytest.mark.slow
def test_a_shadow_of_one_knot_only_would_be_caught(rng, monkeypatch):
    """The guard bites: with the second knot forgotten, supports and LPs disagree."""
    import jax.numpy as jnp

    caches = shadow_module._edge_normals, shadow_module._supports
    monkeypatch.setattr(
        shadow_module, "_swept", lambda c: -jnp.concatenate([c[:-1], c[:-1]], axis=1)
    )
    for cached in caches:
        cached.clear_cache()
    try:
        assert disagreements(rng, CELLS[:1], 24)[0] > 0
    finally:
        monkeypatch.undo()
        for cached in caches:
            cached.clear_cache()


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


def test_knot_set_is_being_inside_at_the_knot(rng):
    cell, grown = CELLS[0], GROWN.at(int(CELLS[0].bin), 2, 0)
    C, d = cell.knot(2, 2)
    k = rng.dirichlet(np.ones(len(cell.vertices)), 400) @ cell.vertices
    p0 = starts_near(rng, cell, 2, 0, 400)
    inside = grown.contains(p0 + k @ C.T + d)
    j = knot_set(cell, grown, 2)
    assert 0 < inside.sum() < 400
    np.testing.assert_array_equal(j.base.contains(np.c_[p0, k]), inside)
    reach = knot_set(cell, grown, 0)
    np.testing.assert_array_equal(reach.base.contains(np.c_[p0, k]), grown.contains(p0))
    assert ((np.c_[p0, k][inside] >= j.lo) & (np.c_[p0, k][inside] <= j.hi)).all()


@pytest.mark.slow
def test_pruning_never_drops_a_set_that_meets_omega(rng):
    """A set that LPs prove disjoint from Omega's shadow holds no start of Omega; supports drop no
    more than that.
    """
    problem = gap_problem(2.0)
    goals, goal_box = shrink(problem.goal, TUBE.final), bounding_box(problem.goal)
    cell = CELLS[0]
    reach = reach_set(cell, HPolytope(goals.A, goals.b[cell.bin]), goal_box, None, 2)
    polygons = shadows(stack([cell]), GROWN)
    clear = clear_of_reach(polygons, reach.lo[None, :2], reach.hi[None, :2])[0]
    x = np.c_[rng.uniform(reach.lo, reach.hi, (20_000, 4))]
    x = x[(x @ reach.A.T <= reach.b).all(axis=1)][:200]
    out = outside(polygons, x[None, :, :2])[0]
    empty = np.zeros((T, 2), bool)
    for t in range(T):
        for obstacle in range(2):
            avoid = avoid_set(cell, GROWN.at(int(cell.bin), t, obstacle), t)
            empty[t, obstacle] = (
                find_point(within_reach(avoid, reach)).status is LPStatus.INFEASIBLE
            )
    assert len(x) == 200
    assert empty.any() and not empty.all()
    assert (empty | ~clear).all()  # what supports drop, the LP drops
    assert out[:, empty].all()  # what the LP drops meets no start


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


def test_polygon_bodies_are_mirrored(rng):
    body = Polygon(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.5]]))
    problem = reach_avoid(gap_problem().goal, gap_problem(2.0).obstacles, body)
    grown = grown_polytopes(problem, TUBE).at(0, 0, 0)
    tight = TUBE.interval[0, 0]
    lo, hi = np.array([7.5, 1.0]), np.array([8.5, 3.0])
    x = rng.uniform(lo, hi, (500, 2)) - rng.dirichlet(np.ones(3), 500) @ body.vertices
    assert grown.contains(x).all()
    assert not grown.contains(
        np.array([hi[0] + tight[0] + 1e-6, 2.0])
    )  # nothing of -B to the right
    assert grown.contains(np.array([lo[0] - 0.999, 2.0]))


def test_obstacles_that_exist_for_some_intervals_only():
    base = gap_problem(2.0)
    problem = reach_avoid(base.goal, base.obstacles, base.body, spans=[(1, 2), None])
    active = grown_polytopes(problem, TUBE).active
    assert active.tolist() == [[False, True, True, False], [True] * 4]
    assert LO.shape == HI.shape
