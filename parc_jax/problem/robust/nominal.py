"""A query under uncertainty as a nominal problem, of which every safe plan is safe for every
realisation of the uncertainty. [T21, T22]

Obstacles grow, goal and start set shrink, the tube grows, the network predicts several vertex
realisations at once. Nothing else has to know of uncertainty: samples, corridors, batches, volumes
and certificates are those of the nominal problem. Offsets are computed in exact rationals and
rounded once, to the safe side; for many polygons at once in floats, whose rounding is paid for.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from parc_jax.common.arrays import once
from parc_jax.common.errors import InputError, check_kind, naming
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box
from parc_jax.common.sets.hull import around_box, less_a_box, sum_of
from parc_jax.common.sets.rational import rational_vertices
from parc_jax.learning.bound.claim import weaker
from parc_jax.learning.bound.tube import Tube, fitted_tube, tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.network.rounding import outputs_within
from parc_jax.problem.body import Body, Disc, Polygon, numbered
from parc_jax.problem.problem import Problem, finite_box, require_dimensions
from parc_jax.problem.robust.pose import Pose, from_here, pose_of, require_rotation
from parc_jax.problem.robust.realisations import (
    Robustness,
    Turn,
    executions_of,
    require_given,
    turn_by,
    words,
)
from parc_jax.problem.robust.vertex_model import copied_model, copied_problem
from parc_jax.problem.uncertainty import FREE, Uncertainty
from parc_jax.problem.world.moving import require_under_way
from parc_jax.problem.world.outlines import BASE, Edge

SAME_PLACE = 1e-6  # [m] by which a footprint and a model may differ: of decimals, or of float32
CACHED = 16  # robust models that a planner caches

Cache = dict[tuple, TrajectoryModel]


@dataclass(frozen=True, eq=False)
class Query:
    """A problem for a model, in the world frame. Made by `query`.

    problem: with its uncertainty and its start set.
    model: network and error bound.
    pose: of the robot; None for plans from any start.
    """

    problem: Problem
    model: TrajectoryModel
    pose: Pose | None = None

    def of(self, model: TrajectoryModel) -> "Query":
        """The same of another model. Raises InputError for a heading without declared rotation."""
        if self.pose is not None and self.pose.heading is not None:
            require_rotation(model, "at")
        return replace(self, model=model)

    def nominal(self, cache: Cache | None = None) -> "NominalProblem":
        """Reduce a problem with uncertainty and an initial pose to a nominal problem. [T21, T22]

        Every plan that is safe for the result is safe for every realisation of the uncertainty.
        cache: robust models, keyed by uncertainty; updated in place.
        Returns the problem in the robot frame if the pose has a heading, else in the world frame.
        Raises InputError if the uncertainty does not fit the model or leaves no goal, for the model
        of another answer under uncertainty, and where not every start lies in the free space of
        obstacles that are edges.
        """
        problem, model, pose = self.problem, self.model, self.pose
        if "network_of_runs" in model.claim.evidence:  # else risk and copies would not be told
            raise InputError(
                "model: expected the learned one; got that of an answer under uncertainty. Ask the "
                "learned one again, with it in the problem: reach_avoid(..., uncertainty=...)."
            )
        require_under_way(problem.all_spans)
        require_dimensions(problem, model)
        if problem.labels:  # compared; no other program for them
            problem = replace(problem, labels=())
        _require_places(problem.body, model)
        _require_free(problem, model, pose)
        uncertainty = problem.uncertainty
        if uncertainty is not None or model.given:
            require_given(uncertainty, model)
        if uncertainty is not None and uncertainty.is_nothing:
            uncertainty, problem = None, replace(problem, uncertainty=None)
        if uncertainty is None and pose is None:
            return NominalProblem(problem, model, query=self)
        robust, promise, at = model, None, None
        if uncertainty is not None:
            executions = executions_of(uncertainty, model)
            turn = Turn(np.eye(model.n_p)[None], 0.0, np.zeros(model.n_q))
            if uncertainty.heading:
                require_rotation(model, "uncertainty heading")
                turn = turn_by(uncertainty.heading, model.rotation or ())
            problem = robust_scene(problem, uncertainty, model.layout, whole=pose is not None)
        turned = pose is not None and pose.heading is not None
        if pose is not None:
            problem = from_here(problem, model, pose)
            at = np.zeros(model.n_p) if turned else pose.place
        if uncertainty is not None:
            n_v, n_r = len(executions.corners), len(turn.maps)
            grown = any(uncertainty.obstacles) or (pose is not None and any(uncertainty.start))
            problem = copied_problem(problem, model, n_v, n_r)
            # with a pose the obstacles have grown by the start box, so the tube need not
            start = uncertainty.shifts(model.n_p) * (pose is None)
            # sums in space lack rows that cross two edges; of a moved tube faces need not be tight,
            # and an end that is wider than the interval before it lets more in there
            n_p, faces = model.n_p, model.tube.templates
            loose = faces is not None and faces.interval.directions.shape[-2] > n_p
            loose |= bool((model.tube.final[:, : model.n_c] > model.tube.interval[:, -1]).any())
            # a model of other parameters has boxes for faces, and the wider one where bins meet
            more = n_r > 1 or not executions.nominal
            more |= bool(loose and any(start)) or (n_p > 2 and grown)
            key = (model.claim.hash, *uncertainty.of_model, pose is None)
            cache = {} if cache is None else cache
            if key not in cache:
                while len(cache) >= CACHED:
                    cache.pop(next(iter(cache)))
                if not executions.nominal or n_r > 1:
                    robust = copied_model(model, executions, turn)
                if start.any():
                    moved, off = moved_tube(robust.tube, start), start.tolist()
                    claim = weaker(robust.claim, moved, start_uncertainty=off)
                    robust = robust.replace(claim=claim)
                cache[key] = robust
            robust = cache[key]
            promise = Robustness(
                words(uncertainty, executions, model, turned),
                uncertainty.sensing_eps,
                (model.n_k, len(executions.chosen)),
                float(model.domain.volume),
                more,
            )
        return NominalProblem(problem, robust, promise, at, pose, self)


@dataclass(frozen=True, eq=False)
class NominalProblem:
    """A problem without uncertainty and its model; `Scene` holds its arrays.

    problem: grown obstacles, shrunken goal and start set; in the robot frame if the pose has a
        heading.
    model: with the points, the network and the tube of all vertex realisations.
    uncertainty: uncertainty that its safe plans are robust to, None for none.
    at: (n_p,) [m] the one start of its plans, None for any.
    pose: the pose behind it.
    query: the query behind it; None where a file has the nominal problem alone.
    """

    problem: Problem
    model: TrajectoryModel
    uncertainty: Robustness | None = None
    at: np.ndarray | None = None
    pose: Pose | None = None
    query: Query | None = None

    @property
    def turned(self) -> bool:
        """Test whether it is in the robot's frame."""
        return self.pose is not None and self.pose.heading is not None

    @property
    def told(self) -> Query:
        """The query behind it; of a file without one this very problem, what is measured free."""
        free = Uncertainty(given={i: FREE for i in self.model.given}) if self.model.given else None
        problem, at = replace(self.problem, uncertainty=free), self.at
        return self.query or Query(problem, self.model, None if at is None else Pose(at))


def _require_places(body: Disc | Polygon | Body, model: TrajectoryModel) -> None:
    """Raises InputError where a body tells places of reference points, as a footprint does, and
    the model's points cannot begin so far apart, with whatever heading.
    """
    told = body.places if isinstance(body, Body) and model.n_p == 2 else ()
    for name in [name for name, *_ in told if name not in (BASE, *model.points)]:
        raise InputError(
            f"body: expected places of points of the model, {', '.join(model.points)}; got one of "
            f"{name!r}. Is it misspelled?"
        )
    told = [one for one in told if one[0] in model.points]
    if not told:
        return
    wide = model.tube.interval[model.tube.claimed, 0].max(axis=0, initial=0.0).reshape(-1, 2)
    wide[0] = 0.0  # the first point is where the start is
    some = [model.points.index(name) for name, *_ in told]
    lo, hi = (once(model, at_start) + np.multiply.outer([-1.0, 1.0], wide))[:, some]
    below, above = lo[:, None] - hi, hi[:, None] - lo  # of one seen from another, along each axis
    least = np.linalg.norm(np.maximum(np.maximum(below, -above), 0.0), axis=-1)
    most = np.linalg.norm(np.maximum(above, -below), axis=-1)
    places = np.array([place for _, *place in told])
    apart = np.linalg.norm(places[:, None] - places, axis=-1)
    off = np.maximum(least - apart, apart - most)
    i, j = np.unravel_index(off.argmax(), off.shape)
    if off[i, j] > SAME_PLACE:
        raise InputError(
            f"body: expected the footprint that the model was learned with, whose {told[i][0]} and "
            f"{told[j][0]} are {least[i, j]:.3g} to {most[i, j]:.3g} m apart; got "
            f"{apart[i, j]:.3g} m. Tell its corners as then, in that order, or learn with these."
        )


def _require_free(problem: Problem, model: TrajectoryModel, pose: Pose | None) -> None:
    """Raises InputError unless every part of the body begins, from every start, in the free space
    of which obstacles are edges. No verdict lets a part touch an edge, wherever in its tube and its
    uncertainty it is, so one place of it, of those that its tube allows, tells of all, and one
    error of the edges, of those that all of them may have. [T41]
    """
    errors = (problem.uncertainty or Uncertainty()).of_obstacles(len(problem.obstacles))
    owners = {id(one.region): one for one in problem.obstacles if isinstance(one, Edge)}
    if not owners:
        return
    # edges of a file have a copy of their region each
    written = {own: edge.written.partition(" ")[0] for own, edge in owners.items()}
    sets: dict[str, tuple[list[Edge], list]] = {}
    for one, by in zip(problem.obstacles, errors, strict=True):
        if isinstance(one, Edge):
            edges, off = sets.setdefault(written[id(one.region)], ([], []))
            edges.append(one), off.append(by)
    for edges, _ in sets.values():
        edges[0].require_all(edges)
    regions = [(edges[0], _common_error(errors)) for edges, errors in sets.values()]
    starts = np.array([[-np.inf, np.inf]] * 2).T
    heading = 0.0 if pose is None else pose.heading or 0.0
    if pose is not None:
        starts = pose.place[None]
    elif problem.start is not None:
        box_of_starts = zip(*finite_box(problem.start, "start"), strict=True)
        starts = np.array(list(itertools.product(*box_of_starts)))
    cosine, sine = math.cos(heading), math.sin(heading)
    for i, part in enumerate(numbered(problem.body, model.points)):
        some = [0] if 0 in part.points else list(part.points)  # their middle is in their hull
        around = np.zeros((2, 2)) if some == [0] else once(model, at_start)[:, some].mean(axis=1)
        corners = np.array(list(itertools.product(*around[:, :2].T)))
        places = starts[:, None] + corners @ np.array([[cosine, sine], [-sine, cosine]])
        if not isinstance(part.shape, Disc):
            places = places + part.shape.vertices.mean(axis=0)
        if not all(edge.holds(places.reshape(-1, 2) - off) for edge, off in regions):
            x, y = places[0, 0]
            off = any(off.any() for _, off in regions)
            raise InputError(
                "obstacles: expected a start inside the free space whose edges they are, of "
                f"every part of the body; part {i} may begin at ({x:.3f}, {y:.3f}) or further"
                f"{', and the edges elsewhere than told, by their uncertainty' * off}. "
                "Take edges of free space around every start, or say where it is: at."
            )


def _common_error(sets: list[HPolytope | None]) -> np.ndarray:
    """(2,) an error that all edges of a region may have, of their error sets. Raises InputError."""
    rows: dict[tuple, float] = {}  # of their intersection
    each = {id(by): by for by in sets}.values()  # all edges of a scan have one
    for one in (from_box(box([0.0] * 2, [0.0] * 2)) if by is None else by for by in each):
        for row, bound in zip(one.A.tolist(), one.b.tolist(), strict=True):
            rows[tuple(row)] = min(bound, rows.get(tuple(row), bound))
    common = HPolytope(np.array(list(rows)), np.array(list(rows.values())))
    corners = rational_vertices(common, "uncertainty of obstacles")
    if not corners:
        raise InputError(
            "uncertainty of obstacles: expected errors of the edges of a free space that all of "
            "them may have at once; got sets with no point in common, or one that is empty. Else "
            "its outline is torn: give one set for all of them."
        )
    # rounded: edges are thicker than that
    return np.array([float(sum(x) / len(corners)) for x in zip(*corners, strict=True)])


def at_start(model: TrajectoryModel) -> np.ndarray:
    """(2, points, n_p) bounds of where each point may begin, seen from the first, over all k."""
    others = (model.n_points - 1) * model.n_p  # the outputs that come first
    if not others:
        return np.zeros((2, 1, model.n_p))
    lo, hi = outputs_within(model.net, model.domain, np.arange(others))
    bounds = np.stack([lo.min(axis=0), hi.max(axis=0)]).reshape(2, -1, model.n_p)
    if (fitted := model.tube.templates) is not None:  # without zero error a point is elsewhere
        off = np.where(fitted.interval.allow_none[..., None], 0.0, fitted.interval.box)[:, 0, 1:]
        bounds += np.multiply.outer([-1.0, 1.0], off.max(axis=0))
    return np.concatenate([np.zeros((2, 1, model.n_p)), bounds], axis=1)


def query(problem: Problem, model: TrajectoryModel, at=None) -> Query:
    """A problem for a model. at: the pose of the robot, as of `pose_of`. Raises InputError."""
    return Query(problem, model, None if at is None else pose_of(at, model, 2))


def nominal_problems(
    problems: Sequence[Problem], model: TrajectoryModel, cache: Cache
) -> list[NominalProblem]:
    """The nominal problems of a batch, which share one robust model.

    cache: as of `Query.nominal`.
    Raises InputError where their uncertainties ask for different models.
    """
    nominal = []
    for row, problem in enumerate(problems):
        check_kind(f"problem {row} of the batch", problem, Problem)
        with naming(f"problem {row} of the batch"):
            nominal.append(Query(problem, model).nominal(cache))
    for row, other in enumerate(nominal):
        doubts = (one.uncertainty for one in (other, nominal[0]))
        risk, first = (0 if one is None else one.sensing_eps for one in doubts)
        if other.model is not nominal[0].model or risk != first:
            raise InputError(
                "solve_batch: expected problems under one uncertainty of start, heading and "
                f"parameters, with one sensing_eps; problem {row} is under another one than "
                "problem 0. Ask in two batches."
            )
    return nominal


def moved_tube(given: Tube, start: np.ndarray) -> Tube:
    """The tube of points that all move by one vector within half widths start (n_p,) [m].

    At the end it stays: there the goal shrinks instead, by less, since all points move equally.
    """
    if given.templates is None:
        wide = given.interval + np.tile(start, given.n_points)
        return tube(given.edges, np.nextafter(wide, np.inf), given.final, given.n_points)
    during, at_end = given.templates
    half = np.nextafter(during.half + during.half_around(start), np.inf)
    return fitted_tube(given.edges, during.with_half(half), at_end)


def robust_scene(
    problem: Problem, uncertainty: Uncertainty, layout: Layout, whole: bool = False
) -> Problem:
    """The problem robust to uncertainty of start, goal and obstacles, except that the points move
    with the start before the end: the tube has to allow for that.

    whole: allow for that too, by obstacles that grow by the box of the start.
    Raises InputError where nothing is left of the goal.
    """
    n_p, n_q = layout.n_p, problem.goal.n - layout.n_c
    start = uncertainty.shifts(n_p)
    goal = _shrunken_goal(problem.goal, layout, start, uncertainty.of_goal(n_p, n_q))
    starts = problem.start
    if starts is not None and start.any():
        rows = [[Fraction(x) for x in row] for row in starts.A]
        starts = less_a_box(starts, rows, [Fraction(x) for x in start])
    obstacles = list(problem.obstacles)
    if whole and start.any():
        obstacles = around_box(obstacles, start)
    for j, by in enumerate(uncertainty.of_obstacles(len(obstacles))):
        if by is not None:
            obstacles[j] = sum_of(obstacles[j], by, f"obstacle {j}")
    return replace(problem, goal=goal, obstacles=tuple(obstacles), start=starts, uncertainty=None)


def _shrunken_goal(
    goal: HPolytope, layout: Layout, start: np.ndarray, off: np.ndarray
) -> HPolytope:
    """The goal met from every start, wherever it is. start, off: half widths of both errors."""
    # all points move equally with the start, and with the goal: of a row only their sum counts
    if not (start.any() or off.any()):
        return goal
    n_p, n_c = layout.n_p, layout.n_c
    widths = [Fraction(x) for x in np.concatenate([start + 0.0, np.zeros(goal.n - n_c)])]
    widths = [a + Fraction(b) for a, b in zip(widths, off, strict=True)]
    rows = []
    for row in goal.A:
        sums = [sum(map(Fraction, filter(None, row[axis:n_c:n_p]))) for axis in range(n_p)]
        rows.append([*sums, *map(Fraction, row[n_c:])])
    shrunken = less_a_box(goal, rows, widths)
    # two rows that face each other must leave some room
    number = {tuple(row): i for i, row in enumerate(goal.A.tolist())}
    for i, row in enumerate(goal.A):
        j = number.get(tuple((-row).tolist()))
        if j is not None and shrunken.b[i] + shrunken.b[j] < 0:
            wide, taken = goal.b[i] + goal.b[j], (goal.b - shrunken.b)[[i, j]].sum()
            raise InputError(
                "uncertainty: expected less uncertainty of start and goal than the goal is wide; "
                f"row {i} of the goal leaves {wide:.3g}, and {taken:.3g} of it are uncertain."
            )
    return shrunken
