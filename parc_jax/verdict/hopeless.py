"""Why no plan of a scene can be safe, where a sentence can say it: words, and no proof of ours."""

import itertools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.claim.error_set import at
from parc_jax.model import TrajectoryModel
from parc_jax.problem.body import Disc, numbered
from parc_jax.problem.problem import ReachAvoid
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.verdict.fits import box_of_rows, goal_box
from parc_jax.verdict.scene import Scene

NEAR = 1e-9  # [share of the sizes] by which a body must reach farther, so that rounding is no word


class Why(NamedTuple):
    """words: a sentence. of_scene: no model and no tube could change it."""

    words: str
    of_scene: bool


def why_none(scene: Scene) -> Why | None:
    """Why no plan can be safe: the goal or the start set is so near to one obstacle that the body
    touches it from everywhere in there, or the tube is wider than the goal. None where nothing of
    this is so, which says nothing.
    """
    words = _covered(scene)
    if words is not None:
        return Why(words, True)
    words = no_end_fits(scene)
    return None if words is None else Why(words, False)


def no_end_fits(scene: Scene) -> str | None:
    """Why no plan can be safe, in a sentence, where the tube is wider than the goal in every bin of
    K; else None.
    """
    model = scene.model
    lo, hi = goal_box(scene.problem.goal, model.layout)
    axes, templates = np.eye(model.tube.final.shape[1]), model.tube.templates
    errors = at(model.tube.final_errors, (slice(None), None))
    half = (errors.support(axes) + errors.support(-axes)) / 2
    short = _shortfall(half, hi - lo)
    if (short > 0).any(axis=1).all() and templates is not None:
        # these supports are bounds from above: what is said of the tube is looked at itself
        for bin, axis in np.argwhere((short > 0) & np.isfinite(short)):
            half[bin, axis] = templates.final.half_extent(bin, axis)
        short = _shortfall(half, hi - lo)
    if not (short > 0).any(axis=1).all():
        return None
    axis = int(np.argmax(short.min(axis=0)))
    least = half.min(axis=0)
    if not np.isfinite(least).all():
        return (
            "no plan keeps to bins of K that have a claim; a value on an edge is in the bins on "
            "both sides."
        )
    if short[:, axis].min() <= 0:
        return "in every bin of K the goal is narrower than the tube at the end along some axis."
    return (
        f"the goal is narrower than the tube at the end: its axis {axis} is {(hi - lo)[axis]:.3g} "
        "wide, and the error "
        f"there is bounded by no less than ±{least[axis]:.3g}."
    )


def _shortfall(half: Float[np.ndarray, "bins y"], width: Float[np.ndarray, " y"]) -> np.ndarray:
    """(n_bins, n_c + n_q) by how much a goal of this width is too narrow for errors up to half."""
    asked = np.isfinite(width)
    short = np.full(half.shape, -np.inf)
    short[:, asked] = 2 * half[:, asked] - width[asked]
    return short


def _covered(scene: Scene) -> str | None:
    """Which obstacle the body touches from everywhere in the goal, or in the start set."""
    model = scene.model
    problem = scene.problem
    radius = _radius_about_first(problem, model)
    if radius is None:
        return None
    last = model.time.n_steps - 1
    places = [("wherever in the goal a plan ends", (scene.z_lo, scene.z_hi), last)]
    if scene.at is not None:
        places.append(("where the plan starts", (scene.at, scene.at), 0))
    elif problem.start is not None:
        lo, hi = box_of_rows(problem.start)
        if np.isfinite([lo, hi]).all():
            places.append(("wherever in the start set a plan starts", (lo, hi), 0))
    obstacles = list(zip(problem.obstacles, problem.all_spans, strict=True))
    for where, box, t in places:
        for j, (obstacle, span) in enumerate(obstacles):
            there = span is None or span[0] <= t <= span[1]
            if there and all(_touches(obstacle, z, radius) for z in _corners(*box)):
                return (
                    f"{where}, the body, which reaches {radius:.3g} m from the first point, "
                    f"touches obstacle {j}."
                )
    return None


def _radius_about_first(problem: ReachAvoid, model: TrajectoryModel) -> float | None:
    """[m] of the largest disc about the first reference point that belongs to the body."""
    parts = [p for p in numbered(problem.body, model.points) if 0 in p.points]
    discs = [float(p.shape.radius) for p in parts if isinstance(p.shape, Disc)]
    return max(discs, default=None)


def _corners(lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    return np.array(list(itertools.product(*zip(lo, hi, strict=True))))


def _touches(obstacle: HPolytope, z: np.ndarray, radius: float) -> bool:
    """Whether some point of the obstacle is nearer to z than the radius: the nearest is looked at,
    found as nonnegative multipliers of the rows (Lawson and Hanson, Solving Least Squares Problems,
    ch. 23).
    """
    from scipy.optimize import nnls

    slack = obstacle.b - obstacle.A @ z  # of the rows {A x <= slack} about z
    if (slack >= 0).all():
        return True
    n = obstacle.n
    system = np.concatenate([-obstacle.A.T, -slack[None]])
    try:
        multipliers, _ = nnls(system, np.eye(n + 1)[n])
    except RuntimeError:
        return False
    rest = system @ multipliers - np.eye(n + 1)[n]
    if not rest[n] < 0:
        return False  # no point at all, as far as can be seen
    nearest = -rest[:n] / rest[n]
    size = 1 + np.abs(nearest).sum() + np.abs(z).sum() + radius
    inside = (obstacle.A @ nearest <= slack + NEAR * size * np.abs(obstacle.A).sum(axis=1)).all()
    return bool(inside) and float(np.linalg.norm(nearest)) < radius - 1000 * NEAR * size
