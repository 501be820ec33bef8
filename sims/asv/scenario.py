"""The study's scenario as a black box and a scene: steer to a goal through a gap, hover there.

The goal in k is measured from the start: it moves along with p0. So a run is the same run wherever
it starts, p = p0 + offset(k), and "reach the goal set" means p0 + offset lands in it, whichever p0
and k made it so.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.system import ONE_POINT, TimeGrid, Trajectory, time_grid
from parc_jax.problem.body import Disc, Polygon
from parc_jax.problem.problem import Problem, reach_avoid
from sims import rectangle
from sims.asv.control import run
from sims.asv.disturbance import Law, named_law
from sims.asv.plant import make_plant
from sims.asv.policy import HOVER, Policy, load_policy
from sims.asv.vessel import SYSID

DOMAIN = box([4.0, -1.0, -np.pi / 6], [7.0, 1.0, np.pi / 6])
HULL = (1.3, 0.94)  # [m] footprint for collisions, length and width
BODIES = (rectangle.BODY, "disc", "decagon")


@dataclass(frozen=True, eq=False)
class AsvSystem:
    """A `BlackBoxSystem`: k = (goal x, y [m] from the start, initial heading [rad]) -> p (n_record
    + 1, 2) of the hull's reference point or, with points, (n_record + 1, 5, 2) of it and of the
    hull's corners; q (0,).

    control_steps: control steps per rollout. every: physics steps per record.
    """

    name: str
    domain: Box
    time: TimeGrid
    plant: str
    law: Law
    policy: Policy
    control_steps: int
    every: int
    n_p: int = 2
    n_q: int = 0
    points: tuple[str, ...] = ONE_POINT
    k_labels: ClassVar[tuple[str, ...]] = (
        "goal x from the start [m]",
        "goal y from the start [m]",
        "initial heading [rad]",
    )

    def rollout(self, key: jax.Array, k: jax.Array) -> Trajectory:
        """Run once from rest, disturbance and noise drawn from `key`, in JAX's default float
        type.
        """
        k = jnp.asarray(k, jnp.result_type(float))
        plant = make_plant(self.plant, SYSID)
        hull = run(
            SYSID, plant, self.law, self.policy, key, k[:2], k[2], self.control_steps, self.every
        )
        p = hull[:, :2]
        if self.points != ONE_POINT:
            p = rectangle.centre_and_corners(p, hull[:, 2], *HULL)
        return Trajectory(p, jnp.zeros((0,), k.dtype))


def system(
    plant: str = "mjx",
    law: str = "study",
    policy: Policy | str | Path = HOVER,
    published_time: bool = False,
    body: str = "disc",
) -> AsvSystem:
    """The vessel of the reach-avoid study. Raises InputError.

    plant: "mjx", or its twin "ode" (several times faster). law: "none", "study" or "full" (see
        sims.asv.disturbance).
    policy: a Policy, or the path of a file that says how it observes; by default the one shipped
        here.
    published_time: False reads the paper's 10 s as 10 s, recorded every 0.02 s. True is the
    scenario "asv_published": one sample per control period of 0.2 s, *labelled* 0.02 s, so that 100
    s of motion carry the label 10 s, as the released data do.
    body: as of `problem`; with "rectangle" the hull's corners are reference points too.
    """
    rectangle.require_body(body, BODIES)
    if not isinstance(policy, Policy):
        policy = load_policy(policy)
    make_plant(plant, SYSID)  # a wrong name should fail here, not in the first rollout
    grid = time_grid(0.1, 10.0, 0.02)
    every = policy.n_physics if published_time else 1
    if published_time and abs(policy.period - 0.2) > 1e-9:
        raise InputError(
            "asv published_time: expected a control period of 0.2 s; the policy has "
            f"{policy.period} s."
        )
    control_steps, rest = divmod(grid.n_record * every, policy.n_physics)
    if rest:
        raise InputError(
            f"asv policy: expected a control period that divides {grid.t_f} s; got {policy.period} "
            "s."
        )
    name = "asv_published" if published_time else "asv"
    found = AsvSystem(name, DOMAIN, grid, plant, named_law(law), policy, control_steps, every)
    return replace(found, points=rectangle.POINTS) if body == rectangle.BODY else found


def problem(body: str = "disc") -> Problem:
    """The study's scene: a goal area behind a gap of 2.6 m, anywhere to start. Raises InputError.

    body: "rectangle", the true hull, which turns with the boat; "disc", the circle around it
    (radius 0.802 m); or "decagon", the regular one around that circle, as in the paper.
    """
    rectangle.require_body(body, BODIES)
    obstacles = (box([2.25, 1.3], [2.75, 4.3]), box([2.25, -4.3], [2.75, -1.3]))
    lo, hi = [4.0, -1.5], [7.0, 1.5]
    if body == rectangle.BODY:
        return reach_avoid(rectangle.goal_of_centre(lo, hi), obstacles, rectangle.rectangle())
    radius = 0.5 * float(np.hypot(*HULL))
    if body == "disc":
        shape = Disc(radius)
    else:
        angles = np.pi / 5 * np.arange(10)
        shape = Polygon(
            radius / np.cos(np.pi / 10) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        )
    return reach_avoid(box(lo, hi), obstacles, shape)
