"""A nominal problem as arrays of kernels: pruned once, padded to few compiled shapes. [T11, T14]

Obstacles that no plan comes near are proved separated once, and cost nothing after that. Padding
never rejects a plan: rows 0 x <= FREE, obstacles that are never active.
"""

import dataclasses

import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64, once
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.model import TrajectoryModel, float_slack
from parc_jax.learning.network.predict import Layout
from parc_jax.problem.body import Body
from parc_jax.problem.problem import Problem, goal_box, require_dimensions
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.safe_set.separation.directions import DirectionTable, direction_table
from parc_jax.safe_set.separation.pairs import Alike, Obstacles, alike, bucket, obstacles_of
from parc_jax.safe_set.separation.pruning import Apart, Extent, apart, prune

# [roundings] of a corner, of which the slack pays 64 units for each: more than `polygons.OFF`
CORNERS = 17
LEAST_ROWS = 8  # of goal and start, so that most scenes agree; a row costs little
LEAST_OBSTACLES = 8  # to which a single scene is padded
# pairs of an obstacle and a part up to which first plans and loops compile nothing anew: their
# kernels loop over the first `count` pairs, so that padding costs nothing
ROOM = 128
FREE = 1e30  # [row units] offset of a row that rejects nothing, and is no plan's least margin


@struct.dataclass
class SceneArrays:
    """Padded arrays of a problem, as kernels and batches take it. A padding row is 0 x <= 1, which
    always holds. The kernels of `pointwise` take stacks of them too.

    goal_A: (g, n_c + n_q), goal_b: (g,) rows of the goal.
    start_A: (s, n_p), start_b: (s,) rows of P0.
    z_lo, z_hi: (n_p,) [m] box around the end points of the first reference point.
    k_lo, k_hi: (n_k,) K, or a part of it; a closed box.
    obstacles: grown by the body, with the part of the body that each is separated from.
    slack: () [m or row units] float margin [T11]: a float64 verdict that clears it holds exactly.
    beyond: () [m] pruned obstacles stay farther away from every plan that reaches.
    count: () number of obstacles before padding, for kernels that loop over them; None in a batch,
        where all are tested side by side.
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
    count: np.ndarray | None


@struct.dataclass
class Tabled(SceneArrays):
    """The same with directions of all obstacles: for facets, corridors and proofs. alike: the pairs
    by kind, for what is worked out once for a kind.
    """

    directions: DirectionTable
    alike: Alike


@struct.dataclass
class Scene(SceneArrays):
    """The arrays of one nominal problem; derived data is memoized on it. On the host.

    nominal: the nominal problem.
    apart: the pruned obstacles; None where nothing was pruned.
    """

    nominal: NominalProblem = struct.field(pytree_node=False)
    apart: Apart | None = struct.field(pytree_node=False)

    @property
    def model(self) -> TrajectoryModel:
        """The model of the nominal problem."""
        return self.nominal.model

    @property
    def problem(self) -> Problem:
        """The nominal problem's sets, for certificates and proofs."""
        return self.nominal.problem

    @property
    def at(self) -> np.ndarray | None:
        """(n_p,) [m] the one start of all plans, None for any."""
        return self.nominal.at

    @property
    def box_of_k(self) -> str:
        """Of which k its answer is, in sentences: the name of the claim's box, or a part of it."""
        asked, K = Box(self.k_lo, self.k_hi).text, self.model.domain.text
        return self.model.claim.law.box if asked == K else asked

    @property
    def arrays(self) -> SceneArrays:
        """Input of a kernel, which compiles once for all scenes of a size."""
        names = (f.name for f in dataclasses.fields(SceneArrays))
        return SceneArrays(**{name: getattr(self, name) for name in names})

    @property
    def tabled(self) -> Tabled:
        """Input of a kernel that tests given directions."""
        tabled = self.directions.arrays
        return Tabled(**vars(self.arrays), directions=tabled, alike=once(self, _alike))

    @property
    def directions(self) -> DirectionTable:
        """Of every pair of an obstacle and a part; one plan's verdict needs none of them."""
        return once(self, _table)


def scene_of(problem: Problem, model: TrajectoryModel) -> Scene:
    """The scene of a problem without uncertainty, all obstacles. Raises InputError."""
    return lowered(NominalProblem(problem, model))


def pruned_scene(nominal: NominalProblem) -> Scene:
    """The padded scene of a nominal problem, without the obstacles that are proved separated from
    every plan that ends in the goal. [T11, T14]

    Raises InputError where the problem does not fit the model.
    """
    return padded(lowered(nominal, prune(nominal.problem, nominal.model)))


def scene_along(nominal: NominalProblem, k: np.ndarray, path: np.ndarray) -> Scene:
    """The padded scene of one plan, without the obstacles that one row separates from it.

    k: (n_k,) parameters of the plan. path: (T + 1, n_c) [m] prediction of it. Raises InputError.
    """
    model, tube = nominal.model, nominal.model.tube
    places = path.reshape(len(path), -1, model.n_p)
    error = tube.interval[tube.bins_of(k[None])[0]].max(axis=0).reshape(places[1:].shape)
    slack = float(float_slack(model, np.abs(places).max()))
    lo = np.minimum(places[:-1], places[1:]) - 2 * slack
    hi = np.maximum(places[:-1], places[1:]) + 2 * slack
    found = apart(nominal.problem, model, Extent(lo, hi, error), slack)
    return padded(lowered(nominal, found))


def unpruned_scene(scene: Scene) -> Scene:
    """The padded scene with all obstacles, for margins of each, or of plans that miss the goal."""
    return scene if scene.apart is None else once(scene, _with_all)


def _with_all(scene: Scene) -> Scene:
    return padded(lowered(scene.nominal))


def _table(scene: Scene) -> DirectionTable:
    kept = None if scene.apart is None else scene.apart.kept
    return direction_table(scene.problem, scene.model.n_p, kept, len(scene.obstacles.active))


def _alike(scene: Scene) -> Alike:
    n, w = int(scene.count), scene.directions.w
    return alike(w[:n], scene.obstacles.points[:n], len(w))


def lowered(nominal: NominalProblem, apart: Apart | None = None) -> Scene:
    """The scene of a nominal problem, without padding.

    apart: obstacles to leave out.
    Raises InputError where the problem does not fit the model.
    """
    problem, model = nominal.problem, nominal.model
    if problem.uncertainty is not None:
        raise InputError(
            "scene: expected a nominal problem; this one is under uncertainty. Ask a planner, or "
            "reduce it by `Query.nominal`."
        )
    require_dimensions(problem, model)
    box_lo, box_hi = goal_box(problem.goal, model.layout)
    start = problem.start or HPolytope(np.zeros((0, model.n_p)), np.zeros(0))
    kept = None if apart is None else apart.kept
    grown = obstacles_of(problem, model.points, model.layout, in_closed_form(problem, model), kept)
    bounds = np.array([*box_lo, *box_hi])
    size = np.abs(bounds[np.isfinite(bounds)]).max() + CORNERS * grown.size
    goal_A, goal_b = _rows(problem.goal)
    start_A, start_b = _rows(start)
    return Scene(
        goal_A=goal_A,
        goal_b=goal_b,
        start_A=start_A,
        start_b=start_b,
        z_lo=box_lo[: model.n_p],
        z_hi=box_hi[: model.n_p],
        k_lo=model.domain.lo,
        k_hi=model.domain.hi,
        obstacles=grown,
        slack=float_slack(model, size),
        beyond=np.float64(np.inf if apart is None else apart.beyond),
        count=np.int32(len(problem.obstacles) * len(problem.parts) if kept is None else len(kept)),
        nominal=nominal,
        apart=apart,
    )


def _rows(poly: HPolytope):
    rows = bucket(max(1, len(poly.b)))
    A, b = _longer(poly.A, rows, 0.0), _longer(poly.b, rows, 1.0)
    return as_float64("rows", A, (None, None)), as_float64("offsets", b, (None,))


def volume_of_all(scene: Scene) -> float:
    """Volume of all plans of a query, before tube or uncertainty take anything off, in units of p0
    and k multiplied: K times the box around the goal of the first point; of K alone where all plans
    have one start. [T15]
    """
    asked, model = scene.nominal, scene.model
    sides, k = scene.z_hi - scene.z_lo, float(np.prod(scene.k_hi - scene.k_lo))
    if asked.uncertainty is not None and asked.query is not None:
        lo, hi = goal_box(asked.query.problem.goal, asked.query.model.layout)
        sides, known = (hi - lo)[: model.n_p], asked.uncertainty
        if len(set(known.parameters)) == 1:  # all of k is chosen
            k *= known.k_volume / float(model.domain.volume)
    return k if scene.at is not None else k * float(np.prod(sides))


def in_closed_form(problem: Problem, model: TrajectoryModel) -> bool:
    """Is the obstacle distance in closed form? It is for one point in the plane with box errors."""
    planar = model.layout == Layout(model.time.n_steps, 2)
    boxes = isinstance(model.tube.errors, ErrorBox)
    return planar and boxes and not isinstance(problem.body, Body)


def size_class(n: int, least: int = 1) -> int:
    """Padded size for n rows, obstacles or corners: the next power of two."""
    return max(least, 1 << max(n - 1, 0).bit_length())


def padded_to_class(scene: SceneArrays, least_obstacles: int = 1) -> SceneArrays:
    """One scene of a batch padded to its size class.

    least_obstacles: least number of obstacles after padding.
    """
    n_o, n_m, n_p = scene.obstacles.vertices.shape
    return _padded(scene, size_class(n_o, least_obstacles), size_class(n_m, 2**n_p))


def padded(scene: Scene, pairs: int = LEAST_OBSTACLES, corners: int = 0) -> Scene:
    """One scene padded for more obstacles and rows, so that another scene with a few more, or
    fewer, compiles nothing.

    pairs: least number of pairs of an obstacle and a part after padding.
    corners: least number of corners of an obstacle.
    """
    # grown by a box, the corner that is farthest along an axis becomes two
    n_m = corners + 4 if corners and scene.obstacles.closed else corners
    return _padded(scene, size_class(len(scene.obstacles.active), pairs), n_m)


def more_rows(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (..., h, n), b (..., h) with padding rows up to their size class."""
    n = size_class(b.shape[-1], LEAST_ROWS)
    return _longer(A, n, 0.0, axis=-2), _longer(b, n, FREE, axis=-1)


def _padded(scene: SceneArrays, n_o: int, n_m: int):
    """The scene with n_o obstacles, of at least n_m corners, and rows up to their size class."""
    goal_A, goal_b = more_rows(scene.goal_A, scene.goal_b)
    start_A, start_b = more_rows(scene.start_A, scene.start_b)
    obstacles = scene.obstacles

    def around(corners: np.ndarray):
        return _longer(_longer(corners, n_o), n_m, axis=1)

    grown = Obstacles(
        vertices=around(obstacles.vertices),
        signs=around(obstacles.signs) if obstacles.closed else _longer(obstacles.signs, n_o),
        radius=_longer(obstacles.radius, n_o, 0.0),
        points=_longer(obstacles.points, n_o),
        active=_longer(obstacles.active, n_o, False),
    )
    rows = {"goal_A": goal_A, "goal_b": goal_b, "start_A": start_A, "start_b": start_b}
    return scene.replace(**rows, obstacles=grown)


def _longer(x: np.ndarray, n: int, fill: float | None = None, axis: int = 0) -> np.ndarray:
    """x with at least n entries along an axis: copies of the last one, or of `fill`."""
    have = x.shape[axis]
    if have >= n:
        return x
    if fill is None:
        return np.take(x, np.minimum(np.arange(n), have - 1), axis=axis)
    # a tenth of the time of numpy.pad, which counts where a scene is new
    shape = list(x.shape)
    shape[axis] = n - have
    return np.concatenate([x, np.full(shape, fill, x.dtype)], axis=axis)
