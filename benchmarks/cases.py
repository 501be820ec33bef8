"""The scenes that are measured: a black box, its task, the networks of Table I, and how its gap
narrows.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.result import Skip
from parc_jax.problem.problem import Problem


@dataclass(frozen=True)
class Case:
    """One scene.

    system, problem: constructors. hidden: widths of the networks of Table I, the last one also used
        elsewhere.
    larger: widths of the network that shows how narrow a gap can be. bins: of the tube, per axis of
        K.
    axis: workspace axis along which the obstacles close in. slack: [m] room between body and
        obstacles as published.
    radius: [m] of the circle around the body. length: [m] of the true body along that axis, once it
        stands in the gap; None = not looked at.
    published: figures of the paper, measured on its machine: regions and seconds for BRAS of all of
        them.
    """

    name: str
    system: Callable
    problem: Callable[[], Problem]
    hidden: tuple[tuple[int, ...], ...]
    larger: tuple[int, ...]
    bins: tuple[int, ...]
    axis: int
    slack: float
    radius: float
    length: float | None
    published: dict[tuple[int, ...], tuple[int, float]]

    def narrowed(self, slack: float) -> Problem:
        """The problem with both obstacles moved together until `slack` [m] is left. They move along
        `axis`.
        """
        problem = self.problem()
        shift, moved = 0.5 * (self.slack - slack), []
        middle = np.mean([_centre(o)[self.axis] for o in problem.obstacles])
        for o in problem.obstacles:
            v = np.zeros(o.n)
            v[self.axis] = shift * np.sign(middle - _centre(o)[self.axis])
            moved.append(o.replace(b=o.b + o.A @ v))
        return problem.replace(obstacles=tuple(moved))


def _centre(o) -> np.ndarray:
    """Middle of a box given by rows [I; -I]."""
    return 0.5 * (o.b[: o.n] - o.b[o.n :])


def drift() -> Case:
    """Drift parking between two cars, on the closed-form plant."""
    import sims
    from sims.drift_parking import params, scenario

    return Case(
        name="drift",
        system=lambda: sims.load("drift_parking", plant="ode"),
        problem=scenario.problem,
        hidden=((6,) * 4, (7,) * 4, (8,) * 4),
        larger=(16,) * 4,
        bins=(20, 4),
        axis=0,
        slack=scenario.APART - 2 * scenario.BODY_RADIUS,
        radius=scenario.BODY_RADIUS,
        length=params.BODY_LENGTH,
        published={(8,) * 4: (203, 9.6)},
    )


def boat() -> Case:
    """The boat through a gap of 2.6 m, on the closed-form plant."""
    import sims
    from sims.asv import scenario

    task = scenario.problem()
    lower, upper = sorted(task.obstacles, key=lambda o: _centre(o)[1])
    return Case(
        name="boat",
        system=lambda: sims.load("asv", plant="ode"),
        problem=scenario.problem,
        hidden=((8,) * 4,),
        larger=(16,) * 4,
        bins=(4, 4, 2),
        axis=1,
        slack=float(-upper.b[3] - lower.b[1] - 2 * task.body.radius),
        radius=float(task.body.radius),
        length=None,
        published={(8,) * 4: (611, 100.0)},
    )


CASES = {"drift": drift, "boat": boat}


def case(name: str) -> Case:
    """The case of that name. Raises Skip when its simulator is not installed."""
    try:
        return CASES[name]()
    except ImportError as error:
        raise Skip(f"the simulator of {name} cannot be imported ({error})") from None
