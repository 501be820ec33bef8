"""The published search: safe samples are safe, faults are named, trouble is not safe, both methods
agree.
"""

import functools
from itertools import islice

import jax
import numpy as np
import pytest
from gap_model import arc_tube, gap_problem, gap_table

from benchmarks.neuralparc import by_lp as paper_lp
from benchmarks.neuralparc.cells import cells_outward
from benchmarks.neuralparc.lp_program import LPResult, LPStatus
from benchmarks.neuralparc.scene import paper_scene
from benchmarks.neuralparc.search import paper_search
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.tube import tube
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.regions.subdivide import enumerate_regions

pytestmark = pytest.mark.slow

T, SEED = 4, np.array([5.0, 0.0])
TABLE = gap_table(T)


def search_anew(gap=2.0, bins=(1, 1), n_regions=None, key=0, samples=8, **options):
    tube_, problem = arc_tube(T, bins), gap_problem(gap)
    regions = islice(cells_outward(TABLE, tube_, SEED), n_regions)
    return paper_search(
        jax.random.key(key), regions, paper_scene(problem, tube_), samples=samples, **options
    )


_once = functools.cache(search_anew)


def search(gap=2.0, bins=(1, 1), n_regions=None, key=0, samples=8, **options):
    """The same question is searched once in this file."""
    return _once(gap, bins, n_regions, key, samples, **options)


def oracle_safe(samples, bins, gap):
    """Dense check in plain NumPy: 101 points per segment against obstacle + disc + error box; goal
    with error.
    """
    tube_, problem = arc_tube(T, bins), gap_problem(gap)
    ok = []
    for x in samples:
        p0, k = x[:2], x[2:]
        y = np.asarray(TABLE.net(k))
        path = p0 + np.concatenate([[[0.0, 0.0]], y[:-1].reshape(T, 2)])
        number = int(tube_.bin_of(k))
        final = np.r_[path[-1], y[-1]]
        good = (
            problem.goal.A @ final + np.abs(problem.goal.A) @ tube_.final[number] <= problem.goal.b
        ).all()
        for t in range(T):
            points = path[t] + np.linspace(0, 1, 101)[:, None] * (path[t + 1] - path[t])
            for o in problem.obstacles:
                lo, hi = -o.b[2:] - tube_.interval[number, t], o.b[:2] + tube_.interval[number, t]
                gap_ = np.maximum(np.maximum(lo - points, points - hi), 0)
                good &= (np.linalg.norm(gap_, axis=1) > problem.body.radius).all()
        ok.append(good)
    return np.array(ok)


@pytest.mark.night
@pytest.mark.soundness
@pytest.mark.parametrize("bins", [(1, 1), (2, 2)])
def test_safe_samples_are_safe_by_dense_simulation(bins):
    found = search(bins=bins)
    assert len(found.samples) > 50
    assert oracle_safe(found.samples, bins, 2.0).all()
    assert (TABLE.locate(found.samples[:, 2:]) == found.region).all()
    assert found.tally.regions == TABLE.count


@pytest.mark.slow
def test_the_narrow_gap_has_no_plan_by_projection_although_safe_plans_exist():
    """The published set forgets k: at 1.1 m it finds nothing, while single points are safe by the
    dense check.
    """
    assert len(search(gap=1.1).samples) < len(search(gap=2.0).samples)
    wide = search(gap=2.0).samples
    assert oracle_safe(wide, (1, 1), 1.1).any()


@pytest.mark.slow
def test_lp_and_supports_find_plans_in_the_same_regions():
    by_lp, by_supports = search(method="lp", n_regions=4), search()
    first = {int(region[0].region) for region in islice(cells_outward(TABLE, arc_tube(T), SEED), 4)}
    assert oracle_safe(by_lp.samples, (1, 1), 2.0).all()
    assert set(by_lp.region.tolist()) == first & set(by_supports.region.tolist()) != set()
    assert by_lp.tally.unknown == by_supports.tally.unknown == 0


def test_anytime_stops_at_the_first_region_with_a_plan():
    found = search(anytime=True)
    assert 0 < len(found.samples) <= 8 and len(set(found.region.tolist())) == 1
    assert found.tally.regions < TABLE.count
    assert search(gap=0.2, anytime=True).tally.regions == TABLE.count


def test_same_key_same_answer_and_another_key_another_one():
    first, again, other = search(), search_anew(), search(key=1)
    np.testing.assert_array_equal(first.samples, again.samples)
    assert first.samples.shape != other.samples.shape or not (first.samples == other.samples).all()


@pytest.mark.soundness
def test_more_obstacles_and_larger_errors_never_add_plans():
    count = [len(search(gap=gap).samples) for gap in (2.4, 1.6, 0.8)]
    assert count[0] >= count[1] >= count[2] and count[0] > count[2]


def in_trouble(*question):
    nothing = np.zeros(0)
    return LPResult(LPStatus.UNKNOWN, nothing, nothing, -np.inf, np.inf, "MaxTime")


@pytest.mark.soundness
def test_solver_trouble_never_yields_a_plan(monkeypatch):
    """With every avoid-set LP in trouble nothing is safe; published code takes it for empty."""
    monkeypatch.setattr(paper_lp, "membership", in_trouble)
    monkeypatch.setattr(paper_lp, "find_point", in_trouble)
    sound = search_anew(method="lp", n_regions=2)
    assert len(sound.samples) == 0 and sound.tally.unknown > 0
    monkeypatch.setattr(paper_lp, "_proved", lambda status, tally: True)
    assert len(search_anew(method="lp", n_regions=2).samples) > 0


def wall_jump(**options):
    """P0 = [-.1, .1]^2, one step of (2, 0), wall x in [.9, 1.1]: the path crosses the wall between
    the knots.
    """
    net = relu_network([np.zeros((2, 2))], [np.array([2.0, 0.0])])
    table = enumerate_regions(net, box([0.0, 0.0], [1.0, 1.0]))
    errors = tube([np.array([0.0, 1.0])] * 2, np.full((1, 1, 2), 1e-3), np.full((1, 2), 1e-3))
    start = box([-0.1, -0.1], [0.1, 0.1])
    problem = reach_avoid(box([1.8, -0.2], [2.2, 0.2]), [box([0.9, -5.0], [1.1, 5.0])], 0.01, start)
    regions = cells_outward(table, errors, np.array([0.5, 0.5]))
    return paper_search(
        jax.random.key(0), regions, paper_scene(problem, errors), samples=8, **options
    )


@pytest.mark.soundness
def test_the_wall_jump_is_rejected_by_lps(monkeypatch):
    """Cutting off starts outside P0 before the hull is taken, as published code does, loses the
    wall.
    """
    assert len(wall_jump(method="lp").samples) == 0
    whole = paper_lp.knot_set
    start = HPolytope(np.concatenate([np.eye(2), -np.eye(2)]), np.full(4, 0.1))
    rows = lambda s: np.pad(start.A, ((0, 0), (0, s.n - 2)))  # noqa: E731

    def cut(cell, obstacle, s):
        every = whole(cell, obstacle, s)
        A, b = np.concatenate([every.A, rows(every)]), np.r_[every.b, start.b]
        return every.replace(A=A, b=b)

    monkeypatch.setattr(paper_lp, "knot_set", cut)
    assert len(wall_jump(method="lp").samples) > 0


@pytest.mark.slow
@pytest.mark.soundness
def test_supports_reject_the_wall_jump_too():
    assert len(wall_jump().samples) == 0


def test_bad_questions_are_refused():
    with pytest.raises(InputError, match='"supports" or "lp"'):
        search(method="simplex")
    problem = gap_problem()
    with pytest.raises(InputError, match="dimensions"):
        paper_scene(reach_avoid(box([0.0, 0.0], [1.0, 1.0]), problem.obstacles, 0.3), arc_tube(T))
    open_goal = HPolytope(np.eye(3), np.ones(3))
    with pytest.raises(InputError, match="bounded set"):
        paper_scene(problem.replace(goal=open_goal), arc_tube(T))
