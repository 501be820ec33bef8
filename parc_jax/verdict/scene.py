"""A problem as arrays for one model: everything a query needs, padded to few compiled shapes."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.base import struct
from parc_jax.base.arrays import as_float64, once
from parc_jax.claim.error_set import ErrorBox, at
from parc_jax.claim.tube import Tube
from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel
from parc_jax.network.predict import Layout
from parc_jax.network.rounding import UNIT, rounding_bound
from parc_jax.problem.body import Body
from parc_jax.problem.problem import ReachAvoid, require_points
from parc_jax.robust.question import Plain
from parc_jax.separation.alike import Alike, alike
from parc_jax.separation.apart import Apart
from parc_jax.separation.directions import DirectionTable, direction_table
from parc_jax.separation.pairs import Obstacles, bucket, numbered_pairs, obstacles_of
from parc_jax.sets.bounding_box import bounding_box
from parc_jax.sets.hpolytope import HPolytope

if TYPE_CHECKING:
    from parc_jax.verdict.outline import Outline

# [roundings] of a corner, of which the slack pays 64 units for each: more than `polygons.OFF`
CORNERS = 17


@struct.dataclass
class SceneArrays:
    """Padded arrays of a problem, as kernels and batches take it. A padding row is 0 x <= 1, which
    always holds. The kernels of `pointwise` take stacks of them too.

    goal_A (g, n_c + n_q), goal_b (g,): rows of the goal. start_A (s, n_p), start_b (s,): rows of
    P0. z_lo, z_hi (n_p,): box around where the goal lets the first point end, from which end
    points are drawn. k_lo, k_hi (n_k,): K, whose ends belong to it.
    obstacles: grown by the body, with which every part of it is kept clear of them.
    slack: () [m or row units] float margin [T11]: a verdict that clears it in float64 holds in
        real arithmetic.
    beyond: () [m] what is not among the obstacles stays farther away from every plan that reaches.
    """

    goal_A: np.ndarray
    goal_b: np.ndarray
    start_A: np.ndarray
    start_b: np.ndarray
    z_lo: np.ndarray
    z_hi: np.ndarray
    k_lo: np.ndarray
    k_hi: np.ndarray
    obstacles: Obstacles
    slack: np.ndarray
    beyond: np.ndarray


@struct.dataclass
class OneScene(SceneArrays):
    """The arrays of one scene whose obstacles are looked at one after another.

    count: () the first so many of the obstacles are no padding.
    """

    count: np.ndarray


@struct.dataclass
class Tabled(OneScene):
    """The same with directions of all obstacles: for facets, corridors and proofs. alike: the pairs
    by kind, for what is worked out once for a kind.
    """

    directions: DirectionTable
    alike: Alike


@struct.dataclass
class Scene(OneScene):
    """A plain question laid out, once; what is derived of it hangs from it. On the host.

    asked: the question. apart: what is not among the obstacles; None where nothing was left out.
    """

    asked: Plain = struct.field(pytree_node=False)
    apart: Apart | None = struct.field(pytree_node=False)

    @property
    def model(self) -> TrajectoryModel:
        """That is asked."""
        return self.asked.model

    @property
    def problem(self) -> ReachAvoid:
        """That is asked of it, for certificates and proofs."""
        return self.asked.problem

    @property
    def at(self) -> np.ndarray | None:
        """(n_p,) [m] the one start of all plans that are asked for, None for any."""
        return self.asked.at

    def under(self, model: TrajectoryModel) -> "Scene":
        """The same arrays, asked of another model with the same layout: to rank plans. The slack is
        that of the first model, so what is called safe then is not shown.
        """
        return self.replace(asked=dataclasses.replace(self.asked, model=model))

    @property
    def arrays(self) -> OneScene:
        """What a kernel takes: it compiles once for all scenes of a size."""
        return OneScene(**{f.name: getattr(self, f.name) for f in dataclasses.fields(OneScene)})

    @property
    def tabled(self) -> Tabled:
        """What a kernel takes that looks along given directions."""
        tabled = self.directions.arrays
        return Tabled(**vars(self.arrays), directions=tabled, alike=once(self, _alike))

    @property
    def directions(self) -> DirectionTable:
        """Of every pair of an obstacle and a part; one plan's verdict needs none of them."""
        return once(self, _table)


def scene_of(problem: ReachAvoid, model: TrajectoryModel) -> Scene:
    """Check the problem against the model and lay it out with all of its obstacles. Raises
    InputError when they do not fit.
    """
    return laid_out(Plain(problem, model))


def laid_out(asked: Plain, apart: Apart | None = None) -> Scene:
    """The scene of a plain question, without the obstacles that are apart. Raises InputError."""
    problem, model = asked.problem, asked.model
    kept = None if apart is None else apart.kept
    arrays = scene_arrays(problem, model, apart)
    count = np.int32(len(numbered_pairs(problem, kept)))
    return Scene(**vars(arrays), count=count, asked=asked, apart=apart)


def _table(scene: Scene) -> DirectionTable:
    kept = None if scene.apart is None else scene.apart.kept
    size = len(scene.obstacles.active)
    return direction_table(scene.problem, scene.model.n_p, kept, size)


def _alike(scene: Scene) -> Alike:
    n, w = int(scene.count), scene.directions.w
    return alike(w[:n], scene.obstacles.points[:n], len(w))


def scene_arrays(
    problem: ReachAvoid, model: TrajectoryModel, apart: Apart | None = None
) -> SceneArrays:
    """The same for a batch. Raises InputError."""
    check_fits(problem, model)
    box_lo, box_hi = goal_box(problem.goal, model.layout)
    start = problem.start or HPolytope(np.zeros((0, model.n_p)), np.zeros(0))
    kept = None if apart is None else apart.kept
    grown = obstacles_of(problem, model.points, model.layout, in_closed_form(problem, model), kept)
    bounds = np.array([*box_lo, *box_hi])
    size = np.abs(bounds[np.isfinite(bounds)]).max() + CORNERS * grown.size
    z_lo, z_hi = box_lo[: model.n_p], box_hi[: model.n_p]
    goal, first = _padded(problem.goal), _padded(start)
    k_lo, k_hi = model.domain.lo, model.domain.hi
    beyond = np.float64(np.inf if apart is None else apart.beyond)
    slack = float_slack(model, size)
    return SceneArrays(*goal, *first, z_lo, z_hi, k_lo, k_hi, grown, slack, beyond)


def volume_of_all(scene: Scene) -> float:
    """Of all plans of a question, in units of p0 and k multiplied: of the (p0, k) that end in the
    goal's box, that is of K times this box; of K alone where all plans have one start. [T15]
    """
    k = float(scene.model.domain.volume)
    return k if scene.at is not None else k * float(np.prod(scene.z_hi - scene.z_lo))


def check_fits(problem: ReachAvoid, model: "TrajectoryModel | Outline") -> None:
    """Raises InputError where the problem has other dimensions than the model, or a doubt."""
    if problem.doubt is not None:
        raise InputError(
            "scene: expected a plain problem; this one is under doubt. Ask a planner, or turn it "
            "into a plain one by `robust.question.plain`."
        )
    n_y = model.n_c + model.n_q
    require_points(problem, model.points)
    if problem.goal.n != n_y:
        of_all = "" if model.n_points == 1 else f" of each of its {model.n_points} points"
        raise InputError(
            f"goal: expected a set over the {model.n_p} workspace coordinates{of_all} and "
            f"{model.n_q} further goal coordinates of this model ({n_y}); got {problem.goal.n} "
            "dimensions. Give bounds for every one of them."
        )
    for j, o in enumerate(problem.obstacles):
        if o.n != model.n_p:
            raise InputError(
                f"obstacle {j}: expected a set in the {model.n_p}-D workspace; got {o.n} "
                "dimensions."
            )
    if problem.start is not None and problem.start.n != model.n_p:
        raise InputError(
            f"start: expected a set in the {model.n_p}-D workspace; got {problem.start.n} "
            "dimensions."
        )


def finite_box(
    poly: HPolytope, name: str, needed: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Smallest box around a polytope, bounded along the needed axes (n,), by default all: rows
    along the axes are read off, others ask LPs. Raises InputError.
    """
    needed = np.ones(poly.n, bool) if needed is None else needed
    lo, hi = box_of_rows(poly)
    if (np.count_nonzero(poly.A, axis=1) != 1).any():
        try:
            around = bounding_box(poly)
        except InputError:
            raise InputError(
                f"{name}: expected a set with points in it; its rows contradict each other."
            ) from None
        lo, hi = np.maximum(lo, around.lo), np.minimum(hi, around.hi)
    return _checked(lo, hi, needed, name)


def goal_box(goal: HPolytope, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """A box around the goal, which must bound the first point and q; where a robot has several
    points, the others may be free: infinite. Raises InputError.
    """
    if layout.n_points == 1:
        return finite_box(goal, "goal")
    needed = np.ones(goal.n, bool)
    needed[layout.n_p : layout.n_c] = False
    lo, hi = box_of_rows(goal)
    if (np.isfinite(lo) & np.isfinite(hi))[needed].all():
        return _checked(lo, hi, needed, "goal")
    return finite_box(goal, "goal", needed)


def box_of_rows(poly: HPolytope) -> tuple[np.ndarray, np.ndarray]:
    """The box that the rows along the axes make, infinite where there is none."""
    lo, hi = np.full(poly.n, -np.inf), np.full(poly.n, np.inf)
    single = np.count_nonzero(poly.A, axis=1) == 1
    for row, offset in zip(poly.A[single], poly.b[single], strict=True):
        axis = int(np.flatnonzero(row)[0])
        if row[axis] > 0:
            hi[axis] = min(hi[axis], offset / row[axis])
        else:
            lo[axis] = max(lo[axis], offset / row[axis])
    return lo, hi


def _checked(lo: np.ndarray, hi: np.ndarray, needed: np.ndarray, name: str):
    """lo, hi themselves, if the needed axes are bounded and none is empty. Raises InputError."""
    open_ = needed & ~(np.isfinite(lo) & np.isfinite(hi))
    if open_.any():
        axis = int(np.argmax(open_))
        raise InputError(
            f"{name}: expected a bounded set; axis {axis} has no bound. Add the missing rows."
        )
    if (lo > hi).any():
        axis = int(np.argmax(lo > hi))
        span = f"[{lo[axis]:g}, {hi[axis]:g}]"
        raise InputError(
            f"{name}: expected a set with points in it; axis {axis} asks for a value in {span}."
        )
    return lo, hi


def no_end_fits(scene: Scene) -> str | None:
    """Why no plan can be safe, in a sentence, where the tube is wider than the goal in every bin of
    K; else None.
    """
    model = scene.model
    lo, hi = goal_box(scene.problem.goal, model.layout)
    half, templates = _half_at_end(model.tube), model.tube.templates
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


def _half_at_end(tube: Tube) -> np.ndarray:
    """(n_bins, n_c + n_q) half of how far the errors at the end go along the axes, or more."""
    axes = np.eye(tube.final.shape[1])
    errors = at(tube.final_errors, (slice(None), None))
    return (errors.support(axes) + errors.support(-axes)) / 2


def _padded(poly: HPolytope):
    rows = bucket(max(1, len(poly.b)))
    A, b = np.zeros((rows, poly.A.shape[1])), np.ones(rows)
    A[: len(poly.b)], b[: len(poly.b)] = poly.A, poly.b
    return as_float64("rows", A, (None, None)), as_float64("offsets", b, (None,))


def in_closed_form(problem: ReachAvoid, model: TrajectoryModel) -> bool:
    """Is the distance of obstacles known in closed form? So it is for one point in the plane whose
    errors are boxes.
    """
    planar = model.layout == Layout(model.time.n_steps, 2)
    boxes = isinstance(model.tube.errors, ErrorBox)
    return planar and boxes and not isinstance(problem.body, Body)


def float_slack(model: TrajectoryModel, size: Float[ArrayLike, "..."]):
    """[T11] One number that covers every rounding between the real-number verdict and its float64
    evaluation.

    size: (...) [m] largest goal bound plus largest corner plus radius, of one scene or of many.
    Network error, the sums p0 + c and w.p - h (fewer than 32 operations, more only for a row of a
    goal over more coordinates, on numbers no larger than the sizes together), corners and reaches
    rounded to nearest; all per unit of |w|_1. Supports between faces are sums of products with an
    inverse: its condition is at most about 60 (FLAT), so 8,192 units of the sum of their terms pay
    for it.
    """
    bound = rounding_bound(model.net, model.domain)
    longest = max(32, model.n_c + model.n_q + 3)  # operations one after another: a row of the goal
    claimed = model.tube.claimed  # in the other bins nothing is ever safe
    widest = max(
        model.tube.interval[claimed].max(initial=0.0), model.tube.final[claimed].max(initial=0.0)
    )
    sizes = 4 * bound.magnitude.max() + size + widest
    slack = 4 * bound.error.max() + 2 * longest * UNIT * sizes
    if isinstance(model.tube.errors, ErrorBox) or not claimed.any():
        return slack
    return slack + 8192 * UNIT * once(model.tube, _terms)


def _terms(tube: Tube) -> float:
    """Largest sum of the terms of a support between the faces of a tube."""
    sets = (tube.errors, tube.final_errors)
    return max(float(at(e, tube.claimed).largest.max()) for e in sets)
