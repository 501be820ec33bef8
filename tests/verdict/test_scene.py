"""Laying out a problem for a model: bounds, padding, slack."""

import numpy as np
import pytest
from toy_bodies import points_model
from toy_models import line_model, model_of, random_model, random_problem, uniform_tube
from turning_bar import straight_bar

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope
from parc_jax.learning.model import float_slack
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.network.rounding import UNIT
from parc_jax.problem.body import hull
from parc_jax.problem.problem import finite_box, goal_box, goal_of_points, reach_avoid
from parc_jax.safe_set.separation.pairs import BUCKETS
from parc_jax.safe_set.verdict.scene import scene_of

GOAL = box([-0.5, -0.5, -1], [0.5, 0.5, 1])
OBSTACLE = box([2, 2], [3, 3])


def test_finite_box_of_a_box_and_of_slanted_rows(rng):
    lo, hi = finite_box(from_box(box([-1, 2, 3], [4, 5, 6])), "goal")
    assert lo.tolist() == [-1, 2, 3] and hi.tolist() == [4, 5, 6]
    diamond = hpolytope([[1, 1], [-1, 1], [-1, -1], [1, -1]], [1, 2, 3, 4])
    lo, hi = finite_box(diamond, "goal")
    np.testing.assert_allclose([lo, hi], [[-2.5, -3.5], [2.5, 1.5]], atol=1e-9)
    both = hpolytope(np.concatenate([diamond.A, [[1, 0]]]), np.append(diamond.b, 0.5))
    assert finite_box(both, "goal")[1][0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("A", "b", "words"),
    [
        ([[1, 0], [-1, 0], [0, 1]], [1, 1, 1], "axis 1 has no bound"),
        ([[1, 0], [-1, 0], [0, 1], [0, -1]], [1, -2, 1, 1], "axis 0 asks for one in"),
        ([[1, 1], [-1, -1], [1, -1], [-1, 1]], [1, -2, 1, 1], "contradict"),
        ([[1, 1], [-1, -1]], [1, 1], "has no bound"),
        ([[1, 0], [-1, 0], [0, 1], [0, -1]], [1e308] * 4, r"axis 0 has no bound up to 1e\+100"),
    ],
)
def test_goals_without_a_box_are_refused(A, b, words):
    with pytest.raises(InputError, match=words):
        finite_box(hpolytope(A, b), "goal")


def test_a_goal_may_leave_free_all_but_the_first_point_and_q():
    layout, small = Layout(4, 2, 3), box([-1.0, -2.0], [1.0, 2.0])
    q = box([-3.0], [3.0])
    names = ("nose", "tail", "hitch")
    lo, hi = goal_box(goal_of_points(names, {"nose": small, "hitch": small}, q), layout)
    free = [np.inf, np.inf]
    assert hi.tolist() == [1, 2, *free, 1, 2, 3] and (lo == -hi).all()
    other = hpolytope(np.eye(7)[[2, 2, 6, 6]] * [[1], [-1], [1], [-1]], np.ones(4))
    with pytest.raises(InputError, match="axis 0 has no bound"):
        goal_box(other, layout)
    with pytest.raises(InputError, match="has no bound"):
        goal_box(hpolytope(np.concatenate([np.eye(7)[:2], -np.eye(7)[:2]]), np.ones(4)), layout)


def test_an_open_goal_is_told_by_an_axis_that_needs_a_bound():
    """Not by one of a further point, which may be free. With rows along the axes and aslant."""
    layout, names = Layout(4, 2, 2), ("nose", "tail")
    goal = goal_of_points(names, {"nose": box([-1.0, -1.0], [1.0, 1.0])}, box([-1.0], [1.0]))
    aslant = np.eye(5)[:4]
    aslant[2, 3] = 0.0
    aslant[1, 0] = 0.5
    for rows in (np.eye(5)[:2], aslant[:2]):
        both = hpolytope(np.concatenate([rows, -rows]), np.ones(2 * len(rows)))
        with pytest.raises(InputError, match="axis 4 has no bound"):
            goal_box(both, layout)
    assert np.isfinite(goal_box(goal, layout)[0]).tolist() == [True, True, False, False, True]


def test_a_goal_over_named_points_is_refused_by_a_model_with_another_order():
    model = straight_bar()
    named = reversed(model.points)
    goal = goal_of_points(tuple(named), {"nose": box([-1.0] * 2, [1.0] * 2)}, box([-1.0], [1.0]))
    problem = reach_avoid(goal, [box([5.0, 5.0], [6.0, 6.0])], hull("tail", "nose"))
    with pytest.raises(InputError, match="tail, nose, in this order; it was made for nose, tail"):
        scene_of(problem, model)
    goal = goal_of_points(model.points, {"tail": box([-1.0] * 2, [1.0] * 2)}, box([-1.0], [1.0]))
    assert scene_of(problem.replace(goal=goal, points=goal.points), model).goal_A.shape[1] == 5


def test_padding_rows_always_hold_and_sizes_come_from_few_buckets(rng):
    model = random_model(rng)
    problem = random_problem(rng, model, 3, start=True)
    scene = scene_of(problem, model)
    for A, b in ((scene.goal_A, scene.goal_b), (scene.start_A, scene.start_b)):
        assert len(b) in BUCKETS
        padding = ~A.any(axis=1)
        assert (b[padding] == 1).all()
    assert len(scene.obstacles.active) in BUCKETS
    assert scene.tabled.directions.multipliers == ()
    assert scene.directions.multipliers != ()


def test_slack_grows_with_everything_that_rounds(rng):
    model = random_model(rng)
    problem = random_problem(rng, model, 2)
    base = float(scene_of(problem, model).slack)
    assert 0 < base < 1e-9
    far = problem.replace(obstacles=(from_box(box([1e6, 0], [1e6 + 1, 1])),), spans=(None,))
    assert float(scene_of(far, model).slack) > 1e5 * 2.0**-53
    W = [w * 1e3 for w in model.net.weights]
    big = model_of(
        type(model.net)(tuple(W), model.net.biases), model.domain, *uniform_tube(4, 0.01)
    )
    assert float(scene_of(problem, big).slack) > 10 * base


def test_bins_without_claim_do_not_widen_the_slack():
    line, (interval, final) = line_model(4), uniform_tube(4, 0.01)
    none = np.full_like(interval, np.inf), np.full_like(final, np.inf)
    both = [np.concatenate(parts) for parts in zip((interval, final), none, strict=True)]
    half = model_of(line.net, line.domain, *both, [[-1, 0, 1], [-1, 1]])
    problem = reach_avoid(GOAL, [OBSTACLE], 0.1)
    assert np.isfinite(scene_of(problem, half).slack)


def test_the_ends_of_the_domain_belong_to_it():
    """Floats are the rationals that they hold: no float of K is left out."""
    line = line_model(4)
    for lo, hi in ((-0.3, 0.3), (-0.1, 1.1), (-0.5, 1.6)):
        model = model_of(line.net, box([lo, lo], [hi, hi]), *uniform_tube(4))
        scene = scene_of(reach_avoid(GOAL, [OBSTACLE], 0.1), model)
        assert (scene.k_lo == lo).all() and (scene.k_hi == hi).all()


def test_a_goal_of_several_points_without_q_is_told_how_to_give_it(rng):
    model = points_model(rng)
    goal = goal_of_points(model.points, box([0.0, 0.0], [1.0, 1.0]))
    with pytest.raises(InputError, match=r"goal_of_points\(model.points, where, q=...\), q over 1"):
        scene_of(reach_avoid(goal, [], 0.1), model)


@pytest.mark.parametrize(
    ("problem", "words"),
    [
        (
            lambda: reach_avoid(box([-1, -1], [1, 1]), [OBSTACLE], 0.1),
            "2 workspace coordinates and 1 further goal coordinates",
        ),
        (
            lambda: reach_avoid(GOAL, [box([2, 2, 2], [3, 3, 3])], 0.1),
            "obstacle 0: expected a set in the 2-D",
        ),
        (
            lambda: reach_avoid(GOAL, [], 0.1, start=box([0, 0, 0], [1, 1, 1])),
            "start: expected a set in the 2-D",
        ),
        (
            lambda: reach_avoid(GOAL, [hpolytope([[1, 0], [-1, 0]], [1, 1])], 0.1),
            "obstacle 0: expected a bounded",
        ),
        (
            lambda: reach_avoid(
                GOAL, [OBSTACLE, hpolytope([[1, 0], [-1, 0], [0, 1], [0, -1]], [1, -2, 1, 1])], 0.1
            ),
            "obstacle 1: expected a set with points",
        ),
        (
            lambda: reach_avoid(GOAL, [OBSTACLE], 0.1, spans=[(0, 9)]),
            "span of obstacle 0: expected last < 4",
        ),
    ],
)
def test_problems_that_do_not_fit_the_model_are_refused_in_one_sentence(problem, words):
    with pytest.raises(InputError, match=words) as caught:
        scene_of(problem(), line_model(4, 0.01))
    text = str(caught.value)
    assert "expected" in text and text.endswith(".") and "\n" not in text


@pytest.mark.parametrize(("m", "operations"), [(4, 32), (40, 3 * 40 + 1 + 3)])
def test_the_slack_pays_for_rows_over_many_coordinates(m, operations, rng):
    """A row of the goal over all coordinates of 40 points in space is a sum of 121 terms. [T11]"""
    model = points_model(rng, m=m, n_p=3)
    size = 1e9  # [m] beside it the network's own rounding is nothing
    assert float_slack(model, size) == pytest.approx(2 * operations * UNIT * size, rel=1e-6)
