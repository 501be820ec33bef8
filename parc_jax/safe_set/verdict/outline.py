"""Fit of a problem and a robot, of a robot and a model; checked before the first run."""

import numpy as np

from parc_jax.common.premises import MEASURED, agree, premises
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.law import BOX, Subject, law_of, subject_of
from parc_jax.learning.system import System
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import Problem, goal_box, require_dimensions
from parc_jax.problem.robust.nominal import robust_scene
from parc_jax.problem.robust.pose import require_rotation
from parc_jax.problem.robust.realisations import executions_of, require_given
from parc_jax.safe_set.separation.pairs import exists


def require_fit(problem: Problem, robot: Subject | TrajectoryModel) -> None:
    """Refuse a problem that does not fit this robot: goal, body, obstacles, uncertainty. All
    that a query refuses later, so that nothing is run or learned for it. robot: a model, or the
    subject of a system that there is none of yet. Raises InputError.
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
    not hold the model's, another law of its disturbances, another rotation, other parameters that
    are measured at the start, or labels in other units or another order. Its plant, and what no law
    names, may differ. Raises InputError.
    """
    own, about, law = subject_of(system), model.claim.subject, model.claim.law
    K, whole = about.domain, own.domain
    known = {  # some declared claims are of no system
        "system": about.system != "",
        "K": K.n != whole.n or not whole.contains(np.stack([K.lo, K.hi])).all(),
        "rotation": about.rotation is not None or about.system != "",
    }
    free = [name for name, compared in known.items() if not compared]
    where = f"system: the system of this model, {about.system or 'unnamed'!r}, and {own.system!r}"
    hint = "Name the system that the model was learned from, as it is, or learn this one."
    about.agree(where, own, free, hint)
    if law.generator == own.system:
        told = law_of(system)
        # a part of K, and where it is simulated, may differ, but no disturbance of that name
        named = "plant" in dict(told.parameters) and getattr(system, "plant", None) is None
        free = [f"law: {BOX}", *["law: plant"] * (not named)]
        both = ([(f"law: {x}", MEASURED, y) for x, y in one.parameters] for one in (law, told))
        agree(where, *map(premises, both), free=free, hint=hint)
