"""Certificates of robots with several points, in the plane and in space: exact, accepted by the
checker.
"""

import copy
import json
from fractions import Fraction

import numpy as np
import pytest
from toy_bodies import points_model, points_problem
from toy_models import line_model, told

from parc_jax import checker
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.bound.error_set import at, faces, short
from parc_jax.learning.bound.tube import fitted_tube
from parc_jax.problem.body import Disc, Part, Polygon, body_of
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import answer_part, problem_part, question_parts, sample_part
from parc_jax.safe_set.verdict.pointwise import anchor, verdicts
from parc_jax.safe_set.verdict.scene import scene_of

PLANS = 300
SIZE = 0.02  # [m] of the errors


def random_faces(rng, lead, n, frames):
    """The axes and n other directions per set, off centre."""
    others = short(rng.normal(size=(*lead, n, n)), 10)
    axes = np.broadcast_to(np.eye(n), others.shape)
    centre = short(rng.normal(size=(*lead, 2 * n)) * SIZE / 4, 20)
    half = rng.uniform(SIZE / 4, SIZE, centre.shape)
    return faces(np.concatenate([axes, others], axis=-2), centre, half, frames)


def fitted(rng, model):
    """The model with templates in place of the boxes of its tube."""
    n, n_e = model.tube.n_p, model.n_c + model.n_q
    lead = (model.tube.n_bins, model.tube.n_steps, model.n_points)
    during = random_faces(rng, lead, n, False)
    at_end = random_faces(rng, lead[:1], n_e, True)
    tube = fitted_tube(model.tube.edges, during, at_end)
    return told(model, tube=tube)


@pytest.fixture(
    scope="module",
    params=[
        pytest.param((2, False), marks=pytest.mark.night, id="plane"),
        pytest.param((3, False), marks=pytest.mark.night, id="space"),
        pytest.param((2, True), id="templates in the plane"),
        pytest.param((3, True), marks=pytest.mark.slow, id="templates in space"),
    ],
)
def proved(request):
    """(model, problem, sample certificates) of the safe ones among random plans."""
    n_p, templates = request.param
    rng = np.random.default_rng([n_p, 0])
    model = points_model(rng, n_p=n_p, m=4, size=0.01)
    problem = points_problem(rng, model)
    model = fitted(rng, model) if templates else model
    scene = scene_of(problem, model)
    z = rng.uniform(scene.z_lo, scene.z_hi, (PLANS, n_p))
    k = rng.uniform(-1, 1, (PLANS, 2))
    k[::2, 0] = 0.0  # on the edge of two bins
    p0, _ = anchor(scene, z, k)
    e = verdicts(scene, p0, k)
    parts = [sample_part(scene, model.tube, p0[i], k[i], e.path[i]) for i in np.flatnonzero(e.safe)]
    return model, problem, parts


def test_safe_plans_are_accepted_and_their_parts_are_not_exchanged(proved):
    model, problem, parts = proved
    assert len(parts) >= 20 and prove(problem, model, parts)[0].all()
    exchanged = [{**part, "sep": [runs[::-1] for runs in part["sep"]]} for part in parts]
    assert not prove(problem, model, exchanged)[0].all()


def test_the_whole_file_is_accepted(proved):
    model, problem, parts = proved
    answer = answer_part(problem, model, parts, [], [], no_plan=None, meta={})
    assert answer["format"] == "parc_jax.answer/3"
    assert checker.check_answer(json.loads(json.dumps(answer))).samples == len(parts)


def test_widths_and_parts_are_spelled_by_point(proved):
    model, problem, _ = proved
    question, _, tube = question_parts(problem, model)
    assert question["points"] == 4 and len(question["goal"]["A"][0]) == model.n_c + model.n_q
    assert [part["points"] for part in question["body"]["parts"]] == [[0, 1], [2, 3]]
    assert checker.number(question["body"]["parts"][1]["radius"]) == Fraction(0.05)
    n_bins, n_steps = model.tube.n_bins, model.time.n_steps
    if model.tube.templates is None:
        spelled = np.vectorize(float.fromhex)(np.array(tube["interval"]))
        assert spelled.shape == (n_bins, n_steps, 4, model.n_p)
        assert (spelled.reshape(model.tube.interval.shape) == model.tube.interval).all()
    else:
        assert [[len(e) for e in by_point] for by_point in tube["interval"]] == [[4] * n_steps] * 2


def test_spelled_templates_reach_as_far_as_those_of_the_engine(proved):
    model, problem, _ = proved
    context = checker.Context(*question_parts(problem, model))
    rng = np.random.default_rng(0)
    for b, t, i in ((0, 0, 1), (1, 3, 3)):
        w = rng.integers(-9, 9, model.n_p)
        exact = context.interval[b][t][i].support([int(x) for x in w])
        assert float(exact) == pytest.approx(at(model.tube.errors, (b, t, i)).support(w), abs=1e-9)
    lost = model.tube.support_at_end(problem.goal.A, 1)
    exact = [context.final[1].support(a, i) for i, (a, _) in enumerate(context.goal)]
    np.testing.assert_allclose(lost, [float(x) for x in exact], rtol=1e-5)


def test_another_goal_has_other_multipliers(proved):
    """The memory of the last models is not asked: their tubes name multipliers for another goal."""
    model, problem, parts = proved
    turned = problem.replace(goal=hpolytope(problem.goal.A * 2.0, problem.goal.b * 2.0))
    assert prove(problem, model, parts[:1])[0].all() and prove(turned, model, parts[:1])[0].all()


def test_bodies_about_one_point_are_spelled_by_part():
    square = Polygon(np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]))
    body = body_of([Part((0,), Disc(0.05)), Part((0,), square)])
    goal, wall = box([-9, -9, -9], [9, 9, 9]), box([0.2, 0.3], [0.4, 0.5])
    model = line_model(4, 0.01)
    simple, several = (reach_avoid(goal, [wall], given) for given in (square, body))
    (alone,) = problem_part(simple, model)["body"]["parts"]
    assert alone["points"] == [0] and len(alone["vertices"]) == 4
    assert problem_part(several, model)["points"] == 1
    context = checker.Context(*question_parts(several, model))
    assert [part.points for part in context.parts] == [[0], [0]]
    assert context.parts[0].radius == Fraction(0.05) and len(context.parts[1].vertices) == 4


def test_other_points_are_another_question(proved):
    """The checker's memory of the last models is not asked about other points."""
    model, problem, _ = proved
    first = checker.Context(*question_parts(problem, model))
    question = copy.deepcopy(problem_part(problem, model))
    question["points"] = 2
    with pytest.raises(checker.Rejected):
        first.about(question)
