"""Does a problem fit a robot? It has as many dimensions, and its goal is bounded: boxes around
where plans end and start.
"""

from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.bounding_box import bounding_box
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import counted
from parc_jax.learning.labels import Labels, labels_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.runs.law import BOX, LawSpec, law_of
from parc_jax.learning.runs.subject import given_of
from parc_jax.learning.system import System, TimeGrid, points_of, rotation_of
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import ReachAvoid, require_points
from parc_jax.problem.robust.executions import executions_of, require_given
from parc_jax.problem.robust.pose import require_rotation
from parc_jax.problem.robust.scene import doubted_scene
from parc_jax.safe_set.separation.pairs import exists


def check_fits(problem: ReachAvoid, n_p: int, n_q: int, points: tuple[str, ...]) -> None:
    """Raises InputError where the problem has other dimensions than a robot's model, or a doubt.
    points: names of its reference points.
    """
    if problem.doubt is not None:
        raise InputError(
            "scene: expected a plain problem; this one is under doubt. Ask a planner, or turn it "
            "into a plain one by `robust.question.plain`."
        )
    n_y = len(points) * n_p + n_q
    require_points(problem, points)
    if problem.goal.n != n_y:
        of_all, hint = "", "Give bounds for every one of them."
        if len(points) > 1:
            of_all = f" of each of its {len(points)} points"
            q = f", q=...), q over {counted(n_q, 'coordinate')}." if n_q else ")."
            hint = f"Make it with goal_of_points(model.points, where{q}"
        raise InputError(
            f"goal: expected a set over the {n_p} workspace coordinates{of_all} and "
            f"{n_q} further goal coordinates of this model ({n_y}); got {problem.goal.n} "
            f"dimensions. {hint}"
        )
    for j, o in enumerate(problem.obstacles):
        if o.n != n_p:
            raise InputError(
                f"obstacle {j}: expected a set in the {n_p}-D workspace; got {o.n} dimensions."
            )
    if problem.start is not None and problem.start.n != n_p:
        raise InputError(
            f"start: expected a set in the {n_p}-D workspace; got {problem.start.n} dimensions."
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


ALIKE = ("n_p", "n_q", "points", "time")  # in which a system and its model agree to the letter


class Outline(NamedTuple):
    """All that a question has to know of a robot, whether there is a model of it yet or not; names
    as of `TrajectoryModel`.
    """

    system: str
    n_p: int
    n_q: int
    points: tuple[str, ...]
    time: TimeGrid
    domain: Box
    labels: Labels
    rotation: tuple[str, ...] | None
    given: tuple[int, ...]

    @property
    def n_points(self) -> int:
        """Number of reference points."""
        return len(self.points)

    @property
    def n_c(self) -> int:
        """Number of columns: the coordinates of all reference points."""
        return self.n_points * self.n_p

    @property
    def n_k(self) -> int:
        """Number of manoeuvre parameters."""
        return self.domain.n

    @property
    def layout(self) -> Layout:
        """Of the offsets."""
        return Layout(self.time.n_steps, self.n_p, self.n_points)


def outline_of(system: System) -> Outline:
    """Of a black box. Raises InputError."""
    return Outline(
        system.name,
        system.n_p,
        system.n_q,
        points_of(system),
        system.time,
        system.domain,
        labels_of(system),
        rotation_of(system),
        given_of(system),
    )


def require_fit(problem: ReachAvoid, robot: Outline | TrajectoryModel) -> None:
    """Refuse a question that this robot cannot be asked: goal, body, obstacles, doubt. All that a
    query refuses later, so that nothing is run or learned for it. Raises InputError.
    """
    check_fits(problem.replace(doubt=None), robot.n_p, robot.n_q, robot.points)
    numbered(problem.body, robot.points)
    for j in range(len(problem.obstacles)):
        exists(problem, j, robot.time.n_steps)
    doubt = problem.doubt
    require_given(doubt, robot)
    if doubt is not None and not doubt.is_nothing:
        if doubt.heading:
            require_rotation(robot, "doubt heading")
        executions_of(doubt, robot)
        problem = doubted_scene(problem, doubt, robot.layout)
    goal_box(problem.goal, robot.layout)


def require_same(system: System, model: TrajectoryModel) -> None:
    """Refuse a system that is not the one of this model: another name, size or grid, a K that does
    not hold the model's, another law of its disturbances, another rotation or other parameters that
    are measured at the start than the model knows. Its plant may differ. Raises InputError.
    """
    own = outline_of(system)
    differs = [name for name in ALIKE if getattr(own, name) != getattr(model, name)]
    if model.system and own.system != model.system:
        differs.insert(0, "name")
    inside = model.domain.n == own.domain.n and bool(
        (own.domain.lo <= model.domain.lo).all() and (model.domain.hi <= own.domain.hi).all()
    )
    differs += [] if inside else ["K"]
    if model.rotation is not None and own.rotation != model.rotation:
        differs.append("rotation")
    if model.given and own.given != model.given:
        differs.append("given")
    law = model.claim.law
    if law.generator == own.system and _disturbances(law) != _disturbances(law_of(system)):
        differs.append("law")
    if differs:
        raise InputError(
            f"system: expected the system of this model, {model.system or 'unnamed'!r}; got "
            f"{own.system!r}, which differs in {', '.join(differs)}. Name the system that the "
            "model was learned from, or learn this one."
        )


def _disturbances(law: LawSpec) -> dict[str, str]:
    """Parameters of a law but for where it is simulated, and on what part of K."""
    return {name: value for name, value in law.parameters if name not in ("plant", BOX)}
