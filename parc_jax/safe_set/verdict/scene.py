"""A problem as arrays for one model: everything a query needs, padded to few compiled shapes."""

import dataclasses

import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64, once
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.error_set import ErrorBox, at
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.network.rounding import UNIT, rounding_bound
from parc_jax.problem.body import Body
from parc_jax.problem.problem import ReachAvoid
from parc_jax.problem.robust.question import Plain
from parc_jax.safe_set.separation.directions import DirectionTable, direction_table
from parc_jax.safe_set.separation.pairs import (
    Alike,
    Obstacles,
    alike,
    bucket,
    numbered_pairs,
    obstacles_of,
)
from parc_jax.safe_set.separation.pruning import Apart
from parc_jax.safe_set.verdict.fits import check_fits, goal_box

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
    check_fits(problem, model.n_p, model.n_q, model.points)
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
    """Of all plans of a question, in units of p0 and k multiplied: of the (p0, k) whose first
    point ends in the goal's box, that is of K times this box; of K alone where all plans have one
    start. [T15]
    """
    k = float(scene.model.domain.volume)
    return k if scene.at is not None else k * float(np.prod(scene.z_hi - scene.z_lo))


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
