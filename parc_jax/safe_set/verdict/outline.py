"""Fit of a problem and a robot, of a robot and a model; checked before the first run."""

from typing import NamedTuple

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.learning.labels import Labels, labels_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.runs.law import BOX, LawSpec, given_of, law_of
from parc_jax.learning.system import System, TimeGrid, points_of, rotation_of
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import Problem, goal_box, require_dimensions
from parc_jax.problem.robust.nominal import robust_scene
from parc_jax.problem.robust.pose import require_rotation
from parc_jax.problem.robust.realisations import executions_of, require_given
from parc_jax.safe_set.separation.pairs import exists

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


def require_fit(problem: Problem, robot: Outline | TrajectoryModel) -> None:
    """Refuse a problem that does not fit this robot: goal, body, obstacles, uncertainty. All
    that a query refuses later, so that nothing is run or learned for it. Raises InputError.
    """
    require_dimensions(problem, robot.n_p, robot.n_q, robot.points)
    numbered(problem.body, robot.points)
    for j in range(len(problem.obstacles)):
        exists(problem, j, robot.time.n_steps)
    uncertainty = problem.uncertainty
    require_given(uncertainty, robot)
    if uncertainty is not None and not uncertainty.is_nothing:
        if uncertainty.heading:
            require_rotation(robot, "uncertainty heading")
        executions_of(uncertainty, robot)
        problem = robust_scene(problem, uncertainty, robot.layout)
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
