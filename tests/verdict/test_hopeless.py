"""Scenes that cannot have a plan are told so in a sentence, and no others are."""

import re

import jax
import numpy as np
import pytest
import toy_models
from toy_bodies import points_model
from toy_models import fold_model, line_model, model_of, random_network

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.labels import Labels
from parc_jax.learning.network.relu import outputs
from parc_jax.learning.network.rounding import outputs_within
from parc_jax.learning.system import TURNS
from parc_jax.planner import Planner
from parc_jax.problem.body import hull
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.problem.world.moving import moving
from parc_jax.proof.absence.prove_no_plan import prove_no_plan
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.infeasible import why_none
from parc_jax.safe_set.verdict.scene import lowered, scene_of

GOAL = box([3.0, -0.5, -1.0], [4.0, 0.5, 1.0])  # corners at (3, +-0.5) are farthest from WALL
WALL = box([5.0, -1.0], [6.0, 1.0])
CORNER = box([5.0, 1.5], [6.0, 2.0])  # farthest from (3, -0.5), by its own corner
GOAL_OF_P = box([3.0, -0.5], [4.0, 0.5])
ROOF = hpolytope([[1.0, 1.0], [-1.0, 1.0], [0.0, -1.0]], [5.0, -2.0, -1.0])  # a triangle above


def why(model, goal, obstacle, body, **options):
    return why_none(scene_of(reach_avoid(goal, [obstacle], body, **options), model))


@pytest.mark.parametrize(
    ("obstacle", "radius", "span", "told"),
    [
        (WALL, 2.01, None, True),
        (WALL, 1.99, None, False),
        (WALL, 200.0, (3, 3), True),
        (WALL, 200.0, (0, 2), False),
        (CORNER, 2.84, None, True),
        (CORNER, 2.82, None, False),
        (ROOF, 1.6, None, True),
        (ROOF, 1.4, None, False),
        (box([2.0, -1.0], [5.0, 1.0]), 0.0, None, True),
        (box([3.1, -1.0], [5.0, 1.0]), 0.0, None, False),
    ],
)
def test_a_goal_under_the_body_is_told(obstacle, radius, span, told):
    model = line_model(half=8.0)
    found = why(model, GOAL, obstacle, radius, spans=[span])
    assert (found is not None) == told
    if told:
        assert "touches obstacle 0" in found.words and "goal" in found.words
        assert found.of_scene == (span is None)


def test_a_start_under_the_body_is_told():
    model = line_model(half=8.0)
    for at, told in ((5.5, True), (4.5, False)):
        start = box([at, -0.1], [at + 0.2, 0.1])
        found = why(model, box([-3, -1, -9], [-2, 1, 9]), WALL, 0.4, start=start)
        assert (found is not None) == told
        assert not told or "in the start set" in found.words


def test_what_is_told_is_true_and_proved_where_a_proof_is_possible(rng):
    """Also for tubes that leave out the model, where no proof is: the words are not of the tube."""
    goal = box([1.0, 1.0] + [-60.0] * 7, [3.0, 3.0] + [60.0] * 7)
    model = points_model(rng, fitted=True)
    assert not all(f.allow_none.all() for f in model.tube.templates)
    scene = scene_of(
        reach_avoid(goal, [box([4.0, 1.0], [5.0, 2.0])], hull("c0", "c1", radius=5.0)), model
    )
    none = prove_no_plan(scene, limit=Limit(600.0), max_leaves=10)
    said = none.details()
    assert none.kind == "undecided" and said.startswith("No plan is safe: wherever in the goal")
    assert said.endswith("touches obstacle 0.")
    none = none._replace(kind="proved")
    assert none.details().endswith("touches obstacle 0.")


def test_only_parts_about_the_first_point_are_looked_at(rng):
    model = points_model(rng)
    goal = box([1.0, 1.0] + [-60.0] * 7, [3.0, 3.0] + [60.0] * 7)
    wall = box([4.0, 1.0], [5.0, 2.0])
    for body, told in ((hull("c0", radius=5.0), True), (hull("c1", radius=5.0), False)):
        assert (why(model, goal, wall, body) is not None) == told


def here(model, goal, obstacles, body, at, **settings):
    problem = reach_avoid(goal, obstacles, body)
    return Planner(model).solve(problem, jax.random.PRNGKey(0), Settings(**settings), at=at)


@pytest.mark.parametrize("samples_only", [False, True])
def test_a_start_in_an_obstacle_is_told_at_once(samples_only):
    answer = here(line_model(), GOAL, [WALL], 0.3, (5.2, 0.5), samples_only=samples_only)
    said = answer.details().split("\n")[0]
    assert said.startswith("No plan is safe: where the plan starts, the body")
    assert said.endswith("touches obstacle 0.") and not answer.status.found
    assert answer.cover.drawn == 0 and answer.cover.ended is None  # nothing is searched for


@pytest.mark.parametrize("settings", [Settings(), Settings.fast()])
def test_a_start_set_in_an_obstacle_is_told_once(settings, monkeypatch):
    """Not beside "more work may reach it" and "proves nothing", where few boxes prove nothing."""
    monkeypatch.setattr("parc_jax.method.SURE_LEAVES", 1)
    problem = reach_avoid(GOAL, [WALL], 0.3, box([5.1, 0.4], [5.2, 0.5]))
    answer = Planner(line_model()).solve(problem, jax.random.PRNGKey(0), settings)
    said = answer.summary().split("\n")
    assert said[1].startswith("No plan is safe: wherever in the start set a plan starts, the body")
    assert sum("No plan is safe" in line for line in said) == 1
    assert "work" not in answer.summary() + answer.details() and not answer.status.found


def test_a_start_from_where_nothing_gets_to_the_goal_is_told_at_once():
    """Ends lie within 1 m of the start: so by bounds, that is for every plan."""
    model = line_model(e=0.01)
    answer = here(model, GOAL, [WALL], 0.3, (0.5, 0.0))
    said = answer.details()
    assert answer.cover.drawn == 0 and "No plan is safe: no plan of the model ends" in said
    assert "between -0.5 and 1.5, the goal asks for 3 to 4" in said
    known = Uncertainty(start=0.02)
    far = reach_avoid(box([29.7, -1.0, -9.0], [31.3, 1.0, 9.0]), [], 0.3, uncertainty=known)
    told = why_none(lowered(query(far, model, (0.5, 0.0)).nominal({}))).words
    assert told.endswith("the goal asks for 29.72 to 31.28.")  # which are no floats
    # what it rests on: body, pose and tube
    assert "point 0 grown by 0.3 m) among 1 convex" in said and model.claim.details() in said
    assert "Here: all plans start at (0.5, 0) m, with the heading of the model's runs." in said
    near = scene_of(reach_avoid(GOAL, [], 0.3, box([2.01, 0.0], [2.02, 0.1])), model)
    assert why_none(near) is None  # some plan may get there: nothing is said
    ahead = box([-9.0, -9.0, 0.5], [9.0, 9.0, 1.0])  # of q alone, which is k_0
    folded = scene_of(reach_avoid(ahead, [], 0.0, GOAL_OF_P), fold_model())
    assert why_none(folded) is None


@pytest.mark.parametrize("start", [None, box([2.5, 0.0], [2.6, 0.1])])
def test_a_heading_in_degrees_is_told(start):
    """q is k_0, from -1 to 1, wherever a plan starts."""
    labels = Labels(p=("x [m]", "y [m]"), q=("heading [rad]",), k=("k0", "k1"))
    model = toy_models.told(line_model(), labels=labels)
    goal = box([3.0, -0.5, 85.0], [3.6, 0.5, 95.0])
    found = why(model, goal, box([9.0, 9.0], [9.5, 9.5]), 0.0, start=start)
    assert found.sure and "heading at its end is between -1 and 1, the goal asks" in found.words
    assert found.words.endswith("Is it in degrees? heading is in rad: 90 degrees are 1.571.")
    turned = box([3.0, -0.5, 1.5], [3.6, 0.5, 1.6])
    found = why(model, turned, box([9.0, 9.0], [9.5, 9.5]), 0.0, start=start)
    assert found.sure and "degrees" not in found.words


def test_a_heading_that_is_told_whole_turns_off_is_told():
    """q is k_0, from -1 to 1. Turns are counted, so nothing ends there; but few may mean that."""
    labels = Labels(p=("x [m]", "y [m]"), q=("heading [rad]",), k=("k0", "k1"))
    model, wall = toy_models.told(line_model(), labels=labels), box([9.0, 9.0], [9.5, 9.5])
    turning, start = toy_models.told(model, rotation=(TURNS,)), box([2.5, 0.0], [2.6, 0.1])

    def words(model, middle):
        goal = box([3.0, -0.5, middle - 0.5], [3.6, 0.5, middle + 0.5])
        return why(model, goal, wall, 0.0, start=start).words

    hint = "Turns are counted: is the goal told "
    assert f"{hint}1 turn too high, or the pose's heading too low?" in words(turning, 2 * np.pi)
    assert f"{hint}2 turns too low, or the pose's heading too high?" in words(turning, -4 * np.pi)
    for other, middle in ((model, 2 * np.pi), (turning, np.pi), (turning, 3 * np.pi)):
        assert hint not in words(other, middle)  # of what does not turn, and between turns


def test_a_pose_that_is_told_a_whole_turn_away_is_asked_about():
    model = toy_models.told(line_model(), rotation=(TURNS,))
    goal, at = box([0.3, -0.5, -0.5], [0.9, 0.5, 0.5]), (0.0, 0.0, 2 * np.pi)
    said = here(model, goal, [WALL], 0.1, at, samples_only=True).summary()
    assert "is the goal told 1 turn too low, or the pose's heading too high?" in said


def test_points_that_the_model_places_at_the_start_are_looked_at(rng):
    """A hull that the first point is no part of: its corners are where the network has them."""
    model = points_model(rng)
    goal = box([1.0, 1.0] + [-60.0] * 7, [3.0, 3.0] + [60.0] * 7)
    start = box([0.0, 0.0], [0.1, 0.1])
    around, beside = box([-9.0] * 2, [9.0] * 2), box([8.0, 8.0], [9.0, 9.0])
    body = hull(*model.points[1:])
    found = why(model, goal, around, body, start=start, spans=[(0, 1)])
    assert found.sure and not found.of_scene and "in the start set" in found.words
    assert why(model, goal, beside, body, start=start, spans=[(0, 1)]) is None


def test_of_what_moves_no_reason_is_one_of_the_scene_and_places_are_told_in_a_frame():
    """It is told of as all its places in some intervals, of which it is at one at a time."""
    model = line_model(half=8.0)
    parts, spans = moving(WALL, [0.1, 0.0], (0, 3), 0.25, every=4)
    found = why_none(lowered(query(reach_avoid(GOAL, parts, 2.01, spans=spans), model).nominal({})))
    assert found.sure and not found.of_scene
    asked = reach_avoid(GOAL, [WALL], 2.01)
    assert why_none(lowered(query(asked, model).nominal({}))).of_scene
    turns = toy_models.told(model, rotation=(TURNS,))
    turning = query(asked, turns, (0.0, 0.0, 0.0)).nominal({})
    assert why_none(lowered(turning)).words.startswith("in the robot's frame, ")


def test_an_obstacle_that_uncertainty_made_larger_makes_nothing_sure():
    model = line_model(half=8.0)
    problem = reach_avoid(GOAL, [WALL], 2.01, uncertainty=Uncertainty(start=(0.1, 0.1)))
    found = why_none(lowered(query(problem, model).nominal({})))
    assert not found.of_scene and not found.sure
    assert found.words.startswith("with obstacles, goal, body and tube as ")


@pytest.mark.parametrize("n_k", [1, 2, 3])
def test_outputs_are_within_their_bounds(n_k, rng):
    net = random_network(rng, 3, n_k=n_k)
    k = rng.uniform(-1, 1, (2000, n_k))
    rows = np.array([5, 0, 2])
    lo, hi = outputs_within(net, box([-1.0] * n_k, [1.0] * n_k), rows)
    y = outputs(net, k)[:, rows]
    inside = ((lo[None] <= y[:, None]) & (y[:, None] <= hi[None])).all(axis=2)
    assert inside.any(axis=1).all()
    assert (hi.max(axis=0) - lo.min(axis=0) < 3 * np.ptp(y, axis=0) + 1e-9).all()


def test_the_end_that_misses_is_named_with_its_point(rng):
    """Of several points the x of another one was told as the robot's; and to six digits."""
    model = points_model(rng)
    lo, hi = np.full(9, -1e4), np.full(9, 1e4)
    lo[2], hi[2] = 700.5, 701.5  # the second point ends near 500.123456
    start = box([500.123456, 0.0], [500.123456, 0.0])
    found = why(model, box(lo, hi), box([9e3, 9e3], [9.5e3, 9.5e3]), hull("c0"), start=start)
    assert found.sure and f" of {model.points[1]} at its end is between " in found.words
    least, most = map(float, re.search(r"between (\S+) and (\S+),", found.words).groups())
    assert 490 < least < most < 510 and f"{least}" != f"{least:.6g}"


def test_of_two_goal_states_the_one_that_misses_is_named(rng):
    net, e = random_network(rng, 4, n_q=2), np.full((1, 4, 2), 0.01)
    model = model_of(net, box([-1, -1], [1, 1]), e, np.full((1, 4), 0.01))
    goal = box([-9.0, -9.0, -99.0, 50.0], [9.0, 9.0, 99.0, 60.0])
    words = f"{model.labels.q[1]} at its end is between "
    said = why(model, goal, WALL, 0.3).words
    assert words in said and "the goal asks for 50 to 60" in said


def test_a_goal_narrower_than_the_tube_is_told_by_name():
    said = why(line_model(e=0.01), box([0.0, 0.0, -9.0], [1.0, 0.015, 9.0]), WALL, 0.3).words
    assert "at the end: its y is 0.015 wide" in said
    odd = why(line_model(e=0.9), box([0.0, 0.0, -9.0], [9.0, 31.3 - 29.7, 9.0]), WALL, 0.3).words
    assert "its y is 1.6 wide" in odd
