"""No safe plan for bodies of several points, in the plane and in space: verdicts that switch where
the body just fits, and leaves judged by an independent computation of distances. [T30, T35]
"""

import itertools

import jax
import numpy as np
import pytest
from scipy.optimize import nnls
from toy_bodies import points_model, points_problem
from toy_models import assumed

from parc_jax import checker
from parc_jax.body import Disc, Part, Polygon, body_of, hull, numbered
from parc_jax.certificate.write import question_parts
from parc_jax.claim.faces import faces
from parc_jax.claim.tube import fitted_tube, zero_tube
from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.predict import by_point, moved_to, trajectories
from parc_jax.network.relu import relu_network
from parc_jax.planner import Planner
from parc_jax.problem import goal_of_points, reach_avoid
from parc_jax.sets.box import box
from parc_jax.settings import Settings
from parc_jax.system import time_grid
from parc_jax.verdict.scene import scene_of
from parc_jax.volume_bounds.no_plan import prove_no_plan

T = 4
HEAVY = 1e4  # weight of the row that makes shares sum to one


def between_faces(half: np.ndarray):
    """Faces along the axes, with these half widths (..., n), and one across the first two."""
    n = half.shape[-1]
    directions = np.concatenate([np.eye(n), np.eye(1, n) + np.eye(1, n, 1)])
    half = np.concatenate([half, half[..., :1] + half[..., 1:2]], axis=-1)
    return faces(np.broadcast_to(directions, (*half.shape, n)), np.zeros(half.shape), half)


def bar_model(
    n_p: int = 2, e: float = 0.05, length: float = 0.5, fitted: bool = False
) -> TrajectoryModel:
    """A bar along x that does not turn: its tail moves by (t / T) (k_0, k_1), q = k_0. fitted: its
    errors are between faces, one across the axes among them.
    """
    knots = np.repeat(np.arange(T + 1) / T, 2)
    W = np.kron(knots[:, None], np.eye(n_p, 2))[n_p:]
    bar = np.tile([*np.zeros(n_p), length, *np.zeros(n_p - 1)], T + 1)[n_p:]
    net = relu_network([np.concatenate([W, [[1.0, 0.0]]])], [np.append(bar, 0.0)])
    domain = box([-1, -1], [1, 1])
    nothing = zero_tube([[-1.0, 1.0]] * 2, T, 2 * n_p, 2 * n_p + 1, 2)
    wide = nothing.replace(interval=nothing.interval + e, final=nothing.final + e)
    if fitted:
        during = between_faces(by_point(wide.interval, 2))
        wide = fitted_tube(wide.edges, during, between_faces(wide.final))
    claim = assumed(wide, domain)
    return trajectory_model(
        net, claim, domain, time_grid(1 / T, 1.0), "toy", points=("tail", "tip")
    )


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
    options = {"budget_s": 300, "max_leaves": 200} | options
    return prove_no_plan(model, scene_of(problem, model), **options)


@pytest.mark.parametrize("n_p", [2, 3])
def test_verdicts_switch_once_as_the_gap_widens(n_p):
    """Body 2 x 0.25 and error 2 x 0.05: nothing fits below 0.6."""
    model = bar_model(n_p)
    kinds = []
    for gap in (0.3, 0.59, 0.61, 0.8):
        answer = decide(model, walls(model, gap))
        kinds.append("safe" if answer.safe_plan else answer.kind)
    assert kinds == ["proved", "proved", "safe", "safe"]


def test_the_proof_is_in_the_file_of_the_answer(tmp_path):
    model = bar_model()
    settings = Settings(no_plan_budget_s=300.0)
    answer = Planner(model).solve(walls(model, 0.59), jax.random.key(0), settings)
    assert answer.statement().startswith("Proved in exact arithmetic: the model has no safe")
    written = checker.load(answer.save(tmp_path / "answer.json"))
    assert written["format"] == "parc_jax.answer/2"
    report = checker.check_answer(written)
    assert report.no_plan["kind"] == "proved" and report.samples == 0


def test_a_bar_over_a_pole_is_one_box():
    """Each corner of the box of ends has its own point of the bar on the pole."""
    model = bar_model(length=1.3)
    problem = ending(model, [box([4.05, -1], [4.1, 1])], hull("tail", "tip"))
    answer = decide(model, problem)
    assert answer.kind == "proved" and answer.leaves <= 4
    leaves = [node.get("bounded", node) for node in answer.certificate["tree"]]
    hits = [leaf["hit"] for leaf in leaves if "hit" in leaf]
    assert any(len(groups) > 1 for *_, groups in hits)
    shorter = decide(bar_model(length=0.9), problem)
    assert shorter.safe_plan is not None


def test_a_polygon_may_grow_a_part():
    """A tip that carries a triangle: its lower corner reaches 0.3 down."""
    triangle = Polygon(np.array([[0.0, -0.3], [0.1, 0.1], [-0.1, 0.1]]))
    model = bar_model()
    body = body_of([hull("tail"), Part(("tip",), triangle)])
    for top, kind in ((-0.1, "undecided"), (0.3, "proved")):
        answer = decide(model, ending(model, [box([2, -5], [5, top])], body))
        assert answer.kind == kind
        assert (answer.safe_plan is None) == (kind == "proved")


def test_no_proof_is_searched_for_a_robot_whose_tube_has_no_claim():
    model = bar_model(e=np.inf)
    answer = decide(model, walls(model, 0.3), max_leaves=20)
    assert answer.kind == "undecided" and answer.unsafe == 0


def test_nothing_is_searched_under_a_tube_between_faces():
    """The half widths around such a tube allow errors that it does not."""
    model = bar_model(fitted=True)
    answer = decide(model, walls(model, 0.3))
    assert answer.kind == "undecided" and answer.undecided == answer.total
    assert "a tube of half widths" in answer.statement()
    with pytest.raises(InputError, match="bound_volume: expected a tube of half widths"):
        decide(model, walls(model, 0.3), bounds=True)


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


def clearance(model, problem, path, half, o, part, t, share) -> float:
    """Distance of a part from an obstacle at one moment, for the worst errors: path (T + 1, n_c),
    half (T, m, n_p).
    """
    own = list(part.points)
    places = by_point((1 - share) * path[t] + share * path[t + 1], model.n_points)[own]
    signs = np.array(list(itertools.product((-1, 1), repeat=model.n_p)))
    around = (places[:, None] + signs[None] * half[t, own][:, None]).reshape(-1, model.n_p)
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
    half = by_point(model.tube.interval[bin], model.n_points)
    parts = numbered(problem.body, model.points)
    lost = np.abs(problem.goal.A) @ model.tube.final[bin]
    misses = problem.goal.A @ np.concatenate([path[-1], q]) + lost - problem.goal.b
    if name == "goal":
        return misses.max() > -1e-9
    if name == "hit":
        o, number, t, share, _ = what
        share = float(checker.number(share))
        return clearance(model, problem, path, half, o, parts[number], t, share) < 1e-6
    assert name == "safe"
    rooms = [
        clearance(model, problem, path, half, o, part, t, share)
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


@pytest.mark.soundness
@pytest.mark.parametrize(("n_p", "seed", "leaves"), [(2, 1, 250), (2, 7, 250), (3, 7, 150)])
def test_every_leaf_says_the_truth_of_random_plans(n_p, seed, leaves):
    rng = np.random.default_rng([n_p, seed])
    model = points_model(rng, n_p=n_p, m=4, size=0.03)
    problem = points_problem(rng, model)
    # larger than life, so that few boxes tell something
    problem = reach_avoid(
        problem.goal,
        [box(c.min(0) - 0.3, c.max(0) + 0.3) for c in map(corners_of, problem.obstacles)],
        problem.body,
    )
    if seed == 7:
        problem = with_polygon(problem, model)
    answer = decide(model, problem, max_leaves=leaves, bounds=True)
    plan = answer.certificate
    context = checker.Context(*question_parts(problem, model))
    assert checker.check_no_plan(context, plan)["kind"] == plan["kind"]
    z_lo, z_hi = (np.array([float(checker.number(v)) for v in plan["z"][s]]) for s in ("lo", "hi"))
    lo, hi = (np.concatenate(ends) for ends in ((z_lo, [-1, -1]), (z_hi, [1, 1])))
    seen = dict.fromkeys(("goal", "hit", "safe", "open"), 0)
    for x in rng.uniform(lo, hi, (400, n_p + 2)):
        leaf = leaf_of(plan, lo, hi, x)
        if leaf[2]:
            seen[leaf[0]] += 1
            if leaf[0] != "open" and seen[leaf[0]] < 40:
                assert judge(model, problem, leaf, x[:n_p], x[n_p:]), leaf
            if leaf[0] == "hit" and seen["hit"] < 10:
                assert not judge(model, problem, ("safe", None, True), x[:n_p], x[n_p:])
    assert seen["hit"] + seen["goal"] > 10
