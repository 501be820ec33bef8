"""Why no plan is safe: what is in the way and by how much, in scenes whose truth is known."""

from fractions import Fraction

import jax
import numpy as np
import pytest
from toy_models import assumed, line_model, told

import parc_jax as pj
from parc_jax.answer.why import odd_size, why_of
from parc_jax.app.cli.scene import as_json, verdict
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.tube import fitted_tube, tube
from parc_jax.learning.model import trajectory_model
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.body import Polygon, hull
from parc_jax.problem.problem import goal_of_points
from parc_jax.problem.robust.nominal import query
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import pruned_scene

GOAL = pj.box([1.5, -0.2, -9.0], [1.9, 0.2, 9.0])
START = pj.box([-0.5, -0.5], [0.0, 0.5])
SOON = pj.Settings(samples=2, work=0.02, proof=False)


def walls(gap: float) -> list:
    """Two walls that leave a gap about y = 0."""
    return [pj.box([0.7, gap / 2], [0.9, 2.0]), pj.box([0.7, -2.0], [0.9, -gap / 2])]


def why_not(problem, model=None, at=None):
    """As `Answer.why`, without the search before it, which compiles for long."""
    model = line_model(e=0.01, half=2.0) if model is None else model
    return why_of(pruned_scene(query(problem, model, at).nominal({})))


@pytest.mark.parametrize("at", [None, (0.0, 0.0)])
def test_a_gap_too_narrow_by_3_cm(at):
    """A body of 0.40 m in a tube of 0.01 m to either side, through 0.39 m."""
    why = why_not(pj.reach_avoid(GOAL, walls(0.39), 0.2, None if at else START), at=at)
    assert sorted(why.obstacles) == [0, 1] and why.safe == 0
    assert why.missing == pytest.approx(0.03, abs=1e-3)
    assert (why.tube, why.bare) == pytest.approx((0.02, 0.01), abs=1e-3)
    assert all(0.0 < time < 1.0 for time in why.times)
    assert "lacks 3.1 cm between obstacle" in why.text and "takes 2.1 cm of it" in why.text
    # never less than what is missing, 3.0001 cm
    assert "more room between these two by 3.1 cm" in why.text and "No narrower tube" in why.text


def test_bins_without_a_claim_are_named_and_more_bins_are_no_cure_of_them():
    model = line_model(e=0.01, half=2.0)
    edges = [np.array([-2.0, 1.0, 2.0]), model.tube.edges[1]]
    wide = np.stack([model.tube.interval[0], np.full_like(model.tube.interval[0], np.inf)])
    final = np.stack([model.tube.final[0], np.full_like(model.tube.final[0], np.inf)])
    some = told(model, tube=tube(edges, wide, final, 1))
    for one, bins in ((model, False), (some, True)):
        said = why_not(pj.reach_avoid(GOAL, walls(0.39), 0.2, START), one).text
        none = "1 of 2 bins of K have no claim: no plan there can be shown safe."
        assert (none in said) == bins


def test_more_bins_are_no_cure_where_each_has_a_claim_of_its_own_runs():
    model = line_model(e=0.08, final=0.01, half=2.0)
    block = {"n": 6905, "discard": 0, "eps": "1/1000"}
    claim = derived(model.claim, evidence={"blocks": [block]}, bin_eps=(Fraction(1, 1000),))
    for one, more in ((model, True), (model.replace(claim=claim), False)):
        said = why_not(pj.reach_avoid(GOAL, walls(0.62), 0.25, START), one).text
        assert "a better network by more runs" in said
        assert ("(more bins of K, a better network" in said) == more


def test_a_gap_wider_than_the_body_says_how_much_narrower_the_tube_must_be(tmp_path):
    """0.62 m for 0.50 m, 0.08 m of tube to either side: 4 of 16 cm, and the shell says so."""
    model = line_model(e=0.08, final=0.01, half=2.0)
    problem = pj.reach_avoid(GOAL, walls(0.62), 0.25, START)
    answer = pj.Planner(model).solve(problem, jax.random.PRNGKey(0), SOON)
    why, said = answer.why(), verdict(answer, tmp_path / "answer.json")
    assert (why.missing, why.tube) == pytest.approx((0.04, 0.16), abs=1e-3)
    assert "without errors it has 11 cm to spare" in why.text
    assert "or a tube narrower by 26 %" in why.text and "No narrower tube" not in why.text
    assert answer.why() is why and why.text in said and len(said.split("\n")) <= 15
    assert len(said.split()) <= 200 and "(E)" not in said  # the law on request
    assert "more room between" in as_json(answer, tmp_path / "answer.json", None)


def test_what_is_uncertain_at_the_start_is_no_width_of_the_claim_s_tube():
    """A tube of 1 cm, a start off by 5 cm: both are in the way, and both are named."""
    known = pj.Uncertainty(start=(0.05, 0.05))
    why = why_not(pj.reach_avoid(GOAL, walls(0.47), 0.2, START, uncertainty=known))
    assert "The tube (with some of what is uncertain) takes" in why.text
    assert "a tube (with some of what is uncertain) narrower by" in why.text


def test_a_start_that_nothing_leads_from_is_said_in_the_summary_too():
    start = np.zeros(2)
    problem = pj.reach_avoid(GOAL, [pj.box([-0.5, -0.5], [0.5, 0.5])], 0.2)
    answer = pj.Planner(line_model(e=0.01, half=2.0)).solve(
        problem, jax.random.PRNGKey(0), SOON, at=start
    )
    sure = "No plan is safe: where the plan starts, the body"
    assert sure in answer.summary() and sure in answer.details()
    assert "proves nothing" not in answer.summary() and "any p0" not in answer.details()
    assert "from one start." in answer.details()


def test_a_goal_too_narrow_by_2_cm():
    """1 cm wide, in a tube of 1.5 cm to either side at the end."""
    goal = pj.box([1.5, -0.2, -9.0], [1.51, 0.2, 9.0])
    why = why_not(pj.reach_avoid(goal, [], 0.2, START), line_model(e=0.015, half=2.0))
    assert sorted(why.blockers) == ["the goal's side x <= 1.51", "the goal's side x >= 1.5"]
    assert why.missing == pytest.approx(0.02, abs=1e-6) and why.unit == "m"
    assert why.times == (None, None) and "that goal wider by 2.1 cm" in why.text


def test_a_slanted_side_is_told_with_the_digits_it_has():
    """At 3 km, a third to three digits was a side 3 m away."""
    A, b = np.vstack([np.eye(3), -np.eye(3), [1 / 3, 2 / 3, 0.0]]), np.r_[[1e4] * 6, -3000.5]
    why = why_not(pj.reach_avoid(HPolytope(A, b), [], 0.2, START))
    assert "the goal's side +0.333333333 x +0.666666667 y <= -3000.5" in why.blockers


def test_a_goal_too_far_from_the_start():
    goal = pj.box([2.500123, -0.2, -9.0], [2.6, 0.2, 9.0])
    why = why_not(pj.reach_avoid(goal, [], 0.2), at=(0.0, 0.0))
    assert why.blockers[0] == "the goal's side x >= 2.500123"
    assert why.missing == pytest.approx(0.51, abs=1e-3)


@pytest.mark.parametrize("at", [None, (0.0, 0.0)])
def test_a_start_in_an_obstacle(at):
    """0.10 m of body 0.10 m deep in the block, and 0.01 m of tube."""
    blocks = [pj.box([5.0, 5.0], [6.0, 6.0]), pj.box([-0.3, -0.3], [0.1, 0.3])]
    start = None if at else pj.box([-0.05, -0.05], [0.0, 0.05])
    why = why_not(pj.reach_avoid(GOAL, blocks, 0.1, start), at=at)
    assert why.obstacles == (1,) and set(why.times) == {0.0}
    assert why.missing == pytest.approx(0.21, abs=0.005)
    assert why.sentences[0].endswith("touches obstacle 1.")


def test_where_plans_pass_the_obstacle_that_holds_most_back_is_named():
    """From y in [-0.5, 0.5] past a wall that ends at 0.1 and a small block far aside."""
    blocks = [pj.box([0.7, 0.45], [0.9, 0.6]), pj.box([0.7, -2.0], [0.9, 0.1])]
    why = why_not(pj.reach_avoid(GOAL, blocks, 0.05, START))
    assert why.blockers == ("obstacle 1",) and why.obstacles == (1,)
    assert 0 < why.safe < 0.5 and why.blocked > 0.5 and why.missing > 0.05
    assert why.tube == pytest.approx(0.01, abs=2e-3) and "fail at obstacle 1" in why.text
    alone = why_not(pj.reach_avoid(GOAL, blocks[1:], 0.05, START), line_model(e=0.0, half=2.0))
    assert alone.blocked == 1 and ", 100 % fail at obstacle 0 " in alone.text


def upright_bar(fitted: bool):
    """A bar of two points, the second 0.5 m above the first, that drives k in four intervals."""
    T = 4
    share = np.repeat(np.arange(1, T + 1) / T, 2)[:, None, None] * np.eye(2)
    W = np.concatenate([np.zeros((2, 2)), share.reshape(-1, 2), [[1.0, 0.0]]])
    above = np.tile([0.0, 0.0, 0.0, 0.5], T)
    net = relu_network([W], [np.r_[0.0, 0.5, above, 0.0]])
    edges, half, final = [[-2.0, 2.0]] * 2, np.full((1, T, 2, 2), 0.01), np.full((1, 5), 0.01)
    errors = tube(edges, half.reshape(1, T, 4), final, 2)
    if fitted:
        u = np.broadcast_to(np.eye(2), (1, T, 2, 2, 2))
        during = faces(u, np.zeros((1, T, 2, 2)), half)
        errors = fitted_tube(
            edges, during, faces(np.eye(5)[None], np.zeros((1, 5)), final, frames=True)
        )
    return trajectory_model(net, assumed(net, errors, points=("low", "high")))


@pytest.mark.parametrize("fitted", [False, True])
def test_bodies_of_several_points_and_fitted_tubes(fitted):
    """0.60 m of bar with its rounded ends, 0.01 m of tube to either side, through 0.59 m."""
    blocks = [pj.box([0.7, 0.545], [0.9, 2.0]), pj.box([0.7, -2.0], [0.9, -0.045])]
    goal = goal_of_points(("low", "high"), pj.box([1.2, -0.4], [1.9, 0.9]), pj.box([-9.0], [9.0]))
    problem = pj.reach_avoid(goal, blocks, hull("low", "high", radius=0.05), START)
    why = why_not(problem, upright_bar(fitted))
    assert sorted(why.obstacles) == [0, 1]
    assert (why.missing, why.tube) == pytest.approx((0.03, 0.02), abs=2e-3)


def test_the_plan_that_is_named_lacks_what_is_said():
    """The verdict of the plan itself, by the engine."""
    model, problem = line_model(e=0.01, half=2.0), pj.reach_avoid(GOAL, walls(0.39), 0.2, START)
    scene = pruned_scene(query(problem, model).nominal({}))
    why = why_of(scene)
    seen = verdicts(scene, why.plan[None, :2], why.plan[None, 2:])
    assert -seen.clearance[0] == pytest.approx(why.missing / 2, abs=1e-3)


def test_sizes_in_another_unit_get_a_question():
    model = line_model(e=0.01, half=2.0)
    for body in (40.0, Polygon(np.array([[-40.0, 0.0], [40.0, 0.0], [0.0, 9.0]]))):
        problem = pj.reach_avoid(GOAL, walls(0.5), body, START)
        why = why_not(problem, model)
        assert any("is it in metres?" in said for said in why.sentences)
        assert odd_size(problem, model) in why.sentences
