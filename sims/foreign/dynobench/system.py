"""Dynobench's models as black boxes, through the door for plain Python: worker
processes, each with a process of its own that has dynobench.
"""

from functools import partial
from hashlib import sha256

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.system import STAYS, TURNS, time_grid
from parc_jax.learning.systems.python_system import PythonSystem, python_system
from sims.foreign.dynobench.drive import drive, drive_from
from sims.foreign.dynobench.process import SERVER, interpreter
from sims.foreign.dynobench.robots import ROBOTS, TICK


def system(robot: str = "unicycle1_v0", workers: int | None = None) -> PythonSystem:
    """k = (what is measured at the start, speed, one turn after another) -> p of all corners, q =
    (heading,), of the car also (heading of the trailer, most bend). Raises InputError.

    robot: "unicycle1_v0", "unicycle2_v0" with speeds as states, or "car1_v0" with a trailer.
    workers: processes, None = one per core.
    """
    interpreter()
    if robot not in ROBOTS:
        raise InputError(f"robot: expected one of {', '.join(ROBOTS)}; got {robot!r}.")
    made = ROBOTS[robot]
    black_box = python_system(
        partial(drive, robot),
        box(*made.limits),
        time_grid(made.plan_step, made.t_f, TICK),
        name="dynobench",
        n_p=2,
        n_q=3 if made.trailer else 1,
        workers=workers,
        law={
            "model": f"dynobench 0.0.4, {robot}",
            "held": list(made.held),
            "server": sha256(SERVER.read_bytes()).hexdigest()[:8],
        },
        simulate_from=partial(drive_from, robot),
        points=made.points,
        k_labels=made.labels,
        q_labels=("heading [rad]", "heading of the trailer [rad]", "bend [rad]")[
            : 3 if made.trailer else 1
        ],
    )
    black_box.rotation = (TURNS, TURNS, STAYS) if made.trailer else (TURNS,)
    black_box.given = tuple(name for name, _ in made.state)
    return black_box
