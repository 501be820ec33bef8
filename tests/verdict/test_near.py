"""A scene without what no plan comes near: the same verdicts, and proofs of what was left out."""

import numpy as np
import pytest
from toy_bodies import points_model, points_problem
from toy_models import line_model, random_model, random_polygon, random_problem

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.network.predict import by_point
from parc_jax.problem.body import hull
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import sample_part
from parc_jax.safe_set.separation.pruning import extent_in
from parc_jax.safe_set.verdict.pointwise import anchor, verdicts
from parc_jax.safe_set.verdict.scene import pruned_scene, scene_of, unpruned_scene

SLACKS = 1e-10  # [m] the slack of a scene grows with its size
GOAL = box([-0.5, -0.5, -1], [0.5, 0.5, 1])


def crowded(kind: str, seed: int):
    """A random model and a scene of many obstacles, some of them where no plan comes."""
    rng = np.random.default_rng(seed)
    if kind == "point":
        model = random_model(rng, bins=(2, 1))
        problem = random_problem(rng, model, 2, start=bool(seed % 2))
    else:
        model = points_model(rng, n_p=2, m=4, fitted=kind == "fitted")
        problem = points_problem(rng, model)
    places = rng.normal(size=(10, 2)) * 2.5
    more = tuple(random_polygon(rng, at, rng.uniform(0.1, 0.6)) for at in places)
    spans = (*problem.all_spans, *([None, (0, 1)] * 5))
    return model, problem.replace(obstacles=(*problem.obstacles, *more), spans=spans), rng


def plans_of(model, scene, rng, n: int = 400):
    """Plans that mostly reach: ends about the goal's box."""
    size = scene.z_hi - scene.z_lo
    z = rng.uniform(scene.z_lo - 0.1 * size, scene.z_hi + 0.1 * size, (n, model.n_p))
    k = rng.uniform(-1, 1, (n, model.n_k))
    return anchor(scene, z, k)[0], k


CASES = [
    ("point", 0),
    pytest.param("point", 1, marks=pytest.mark.night),
    pytest.param("body", 0, marks=pytest.mark.slow),
    *(pytest.param(kind, 2, marks=pytest.mark.night) for kind in ("point", "body", "fitted")),
]


@pytest.mark.parametrize(("kind", "seed"), CASES)
def test_verdicts_are_those_of_the_whole_scene(kind, seed):
    model, problem, rng = crowded(kind, seed)
    near, whole = pruned_scene(NominalProblem(problem, model)), scene_of(problem, model)
    assert 0 < len(near.apart.kept) < len(near.apart.row)
    p0, k = plans_of(model, whole, rng)
    mine, theirs = verdicts(near, p0, k), verdicts(whole, p0, k)
    assert (mine.safe == theirs.safe).all() and theirs.reaches.sum() > 50
    # of bodies in contact, how deep they are is not told
    mine, theirs = (e._replace(clearance=np.maximum(e.clearance, 0)) for e in (mine, theirs))
    reaches = theirs.reaches
    assert (mine.clearance <= theirs.clearance + SLACKS)[reaches].all()
    exact = mine.clearance < float(near.beyond)
    np.testing.assert_allclose(mine.clearance[exact], theirs.clearance[exact], rtol=0, atol=SLACKS)
    assert unpruned_scene(near).apart is None
    assert unpruned_scene(whole) is whole


def test_a_clearance_tells_no_more_than_what_was_left_out_allows():
    """Nothing is left in the scene, and what was left out is at a distance all the same."""
    model = line_model(4, 0.0)
    problem = reach_avoid(GOAL, [box([4.0, 4.0], [5.0, 5.0])], 0.1)
    near, whole = pruned_scene(NominalProblem(problem, model)), scene_of(problem, model)
    assert len(near.apart.kept) == 0 and 1 < float(near.beyond) < 5
    p0, k = plans_of(model, whole, np.random.default_rng(0))
    mine, theirs = verdicts(near, p0, k), verdicts(whole, p0, k)
    assert (mine.clearance == float(near.beyond)).all()
    assert (mine.clearance <= theirs.clearance + SLACKS)[theirs.reaches].all()


@pytest.mark.parametrize(("kind", "seed"), CASES)
def test_all_plans_that_reach_stay_within_their_reach(kind, seed):
    model, problem, rng = crowded(kind, seed)
    extent, slack = extent_in(problem, model)
    p0, k = plans_of(model, scene_of(problem, model), rng, 2000)
    e = verdicts(scene_of(problem, model), p0, k)
    places = by_point(e.path[e.reaches], model.n_points)
    assert len(places) > 200 and 0 < slack < 1e-9
    for knots in (places[:, :-1], places[:, 1:]):
        assert (knots >= extent.lo).all() and (knots <= extent.hi).all()
    size = (extent.hi - extent.lo).max(axis=0)
    seen = (places.max(axis=(0, 1)) - places.min(axis=(0, 1))) / size
    assert (seen > 0.3).all()  # not so wide that nothing were ever left out
    widest = model.tube.interval.max(axis=0).reshape(extent.error.shape)
    assert (extent.error == widest).all()


@pytest.mark.parametrize(("kind", "seed"), CASES[:3])
def test_what_is_left_out_is_proved_in_every_certificate(kind, seed):
    model, problem, rng = crowded(kind, seed)
    near = pruned_scene(NominalProblem(problem, model))
    p0, k = plans_of(model, near, rng)
    e = verdicts(near, p0, k)
    i = int(np.flatnonzero(e.safe)[0])
    part = sample_part(near, model.tube, p0[i], k[i], e.path[i])
    assert prove(problem, model, [part])[0].all()
    # a certificate that names another row for what was left out is refused
    row = near.apart.row
    worse = near.apart._replace(row=np.where(row < 0, row, 0))
    wrong = near.apart._replace(row=np.where(row < 0, row, (row + 1) % 4))
    for other in (worse, wrong):
        scene = near.replace(apart=other)
        part = sample_part(scene, model.tube, p0[i], k[i], e.path[i])
        assert not prove(problem, model, [part])[0].all()


def line_scene(obstacle, e: float = 0.0, span=None, body=0.25):
    """Plans of line_model end within 0.5 of the origin and begin within 1.5 of it."""
    return reach_avoid(GOAL, [obstacle], body, spans=[span]), line_model(4, e)


@pytest.mark.parametrize(
    ("left", "e", "span", "apart"),
    [
        (1.80, 0.0, None, True),  # plans begin at 1.5, and the disc reaches 1.75
        (1.70, 0.0, None, False),
        (1.80, 0.1, None, False),  # the tube, and ends that are so much farther out, reach 1.95
        (2.00, 0.1, None, True),
        (1.30, 0.0, (3, 3), True),  # at the third knot they are within 0.5 + 0.25 of the origin
        (0.99, 0.0, (3, 3), False),
        (1.30, 0.0, (2, 3), True),  # at the second within 1.0
        (1.20, 0.0, (2, 3), False),
    ],
)
def test_an_obstacle_is_left_out_where_no_plan_comes_and_no_sooner(left, e, span, apart):
    problem, model = line_scene(box([left, -9.0], [left + 1, 9.0]), e, span)
    scene = pruned_scene(NominalProblem(problem, model))
    assert (scene.apart is not None) == apart
    if apart:
        assert scene.apart.kept.size == 0 and not scene.obstacles.active.any()
        room = left - 0.25 - (1.5 if span is None else 1.5 - 0.25 * span[0]) - 2 * e
        assert float(scene.beyond) == pytest.approx(room, abs=1e-9)


def test_every_point_of_a_part_counts_and_each_part_by_itself():
    rng = np.random.default_rng(0)
    model = points_model(rng, m=3, size=0.002)
    extent, _ = extent_in(points_problem(rng, model), model)
    hi = extent.hi.max(axis=0)
    # beyond the first point's reach along x, and not beyond the farthest one's
    far = int(np.argmax(hi[:, 0]))
    assert far != 0 and hi[far, 0] > hi[0, 0] + 0.05
    x = 0.5 * (hi[0, 0] + hi[far, 0])
    problem = points_problem(rng, model)
    wall = hpolytope([[1, 0], [-1, 0], [0, 1], [0, -1]], [x + 1, -x, 50, 50])
    both = model.points[0], model.points[far]
    problem = problem.replace(obstacles=(wall,), spans=(None,), body=hull(*both))
    assert pruned_scene(NominalProblem(problem, model)).apart is None
    alone = pruned_scene(NominalProblem(problem.replace(body=hull(both[0])), model))
    assert alone.apart is not None and alone.apart.kept.size == 0


@pytest.mark.parametrize(
    ("obstacles", "spans", "words"),
    [
        ([hpolytope([[1, 0], [-1, 0]], [101, -100])], [None], "obstacle 0: expected a bounded"),
        (
            [
                box([90, 90], [91, 91]),
                hpolytope(np.eye(2)[[0, 0, 1, 1]] * [[1], [-1], [1], [-1]], [90, -91, 91, -90]),
            ],
            [None, None],
            "obstacle 1: expected a set with points",
        ),
        ([box([90, 90], [91, 91])], [(0, 4)], "span of obstacle 0: expected last < 4"),
        ([box([90, 90, 90], [91, 91, 91])], [None], "2-D workspace"),
    ],
)
def test_far_obstacles_are_checked_as_near_ones_are(obstacles, spans, words):
    with pytest.raises(InputError, match=words):
        pruned_scene(NominalProblem(reach_avoid(GOAL, obstacles, 0.1, spans=spans), line_model()))
