"""Scenes in which no plan can be safe: the reason, in a sentence, without a certificate."""

import itertools
import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import once
from parc_jax.common.sets.extent import bounding_box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import counted, exact, rounded_down
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.bound.statement import in_box
from parc_jax.learning.labels import degrees_hint, name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.rounding import outputs_within
from parc_jax.learning.system import TURNS
from parc_jax.problem.body import Disc, Polygon, numbered
from parc_jax.problem.problem import box_of_rows, goal_box
from parc_jax.problem.robust.nominal import at_start
from parc_jax.problem.world.outlines import Edge
from parc_jax.safe_set.verdict.scene import Scene

GROWN = "with obstacles, goal, body and tube as the uncertainty has them, "
DECIMALS = 9  # of ends in words, which are of float64
NEAR = 1e-9  # [share of the sizes] by which a body must reach deeper, so that rounding is no word


class Reason(NamedTuple):
    """The reason why no plan is safe.

    words: a sentence. of_scene: it holds for every model and tube, and of the scene itself, no
        uncertainty allowed for.
    sure: no search is needed; shown in float64 with margins that pay for rounding, and no
        uncertainty made obstacles larger than they are.
    """

    words: str
    of_scene: bool
    sure: bool = False


def why_none(scene: Scene) -> Reason | None:
    """Why no plan can be safe: the body touches one obstacle from everywhere in the goal, or in the
    start set, no plan of the model gets from there to the goal, or the tube is wider than the goal.
    None where nothing of this is so, which says nothing.
    """
    found = _reason(scene)
    if found is not None and scene.nominal.turned:
        found = found._replace(words=f"in the robot's frame, {found.words}")
    if found is None or scene.nominal.uncertainty is None:
        return found
    return Reason(GROWN + found.words, of_scene=False)


def _reason(scene: Scene) -> Reason | None:
    if (found := _touching(scene, of_model=False)) is not None:
        return Reason(*found, sure=True)
    if all(faces.allow_none.all() for faces in scene.model.tube.templates or ()):
        touched = _touching(scene, of_model=True)
        words = _out_of_reach(scene) if touched is None else touched[0]
        if words is not None:
            return Reason(words, False, sure=True)
    words = no_end_fits(scene)
    return None if words is None else Reason(words, False)


def no_end_fits(scene: Scene) -> str | None:
    """Why no plan can be safe, where the tube is wider than the goal in all bins of K; or None."""
    model, box = scene.model, scene.model.claim.law.box
    lo, hi = goal_box(scene.problem.goal, model.layout)
    axes, templates = np.eye(model.tube.final.shape[1]), model.tube.templates
    errors = at(model.tube.final_errors, (slice(None), None))
    half = (errors.support(axes) + errors.support(-axes)) / 2
    short = _shortfall(half, hi - lo)
    if (short > 0).any(axis=1).all() and templates is not None:
        # these supports are bounds from above: what is said of the tube is looked at itself
        final = templates.final
        for bin, axis in np.argwhere((short > 0) & np.isfinite(short)):
            u, c, s = final.directions[bin], final.centre[bin], final.half[bin]
            around = bounding_box(HPolytope(np.r_[u, -u], np.r_[s + c, s - c]))
            # 0 where no bound was proved: nothing is said of that bin then
            half[bin, axis] = np.nan_to_num(around.radius[axis], posinf=0.0)
        short = _shortfall(half, hi - lo)
    if not (short > 0).any(axis=1).all():
        return None
    axis = int(np.argmax(short.min(axis=0)))
    least = half.min(axis=0)
    if not np.isfinite(least).all():
        return (
            f"no plan keeps to bins of {box} that have a claim; a value on an edge is in the bins "
            "on both sides."
        )
    if short[:, axis].min() <= 0:
        return f"in every bin of {box} the goal is narrower than the tube's end along some axis."
    width = exact(round((hi - lo)[axis], DECIMALS))
    return (
        f"the goal is narrower than the tube at the end: its {_named(model, axis)} is "
        f"{width} wide, and the error there is bounded by no less "
        f"than ±{rounded_down(str(least[axis]), 3)}."
    )


def _shortfall(half: Float[np.ndarray, "bins y"], width: Float[np.ndarray, " y"]) -> np.ndarray:
    """(n_bins, n_c + n_q) by how much a goal of this width is too narrow for errors up to half."""
    asked = np.isfinite(width)
    short = np.full(half.shape, -np.inf)
    short[:, asked] = 2 * half[:, asked] - width[asked]
    return short


def _touching(scene: Scene, of_model: bool) -> tuple[str, bool] | None:
    """Which obstacle the body touches from everywhere in the goal, or in the start set: in words,
    and whether it stands there. of_model: in the start set, with the points that the model places.
    """
    problem, start = scene.problem, _start(scene)
    obstacles = list(zip(problem.obstacles, problem.all_spans, strict=True))
    # what is about the first point: boxes lo, hi of p + v, grown by a radius [m]
    parts, zero = numbered(problem.body, scene.model.points), np.zeros((2, scene.model.n_p))
    about_first = [one for x in parts if 0 in x.points for one in _grown(x.shape, zero)]
    body = list(_at_the_start(scene)) if of_model else about_first
    places = []
    if not of_model:
        last = scene.model.time.n_steps - 1
        places.append(("wherever in the goal a plan ends", (scene.z_lo, scene.z_hi), last))
    if start is not None:
        alone = scene.at is not None
        where = "where the plan starts" if alone else "wherever in the start set a plan starts"
        places.append((where, start, 0))
    for where, (lo, hi), t in places:
        for j, (obstacle, span) in enumerate(obstacles):
            if span is not None and not span[0] <= t <= span[1]:
                continue
            for box_lo, box_hi, radius in body:
                corners = itertools.product(*zip(lo + box_lo, hi + box_hi, strict=True))
                if all(_touches(obstacle, np.array(z), radius) for z in corners):
                    reach = f", which reaches {exact(radius)} m from there," if radius else ""
                    edge = isinstance(obstacle, Edge)
                    hit = "leaves the free space that is told" if edge else f"touches obstacle {j}"
                    # what moves is told of as more places than it has; beyond an edge may be free
                    return f"{where}, the body{reach} {hit}.", span is None and not edge
    return None


def _at_the_start(scene: Scene):
    """The same at the start, of points and their means, wherever the model has them for some k."""
    model, start = scene.model, once(scene.model, at_start)
    for part in numbered(scene.problem.body, model.points):
        points = start[:, list(part.points)]
        for box in (*np.moveaxis(points, 1, 0), points.mean(axis=1)):
            yield from _grown(part.shape, box)


def _grown(shape: Disc | Polygon, box: np.ndarray):
    if isinstance(shape, Disc):
        yield (*box, float(shape.radius))
    else:
        for vertex in shape.vertices:
            yield (*(box + vertex), 0.0)


def _out_of_reach(scene: Scene) -> str | None:
    """Whether no plan ends in the goal, by bounds of the model's outputs over pieces of K."""
    model, start = scene.model, _start(scene)
    n_ends = model.n_c + model.n_q
    lo, hi = once(model, _outputs, model.net.n_out - n_ends, model.net.n_out)
    A, b = scene.problem.goal.A, scene.problem.goal.b
    known = start is not None
    if not known:  # from anywhere a plan gets anywhere, but not to any q
        of_q = ~A[:, : model.n_c].any(axis=1)
        A, b, start = A[of_q], b[of_q], np.zeros((2, model.n_p))
    from_lo, from_hi = (np.r_[np.tile(side, model.n_points), np.zeros(model.n_q)] for side in start)
    lo, hi = lo + from_lo, hi + from_hi
    least = lo @ np.maximum(A, 0.0).T + hi @ np.minimum(A, 0.0).T
    if not (least > b + float(scene.slack) * np.abs(A).sum(axis=1)).any(axis=1).all():
        return None
    whose = " from where it starts" if scene.at is not None else " from the start set"
    words = f"no plan of the model ends in the goal{whose if known else ''}, whatever its k"
    words += in_box(model.claim.law.box, " in ")
    goal_lo, goal_hi = goal_box(scene.problem.goal, model.layout)
    lo, hi = lo.min(axis=0), hi.max(axis=0)
    missed = np.flatnonzero((goal_lo > hi) | (goal_hi < lo))
    missed = missed[missed >= (0 if known else model.n_c)]
    if not len(missed):
        return f"{words}."
    axis = int(missed[0])
    label = [*model.labels.p * model.n_points, *model.labels.q][axis]
    ends, asked = (lo[axis], hi[axis]), (float(goal_lo[axis]), float(goal_hi[axis]))
    first, last, *goal = (exact(round(end, DECIMALS)) for end in (*ends, *asked))
    return (
        f"{words}: {_named(model, axis)} at its end is between {first} and {last}, the goal "
        f"asks for {' to '.join(goal)}."
        f"{_turns_hint(model, axis, *ends, *asked)}{degrees_hint(label, *asked)}"
    )


def _named(model: TrajectoryModel, axis: int) -> str:
    """The name of a coordinate of the end, of points and then q."""
    if axis >= model.n_c:
        return name_of(model.labels.q[axis - model.n_c])
    of = f" of {model.points[axis // model.n_p]}" if model.n_points > 1 else ""
    return f"{name_of(model.labels.p[axis % model.n_p])}{of}"


def any_end_is_in(lo: np.ndarray, hi: np.ndarray, model: TrajectoryModel) -> np.ndarray:
    """Axes of the q with which all runs in the tube end between lo and hi (n_c + n_q,)."""
    least, most = once(model, _outputs, model.net.n_out - model.n_q, model.net.n_out)
    off, of_q = model.tube.final[:, model.n_c :].max(axis=0), slice(model.n_c, None)
    idle = (lo[of_q] < least.min(axis=0) - off) & (most.max(axis=0) + off < hi[of_q])
    return model.n_c + np.flatnonzero(idle)


def _turns_hint(model: TrajectoryModel, axis: int, *bounds: float) -> str:
    """A hint for a goal that whole turns would bring to where a heading ends, or nothing. bounds:
    least and most of the heading, and of the goal.
    Turns are counted, so the reason is true; but whose headings lie within half a turn may slip.
    """
    if axis < model.n_c or model.rotation is None or model.rotation[axis - model.n_c] != TURNS:
        return ""
    lo, hi, goal_lo, goal_hi = bounds
    turns = round((lo + hi - goal_lo - goal_hi) / (4 * math.pi))  # from middle to middle
    if goal_lo + 2 * math.pi * turns > hi or goal_hi + 2 * math.pi * turns < lo:
        return ""
    high, low = ("high", "low") if turns < 0 else ("low", "high")
    too = f"{counted(abs(turns), 'turn')} too {high}"
    return f" Turns are counted: is the goal told {too}, or the pose's heading too {low}?"


def _outputs(model: TrajectoryModel, first: int, end: int):
    return outputs_within(model.net, model.domain, np.arange(first, end))


def _start(scene: Scene) -> tuple[np.ndarray, np.ndarray] | None:
    """A box (lo, hi) that all plans start in; None where they may start far out."""
    if scene.at is not None:
        return scene.at, scene.at
    box = (np.inf, np.inf) if scene.problem.start is None else box_of_rows(scene.problem.start)
    return box if np.isfinite(box).all() else None


def _touches(obstacle: HPolytope, z: np.ndarray, radius: float) -> bool:
    """Is some point well inside the obstacle nearer to z than the radius, or z itself such a point?

    The nearest one comes from nonnegative multipliers of the rows (Lawson and Hanson, Solving Least
    Squares Problems, ch. 23), and is tested anew.
    """
    from scipy.optimize import nnls

    near = NEAR * (1 + np.abs(z).sum() + radius)
    norms = np.abs(obstacle.A).sum(axis=1)
    slack = obstacle.b - obstacle.A @ z - near * norms  # of the rows {A x <= slack} about z
    if (slack >= 0).all():
        return True
    if (slack < -radius * np.linalg.norm(obstacle.A, axis=1)).any():
        return False
    inner = slack - near * norms
    n = obstacle.n
    system = np.concatenate([-obstacle.A.T, -inner[None]])
    try:
        multipliers, _ = nnls(system, np.eye(n + 1)[n])
    except RuntimeError:
        return False
    rest = system @ multipliers - np.eye(n + 1)[n]
    if not rest[n] < 0:
        return False  # no point at all, as far as can be seen
    nearest = -rest[:n] / rest[n]
    return bool((obstacle.A @ nearest <= slack).all()) and np.linalg.norm(nearest) < radius - near
