"""No safe plan for bodies of several points, in the plane and in space: verdicts that switch where
the body just fits, and leaves judged by an independent computation of distances. [T30, T35]
"""

import itertools

import numpy as np
import pytest
from profiles import on_finer
from scipy.optimize import linprog, nnls
from scipy.spatial import HalfspaceIntersection
from toy_bodies import points_model, points_problem
from toy_models import assumed, told

from parc_jax import checker
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.tube import fitted_tube, zero_tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.predict import by_point, moved_to, trajectories
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.body import Disc, Part, Polygon, body_of, hull, numbered
from parc_jax.problem.problem import goal_of_points, reach_avoid
from parc_jax.proof.absence.branch_and_bound import BranchAndBound
from parc_jax.proof.absence.errors import end_rows
from parc_jax.proof.absence.prove_no_plan import prove_no_plan
from parc_jax.proof.absence.tree import Node, choose_split
from parc_jax.proof.certificate.write import question_parts
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.verdict.scene import scene_of

T = 4
HEAVY = 1e4  # weight of the row that makes shares sum to one


def between_faces(half: np.ndarray, across: float = np.inf, centre: float = 0.0):
    """Faces along the axes, with these half widths (..., n), and across the first two, of another
    one at most; about errors of centre along the first axis.
    """
    n = half.shape[-1]
    directions = np.eye(n)
    directions[0, 1], directions[1, 0] = 1, -1
    own = np.minimum(half[..., :1] + half[..., 1:2], across)
    half = np.concatenate([half, own, own, half[..., 2:]], axis=-1)
    directions = np.broadcast_to(np.concatenate([np.eye(n), directions]), (*half.shape, n))
    return faces(directions, centre * directions[..., 0], half, frames=n > 3)


def bar_model(
    n_p: int = 2, e: float = 0.05, length: float = 0.5, fitted: bool = False, **of_faces
) -> TrajectoryModel:
    """A bar along x that does not turn: its tail moves by (t / T) (k_0, k_1), q = k_0. fitted: its
    errors are `between_faces` in the plane.
    """
    knots = np.repeat(np.arange(T + 1) / T, 2)
    W = np.kron(knots[:, None], np.eye(n_p, 2))[n_p:]
    bar = np.tile([*np.zeros(n_p), length, *np.zeros(n_p - 1)], T + 1)[n_p:]
    net = relu_network([np.concatenate([W, [[1.0, 0.0]]])], [np.append(bar, 0.0)])
    nothing = zero_tube([[-1.0, 1.0]] * 2, T, 2 * n_p, 2 * n_p + 1, 2)
    wide = nothing.replace(interval=nothing.interval + e, final=nothing.final + e)
    if fitted:
        during = between_faces(by_point(wide.interval, 2), **of_faces)
        wide = fitted_tube(wide.edges, during, between_faces(wide.final))
    return trajectory_model(net, assumed(net, wide, points=("tail", "tip")))


def ending(model, obstacles, body):
    """The tail ends in 3 <= x <= 4, other axes within 1/2."""
    lo, hi = [3.0] + [-0.5] * (model.n_p - 1), [4.0] + [0.5] * (model.n_p - 1)
    goal = goal_of_points(model.points, {"tail": box(lo, hi)}, box([-1], [1]))
    return reach_avoid(goal, obstacles, body)


def walls(model, gap: float):
    """Two blocks on either side of y = 0, `gap` apart, all along the end."""
    rest = [5.0] * (model.n_p - 2)
    far = [-5.0] * (model.n_p - 2)
    above = box([2, gap / 2, *far], [5, gap / 2 + 2, *rest])
    below = box([2, -gap / 2 - 2, *far], [5, -gap / 2, *rest])
    return ending(model, [above, below], hull("tail", "tip", radius=0.25))


def decide(model, problem, **options):
    options = {"limit": Limit(300), "max_leaves": 200} | options
    return prove_no_plan(scene_of(problem, model), **options)


@pytest.mark.night
@pytest.mark.parametrize("bins", [1, 3])
def test_slanted_faces_make_room_that_a_box_has_not(bins):
    """Walls along (1, 1), and errors up to 0.3 along them but 0.02 across: a gap of 2 x 0.25 for
    the body and 2 x 0.02 for the errors. Nothing fits below 0.54; half widths would need 0.92.
    """
    turn = np.array([[1.0, -1.0], [1.0, 1.0]]) / np.sqrt(2)
    model = bar_model(e=0.3, length=0.0, fitted=True, across=0.02 * np.sqrt(2))
    goal = goal_of_points(model.points, {"tail": box([-0.4, -0.4], [0.4, 0.4])}, box([-1], [1]))
    edges = [np.linspace(-1, 1, bins + 1), [-1.0, 1.0]]
    model = told(model, tube=on_finer(model.tube, edges))
    kinds = []
    for gap in (0.4, 0.52, 0.55, 0.7):
        walls = []
        for side in (1, -1):
            # along the way |x| <= 9, across it from half the gap to 2
            rows = np.array([turn[1], -turn[1], side * turn[0], -side * turn[0]])
            walls.append(hpolytope(rows, [9, 9, 2, -gap / 2]))
        body = hull("tail", "tip", radius=0.25)
        answer = decide(model, reach_avoid(goal, walls, body), max_leaves=600)
        kinds.append("safe" if answer.safe_plan else answer.kind)
    assert kinds == ["proved", "proved", "safe", "safe"]


def test_a_reason_that_one_side_brings_comes_before_a_nearer_one_of_many_sides():
    """The first holds on 1 - 2 x 0.4 of a side, the second on 1 - 2 x 0.3 of each of four. Where
    neither holds in the middle, the nearer one decides.
    """
    node = Node(-np.ones(4), np.ones(4))
    tube = zero_tube([[-1.0, 1.0]] * 2, T, 4, 5, 2)
    effects = np.array([[1.0, 0, 0, 0], [1, 1, 2, 1]])
    assert choose_split(node, np.array([-0.4, -1.5]), effects, tube) == (0, 0.0)
    assert choose_split(node, np.array([-0.7, -3.0]), effects, tube) == (2, 0.0)
    reachless = np.array([-np.inf, -np.inf, -0.1])  # neither does a reason that no side brings
    effects = np.concatenate([effects, np.zeros((1, 4))])
    assert choose_split(node, reachless, effects, tube)[0] in (2, 3)


@pytest.mark.night
def test_a_polygon_may_grow_a_part():
    """A tip that carries a triangle: its lower corner reaches 0.3 down."""
    triangle = Polygon(np.array([[0.0, -0.3], [0.1, 0.1], [-0.1, 0.1]]))
    model = bar_model()
    body = body_of([hull("tail"), Part(("tip",), triangle)])
    for top, kind in ((-0.1, "undecided"), (0.3, "proved")):
        answer = decide(model, ending(model, [box([2, -5], [5, top])], body))
        assert answer.kind == kind
        assert (answer.safe_plan is None) == (kind == "proved")


def test_a_robot_whose_tube_has_no_claim_has_no_plan():
    model = bar_model(e=np.inf)
    answer = decide(model, walls(model, 0.3), max_leaves=20)
    assert answer.kind == "undecided" and answer.leaves == 1  # and nothing is searched
    assert "no plan keeps to bins of K that have a claim" in answer.details()


@pytest.mark.night
def test_ends_keep_to_the_last_interval_too():
    """The end allows more than the last interval: the errors of goal rows are those of both."""
    model = bar_model(fitted=True)
    wide = model.tube.templates.final
    wide = wide.with_half(4 * wide.half)
    tube = fitted_tube(model.tube.edges, model.tube.templates.interval, wide)
    model = told(model, tube=tube)
    # 0.1 wide, as much as the errors of the last interval: at 0.09 nothing fits
    for width, kind in ((0.09, "proved"), (0.25, "undecided")):
        goal = goal_of_points(
            model.points, {"tail": box([3.0, -0.5], [3.0 + width, 0.5])}, box([-1], [1])
        )
        answer = decide(model, reach_avoid(goal, [box([9, 9], [10, 10])], hull("tail", "tip")))
        assert answer.kind == kind and answer.certificate is not None


def test_a_tube_that_leaves_out_the_model_is_not_searched():
    """Nothing shows then that its errors are those of a trajectory."""
    model = bar_model(fitted=True, centre=0.2)
    answer = decide(model, walls(model, 0.3))
    assert answer.kind == "undecided" and answer.undecided == answer.total
    assert "a tube around the model itself" in answer.details()


def leaf_of(plan, lo, hi, x):
    """The leaf of a tree that holds the point x, and whether x is well inside of it."""
    nodes = iter(plan["tree"])

    def walk(lo, hi, inside):
        ((name, what),) = next(nodes).items()
        if name == "bounded":
            ((name, what),) = what.items()
        if name != "split":
            return (name, what, (x - lo).min() > 1e-6 and (hi - x).min() > 1e-6) if inside else None
        axis, at = what[0], float(checker.number(what[1]))
        middle = np.array(hi), np.array(lo)
        middle[0][axis] = middle[1][axis] = at
        below = walk(lo, middle[0], inside and x[axis] <= at)
        above = walk(middle[1], hi, inside and x[axis] > at)
        return below or above

    return walk(lo, hi, True)


def distance(points: np.ndarray) -> float:
    """Distance of the origin from the hull of points (n, d), by least squares over shares >= 0."""
    size = np.abs(points).max()
    A = np.concatenate([points.T / size, np.full((1, len(points)), HEAVY)])
    share, _ = nnls(A, np.append(np.zeros(points.shape[1]), HEAVY))
    return float(np.linalg.norm(points.T @ (share / share.sum())))


def corners_of(obstacle) -> np.ndarray:
    """(2^n, n) corners of a polytope that was made of a box."""
    n = obstacle.n
    return np.array(list(itertools.product(*np.stack([-obstacle.b[n:], obstacle.b[:n]], axis=1))))


def errors_of(model, bin, t, i) -> np.ndarray:
    """(v, n_p) corners of the errors that a bin allows at a point in an interval."""
    tube = model.tube
    if tube.templates is None:
        signs = np.array(list(itertools.product((-1, 1), repeat=model.n_p)))
        return signs * by_point(tube.interval[bin, t], model.n_points)[i]
    rows = tube.templates.interval.rows((bin, t, i))
    table = np.array([[*map(float, a), -float(b)] for a, b in rows])
    return HalfspaceIntersection(table, np.zeros(model.n_p)).intersections


def lost_at_end(model, bin, row) -> float:
    """The most that a row of the goal loses by errors at the end."""
    tube = model.tube
    if tube.templates is None:
        return np.abs(row) @ tube.final[bin]
    rows = end_rows(tube.templates, bin)
    A, b = ([list(map(float, a)) for a, _ in rows], [float(b) for _, b in rows])
    return -linprog(-row, A_ub=A, b_ub=b, bounds=(None, None)).fun


def clearance(model, problem, path, bin, o, part, t, share) -> float:
    """Distance of a part from an obstacle at one moment, for the worst errors: path (T + 1,
    n_c).
    """
    own = list(part.points)
    places = by_point((1 - share) * path[t] + share * path[t + 1], model.n_points)
    around = np.concatenate([places[i] + errors_of(model, bin, t, i) for i in own])
    if isinstance(part.shape, Polygon):
        around = (around[:, None] + part.shape.vertices[None]).reshape(-1, model.n_p)
    apart = (around[:, None] - corners_of(problem.obstacles[o])[None]).reshape(-1, model.n_p)
    radius = part.shape.radius if isinstance(part.shape, Disc) else 0.0
    return distance(apart) - radius


def judge(model, problem, leaf, z, k):
    """Is what a leaf says of the plan with k that ends in z true, by distances?"""
    name, what, _ = leaf
    offsets, q = (x[0] for x in trajectories(model.net, model.layout, k[None]))
    path = moved_to(z - offsets[-1, : model.n_p], offsets)
    bin = int(model.tube.bin_of(k))
    parts = numbered(problem.body, model.points)
    lost = np.array([lost_at_end(model, bin, row) for row in problem.goal.A])
    misses = problem.goal.A @ np.concatenate([path[-1], q]) + lost - problem.goal.b
    if name == "goal":
        return misses.max() > -1e-9
    if name == "hit":
        o, number, t, share, _ = what
        share = float(checker.number(share))
        return clearance(model, problem, path, bin, o, parts[number], t, share) < 1e-6
    assert name == "safe"
    rooms = [
        clearance(model, problem, path, bin, o, part, t, share)
        for o in range(len(problem.obstacles))
        for part in parts
        for t in range(model.time.n_steps)
        for share in (0.0, 0.3, 0.6, 1.0)
    ]
    return misses.max() <= 0 and min(rooms) > 0


def with_polygon(problem, model):
    square = np.array(list(itertools.product((-0.07, 0.07), repeat=model.n_p)))
    parts = [Part(model.points[:3], Polygon(square)), hull(model.points[-1], radius=0.1)]
    return reach_avoid(problem.goal, problem.obstacles, body_of(parts))


@pytest.mark.night
@pytest.mark.soundness
@pytest.mark.parametrize(
    ("n_p", "seed", "leaves", "fitted"),
    [
        (2, 1, 250, False),
        (2, 7, 250, False),
        (3, 7, 150, False),
        (2, 1, 250, True),
        (3, 7, 150, True),
    ],
)
def test_every_leaf_says_the_truth_of_random_plans(n_p, seed, leaves, fitted, monkeypatch):
    rng = np.random.default_rng([n_p, seed])
    model = points_model(rng, n_p=n_p, m=4, size=0.03, fitted=fitted, around_zero=True)
    problem = points_problem(rng, model)
    # larger than life, so that few boxes tell something
    problem = reach_avoid(
        problem.goal,
        [box(c.min(0) - 0.3, c.max(0) + 0.3) for c in map(corners_of, problem.obstacles)],
        problem.body,
    )
    if seed == 7:
        problem = with_polygon(problem, model)
    monkeypatch.setattr(BranchAndBound, "_try_plans", lambda *_: None)  # no plan ends it early
    answer = decide(model, problem, max_leaves=leaves)
    plan = answer.certificate
    context = checker.Context(*question_parts(problem, model))
    assert checker.check_no_plan(context, plan)["kind"] == plan["kind"]
    z_lo, z_hi = (np.array([float(checker.number(v)) for v in plan["z"][s]]) for s in ("lo", "hi"))
    lo, hi = (np.concatenate(ends) for ends in ((z_lo, [-1, -1]), (z_hi, [1, 1])))
    seen = dict.fromkeys(("goal", "hit", "open"), 0)
    for x in rng.uniform(lo, hi, (400, n_p + 2)):
        leaf = leaf_of(plan, lo, hi, x)
        if leaf[2]:
            seen[leaf[0]] += 1
            if leaf[0] != "open" and seen[leaf[0]] < 40:
                assert judge(model, problem, leaf, x[:n_p], x[n_p:]), leaf
            if leaf[0] == "hit" and seen["hit"] < 10:
                assert not judge(model, problem, ("safe", None, True), x[:n_p], x[n_p:])
    assert seen["hit"] + seen["goal"] > 10
