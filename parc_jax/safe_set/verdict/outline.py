"""Fit of a problem and a robot, of a robot and a model; checked before the first run."""

from typing import NamedTuple

import numpy as np

from parc_jax.common.premises import MEASURED, Premises, agree, premises
from parc_jax.common.sets.box import Box
from parc_jax.learning.labels import Labels, labels_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.runs.law import BOX, LawSpec, given_of, law_of, subject_of
from parc_jax.learning.system import System, TimeGrid, points_of, rotation_of
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import Problem, goal_box, require_dimensions
from parc_jax.problem.robust.nominal import robust_scene
from parc_jax.problem.robust.pose import require_rotation
from parc_jax.problem.robust.realisations import executions_of, require_given
from parc_jax.safe_set.separation.pairs import exists


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
    require_dimensions(problem, robot)
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
    own, about, law = subject_of(system), model.claim.subject, model.claim.law
    K, whole = about.domain, own.domain
    known = {
        "system": about.system != "",
        "K": K.n != whole.n or not whole.contains(np.stack([K.lo, K.hi])).all(),
        "rotation": about.rotation is not None,
        "given": about.given != (),
        # a model may be given other names, a system with its own in another order is another
        "parameters": sorted(own.labels.k) == sorted(about.labels.k),
        "goal states": sorted(own.labels.q) == sorted(about.labels.q),
        "axes": False,
    }
    free = [name for name, compared in known.items() if not compared]
    where = f"system: the system of this model, {about.system or 'unnamed'!r}, and {own.system!r}"
    hint = "Name the system that the model was learned from, or learn this one."
    about.agree(where, own, free, hint)
    if law.generator == own.system:
        agree(where, _disturbances(law), _disturbances(law_of(system)), hint=hint)


def _disturbances(law: LawSpec) -> Premises:
    """Parameters of a law but for where it is simulated, and on what part of K."""
    told = (pair for pair in law.parameters if pair[0] not in ("plant", BOX))
    return premises((f"law: {name}", MEASURED, value) for name, value in told)
