"""Scenes that cannot have a plan are told so in a sentence, and no others are."""

import pytest
from toy_bodies import points_model
from toy_models import line_model

from parc_jax.cover.limit import Limit
from parc_jax.no_plan.prove_no_plan import prove_no_plan
from parc_jax.problem.body import hull
from parc_jax.problem.problem import reach_avoid
from parc_jax.sets.box import box
from parc_jax.sets.hpolytope import hpolytope
from parc_jax.verdict.hopeless import why_none
from parc_jax.verdict.scene import scene_of

GOAL = box([3.0, -0.5, -1.0], [4.0, 0.5, 1.0])  # corners at (3, +-0.5) are farthest from WALL
WALL = box([5.0, -1.0], [6.0, 1.0])
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
        assert found.of_scene and "touches obstacle 0" in found.words and "goal" in found.words


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
    said = none.statement()
    assert none.kind == "undecided" and "touches obstacle 0. This is not a proof" in said
    none = none._replace(kind="proved")
    assert none.statement().endswith("touches obstacle 0.")


def test_only_parts_about_the_first_point_are_looked_at(rng):
    model = points_model(rng)
    goal = box([1.0, 1.0] + [-60.0] * 7, [3.0, 3.0] + [60.0] * 7)
    wall = box([4.0, 1.0], [5.0, 2.0])
    for body, told in ((hull("c0", radius=5.0), True), (hull("c1", radius=5.0), False)):
        assert (why(model, goal, wall, body) is not None) == told
