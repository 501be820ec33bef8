"""A problem laid out with what can matter: obstacles that no plan comes near are proved apart once,
and cost nothing after that. [T11, T14]
"""

import numpy as np

from parc_jax.common.arrays import once
from parc_jax.common.sets.polygons import corners_of_many
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import ReachAvoid
from parc_jax.problem.robust.question import Plain
from parc_jax.safe_set.separation.pairs import corners, exists
from parc_jax.safe_set.separation.pruning import Apart, Extent, apart, extent_of, spans_of, ways_of
from parc_jax.safe_set.verdict.fits import box_of_rows, check_fits, goal_box
from parc_jax.safe_set.verdict.scene import Scene, float_slack, laid_out
from parc_jax.safe_set.verdict.sized import roomy


def near_scene(asked: Plain) -> Scene:
    """The scene of a plain question, without the obstacles that are proved apart from every plan
    that ends in the goal. Raises InputError where it does not fit the model.
    """
    found = apart_from_plans(asked.problem, asked.model)
    return roomy(laid_out(asked, found if np.isfinite(found.beyond) else None))


def scene_near_path(asked: Plain, k: np.ndarray, path: np.ndarray) -> Scene:
    """The scene of one plan k (n_k,) with the path (T + 1, n_c), without the obstacles of which one
    row keeps it apart. Raises InputError.
    """
    problem, tube = asked.problem, asked.model.tube
    _check_obstacles(problem, asked.model.time.n_steps)
    places = path.reshape(len(path), -1, asked.model.n_p)
    error = tube.interval[tube.bins_of(k[None])[0]].max(axis=0).reshape(places[1:].shape)
    slack = float(float_slack(asked.model, np.abs(places).max()))
    lo = np.minimum(places[:-1], places[1:]) - 2 * slack
    hi = np.maximum(places[:-1], places[1:]) + 2 * slack
    parts = numbered(problem.body, asked.model.points)
    found = apart(problem, parts, Extent(lo, hi, error), slack)
    return roomy(laid_out(asked, found if np.isfinite(found.beyond) else None))


def apart_from_plans(problem: ReachAvoid, model: TrajectoryModel) -> Apart:
    """Which obstacles any plan that ends in the goal may come near. Raises InputError as
    `near_scene` does.
    """
    check_fits(problem, model.n_p, model.n_q, model.points)
    _check_obstacles(problem, model.time.n_steps)
    parts = numbered(problem.body, model.points)
    extent, slack = extent_in(problem, model)
    return apart(problem, parts, extent, slack)


def whole_scene(scene: Scene) -> Scene:
    """The scene with all of its obstacles, for what asks of each, or of plans that miss."""
    return scene if scene.apart is None else once(scene, _with_all)


def _with_all(scene: Scene) -> Scene:
    return roomy(laid_out(scene.asked))


def extent_in(problem: ReachAvoid, model: TrajectoryModel) -> tuple[Extent, float]:
    """Where the points of plans that reach can be, and the slack [m] of inequalities about it.

    Such a plan ends in the goal with any error that its bin allows, so it is predicted to end in
    the goal's box moved back by all of these errors.
    """
    tube, n_p = model.tube, model.n_p
    claimed = tube.claimed  # in the other bins nothing reaches
    goal_lo, goal_hi = (x[:n_p] for x in goal_box(problem.goal, model.layout))
    final = at(tube.final_errors, (claimed, None))
    axes = np.eye(n_p, tube.final.shape[1])
    most = final.support(axes).max(axis=0, initial=0.0)
    least = -final.support(-axes).max(axis=0, initial=0.0)
    starts = np.full(n_p, -np.inf), np.full(n_p, np.inf)
    if problem.start is not None:
        starts = box_of_rows(problem.start)
    sizes = np.abs([goal_lo, goal_hi, most, least, *starts])
    slack = float(float_slack(model, sizes[np.isfinite(sizes)].max()))
    ways = once(model, ways_of)
    ends = goal_lo - most, goal_hi - least
    widest = tube.interval[claimed].max(axis=0, initial=0.0)
    return extent_of(ways, ends, starts, widest, 2 * slack, n_p), slack


def _check_obstacles(problem: ReachAvoid, n_steps: int) -> None:
    """Raises InputError for one that exists too late, is empty or unbounded. Boxes as `from_box`
    spells them show at once that they are neither.
    """
    for j in np.flatnonzero(spans_of(problem, n_steps)[:, 1] >= n_steps):
        exists(problem, int(j), n_steps)
    sides = np.zeros((0, 0))
    known = corners_of_many(problem.obstacles)
    for j, obstacle in enumerate(problem.obstacles):
        n = obstacle.n
        if known[j] is not None:
            continue
        if len(sides) != 2 * n:
            sides = np.concatenate([np.eye(n), -np.eye(n)])
        boxed = obstacle.A.shape == sides.shape and (obstacle.A == sides).all()
        if not (boxed and (obstacle.b[:n] >= -obstacle.b[n:]).all()):
            corners(obstacle, f"obstacle {j}")
