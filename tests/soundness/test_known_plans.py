"""Scenes whose answer is known on paper: touching is contact, one step of room is room."""

import jax
import numpy as np
import pytest
from exact_oracle import exact_safe
from toy_models import fold_model, line_model, model_of, random_model, rectangle, uniform_tube

from parc_jax import checker
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.network.relu import relu_network
from parc_jax.planner import Planner
from parc_jax.problem.body import Polygon
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.certificate.write import (
    network_part,
    problem_part,
    sample_part,
    tube_part,
)
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = pytest.mark.soundness

ANYWHERE = box([-8, -8, -8], [8, 8, 8])
STEP = 2.0**-40  # [m] more than the float slack of these scenes
TINY = 2.0**-46  # [m] less than it


def judge(model, problem, p0, k):
    """(the planner's verdict, the exact checker's) on one plan."""
    scene = scene_of(problem, model)
    p0, k = np.array([p0], float), np.array([k], float)
    e = verdicts(scene, p0, k)
    part = sample_part(scene, model.tube, p0[0], k[0], e.path[0])
    context = checker.Context(
        problem_part(problem, model), network_part(model.net), tube_part(model.tube)
    )
    try:
        context.check_sample(part)
    except checker.Rejected:
        return bool(e.safe[0]), False
    return bool(e.safe[0]), True


def corridor(room, body=0.25, e=0.125):
    """Straight drive along the x axis between two walls; `room` [m] beyond body and tube on either
    side.
    """
    half = (body if np.isscalar(body) else 0.25) + e + room
    walls = [box([-1, half], [2, 3]), box([-1, -3], [2, -half])]
    return line_model(4, e), reach_avoid(ANYWHERE, walls, body)


SQUARE = Polygon([[-0.25, -0.25], [0.25, -0.25], [0.25, 0.25], [-0.25, 0.25]])


@pytest.mark.parametrize("body", [0.25, SQUARE], ids=["disc", "polygon"])
def test_a_gap_of_exactly_body_and_tubes_is_refused_and_one_step_more_is_accepted(body):
    plan = (0.0, 0.0), (1.0, 0.0)
    assert judge(*corridor(0.0, body), *plan) == (False, False)
    assert judge(*corridor(STEP, body), *plan) == (True, True)
    assert judge(*corridor(-STEP, body), *plan) == (False, False)
    accepted = judge(*corridor(TINY, body), *plan)
    assert accepted == (False, True)  # the float test keeps its margin, the exact one needs none


def test_a_disc_that_touches_a_corner_is_refused():
    # 3-4-5: a disc of radius 5/4 whose centre stands 5/4 from the corner of a box.
    model = line_model(4, 0.0)
    for room, expected in ((0.0, (False, False)), (STEP, (True, True)), (-STEP, (False, False))):
        problem = reach_avoid(ANYWHERE, [box([0.75 + room, 1.0 + room], [2, 2])], 1.25)
        assert judge(model, problem, (0.0, 0.0), (0.0, 0.0)) == expected


def test_the_goal_is_closed_and_shrinks_by_the_tube():
    model = line_model(4, 0.0, final=0.125)
    for room, expected in ((STEP, (True, True)), (0.0, (False, True)), (-STEP, (False, False))):
        goal = box([-2, -2, -2], [1.125 + room, 2, 2])
        assert judge(model, reach_avoid(goal, [], 0.0), (0.0, 0.0), (1.0, 0.0)) == expected


def test_the_start_set_is_closed():
    model = line_model(4, 0.0)
    for room, expected in ((STEP, (True, True)), (0.0, (False, True)), (-STEP, (False, False))):
        problem = reach_avoid(ANYWHERE, [], 0.0, start=box([-1, -1], [0.5 + room, 1]))
        assert judge(model, problem, (0.5, 0.0), (0.0, 0.0)) == expected


@pytest.mark.parametrize("width", [0.0, 1e-9, 1e-3])
def test_a_thin_obstacle_between_knots_is_seen(width):
    model = line_model(4, 0.0)
    problem = reach_avoid(ANYWHERE, [box([0.1, -1], [0.1 + width, 1])], 0.0)
    assert judge(model, problem, (0.0, 0.0), (1.0, 0.0)) == (False, False)
    assert judge(model, problem, (0.0, 0.0), (-1.0, 0.0)) == (True, True)
    assert judge(model, problem, (0.0, 1.5), (1.0, 0.0)) == (True, True)


def test_a_wall_outside_a_bounded_start_set_is_not_jumped():
    # The published code intersects both preimages of the wall with P0 before the hull, and loses
    # this collision.
    W = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    model = model_of(
        relu_network([W], [np.zeros(3)]), box([1.75, -0.25], [2.25, 0.25]), *uniform_tube(1, 0.0)
    )
    start = box([-0.1, -0.1], [0.1, 0.1])
    problem = reach_avoid(ANYWHERE, [box([0.9, -4], [1.1, 4])], 0.0, start=start)
    assert judge(model, problem, (0.0, 0.0), (2.0, 0.0)) == (False, False)
    p0, k = np.meshgrid(np.linspace(-0.1, 0.1, 9), np.linspace(1.75, 2.25, 9))
    p0, k = (np.stack([x.ravel(), 0 * x.ravel()], axis=1) for x in (p0, k))
    assert not verdicts(scene_of(problem, model), p0, k).safe.any()
    free = reach_avoid(ANYWHERE, [box([2.6, -4], [2.8, 4])], 0.0, start=start)
    assert judge(model, free, (0.0, 0.0), (2.0, 0.0)) == (True, True)


def test_an_obstacle_is_there_only_during_its_steps():
    model = line_model(4, 0.0)
    wall = box([0.3, -1], [0.4, 1])  # crossed during interval 1
    for steps, safe in (
        (None, False),
        ((1, 1), False),
        ((0, 0), True),
        ((2, 3), True),
        ((0, 1), False),
    ):
        problem = reach_avoid(ANYWHERE, [wall], 0.0, spans=[steps])
        assert judge(model, problem, (0.0, 0.0), (1.0, 0.0)) == (safe, safe)


def test_shared_bin_boundaries_take_the_wider_tube_in_floats_and_exactly():
    narrow, wide = uniform_tube(4, 0.0), uniform_tube(4, 0.5)
    line = line_model(4)
    both = [np.concatenate(parts) for parts in zip(narrow, wide, strict=True)]
    model = model_of(line.net, line.domain, *both, [[-1, 0, 1], [-1, 1]])
    near = reach_avoid(ANYWHERE, [box([-2, 0.25], [2, 1])], 0.0)
    far = reach_avoid(ANYWHERE, [box([-2, 0.75], [2, 1])], 0.0)
    assert judge(model, near, (0, 0), (-0.5, 0)) == (True, True)
    assert judge(model, near, (0, 0), (0.5, 0)) == (False, False)
    assert judge(model, near, (0, 0), (0.0, 0)) == (False, False)
    assert judge(model, far, (0, 0), (0.0, 0)) == (True, True)


def test_the_fold_has_the_safe_set_that_it_has_on_paper(rng):
    # The path rises by |k_1|, whichever sign: free below the ceiling, blind to a floor.
    model = fold_model(4, 0.0625)
    ceiling, floor = box([-4, 0.75], [4, 2]), box([-4, -2], [4, -0.25])
    problem = reach_avoid(ANYWHERE, [ceiling, floor], 0.125)
    k = rng.uniform(-1, 1, (2000, 2))
    e = verdicts(scene_of(problem, model), np.zeros((2000, 2)), k)
    np.testing.assert_allclose(
        e.clearance, np.minimum(0.75 - 0.1875 - np.abs(k[:, 1]), 0.25 - 0.1875), atol=1e-12
    )
    assert (e.safe == (np.abs(k[:, 1]) < 0.5625)).all()
    assert len(np.unique(e.pattern, axis=0)) == 4


@pytest.mark.slow
def test_volume_of_a_safe_set_known_on_paper():
    # Straight lines above a floor: z in [-1, 1]^2, start and end above -1/2: 2 * 2 * area{(z_1,
    #     k_1)}, one polytope.
    model = line_model(4, 0.0)
    goal, floor = box([-1, -1, -2], [1, 1, 2]), box([-8, -4], [8, -0.75])
    problem = reach_avoid(goal, [floor], 0.25)
    answer = Planner(model).solve(
        problem,
        jax.random.key(0),
        Settings(target=0.05, samples=10, budget_s=300),
    )
    # height of end points above the body's lowest place: both z_1 and z_1 - k_1 must be in [0, ..)
    z = 1.5
    area = z * 2 - 0.5 * 1.0  # k_1 in [-1, 1] for each z_1, less the triangle z_1 < k_1
    volume = 2 * 2 * area
    cut = answer.polytopes(jax.random.key(1), 2000)
    assert len(cut) == 1 and cut.coverage.share == answer.coverage.share == 1.0
    assert cut.volumes[0] == pytest.approx(volume, rel=1e-9)
    _, low, high = answer.cover.safe_volume(0.9999)
    assert low < volume < high
    centre, radius = cut.centre()
    assert 0 < radius <= 0.75 and answer.contains(centre[:2], centre[2:])[0]


def spike_model(height=1.0, half=1e-4):
    """Straight lines, pushed sideways by up to `height` in a diamond of half width `half` about k =
    (0.3, 0.2).
    """
    W = np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1], [1, 0], [-1, 0], [0, 1], [0, -1]])
    b = np.array(
        [0, 0, 0, 0, -0.3, 0.3, -0.2, 0.2]
    )  # relu(+-k_0), relu(+-k_1), |k - centre| in four halves
    keep = np.concatenate([np.eye(4), np.zeros((4, 4))], axis=1)
    bump = np.concatenate([np.zeros(4), np.full(4, -1.0)])[None]
    first, second = np.concatenate([keep, bump]), np.append(np.zeros(4), half)
    point = np.array([[1.0, -1, 0, 0, 0], [0, 0, 1, -1, height / half]])
    out = np.concatenate([np.kron(np.arange(1, 5)[:, None] / 4, point), [[1.0, -1, 0, 0, 0]]])
    net = relu_network([W, first, out], [b, second, np.zeros(9)])
    return model_of(net, box([-1, -1], [1, 1]), *uniform_tube(4, 0.01))


SPIKE = box([-1, -2, -2], [1, 2, 2]), [box([-4, 1.5], [4, 3])], 0.1


def test_a_hidden_spike_is_refused_and_its_surroundings_are_not():
    model, problem = spike_model(), reach_avoid(*SPIKE)
    p0, spike, beside = (0.0, 0.5), (0.3, 0.2), (0.3, 0.2 + 2e-4)
    assert judge(model, problem, p0, spike) == (False, False)
    assert judge(model, problem, p0, beside) == (True, True)


def plans_at_the_edge(seed, slack=None):
    """(model, problem, computed verdicts, plans) after a bisection on the computed verdict: the
    last bit decides.
    """
    rng = np.random.default_rng([11, seed])
    model = random_model(rng, 2, (3,), (1, 1), 0.05)
    body = (
        rng.uniform(0, 0.2),
        Polygon(0.1 * np.array([[-1, -1], [2, 0], [0, 1.5]]) * rng.uniform(0.5, 1)),
    )[seed % 2]
    problem = reach_avoid(box([-9, -9, -99], [9, 9, 99]), [rectangle(rng, [0.3, 0.7], 0.3)], body)
    scene = scene_of(problem, model)
    if slack is not None:
        scene = scene.replace(slack=np.float64(slack))
    k, way = rng.uniform(-1, 1, (24, 2)), rng.normal(size=(24, 2))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    near, far = np.zeros((24, 1)), np.full((24, 1), 6.0)
    for _ in range(60):
        middle = (near + far) / 2
        safe = (verdicts(scene, 0.3 + middle * way, k).clearance > 0)[:, None]
        near, far = np.where(safe, near, middle), np.where(safe, middle, far)
    p0 = 0.3 + far * way + rng.integers(-3, 4, (24, 2)) * 2.0**-52
    return model, problem, verdicts(scene, p0, k).safe, p0, k


@pytest.mark.slow
def test_what_floats_accept_is_exactly_safe_even_at_the_last_bit():
    accepted = refused = 0
    for seed in range(4):
        model, problem, got, p0, k = plans_at_the_edge(seed)
        for i in range(24):
            assert not got[i] or exact_safe(problem, model, p0[i], k[i])
        accepted, refused = accepted + got.sum(), refused + (~got).sum()
    assert accepted > 20 and refused > 5


@pytest.mark.parametrize("opening", [1e-3, 1e-6, 1e-9])
def test_thin_wedges_are_where_their_decimals_put_them(opening):
    # The float images of the offsets would move the tip by about 1e-16 / opening, into the unsafe
    # direction for some.
    model = line_model(2, 0.0)
    for offset in (0.1, 0.3, 0.7, 1.1):
        A, b = (
            [[-opening, 1], [-opening, -1], [1, 0]],
            [1.3 * opening + offset, 1.3 * opening - offset, 2.0],
        )
        problem = reach_avoid(ANYWHERE, [hpolytope(A, b)], 0.0)
        tip = scene_of(problem, model).obstacles.vertices[0, :, 0].min()
        for room in (0.0, 1e-12, 1e-11):
            p0 = np.array([tip - room, offset])
            got, exact = judge(model, problem, p0, (0.0, 1.0))
            truth = exact_safe(problem, model, p0, np.array([0.0, 1.0]))
            assert (truth or not got) and (truth or not exact)
        assert judge(model, problem, (tip - 1e-6, offset), (0.0, 0.5))[0]
