"""The aeroplane as a black box: worker processes, each flight from its own random stream."""

from parc_jax.common.sets.box import box
from parc_jax.learning.system import time_grid
from parc_jax.learning.systems.python_system import PythonSystem, python_system
from sims.foreign.extras import require
from sims.foreign.towers import params as c
from sims.foreign.towers.flight import POINTS, fly, fly_from


def system(workers: int | None = None) -> PythonSystem:
    """k = (bank [deg], pitch [deg], time banked [s]) -> p (201, 5, 2) of POINTS, q = (climb [m],).

    workers: processes, None = one per core. Raises InputError without JSBSim.
    """
    require("towers", "jsbsim", "flight")
    lo, hi = zip(c.BANK, c.PITCH, c.BANKED, strict=True)
    return python_system(
        fly,
        box(lo, hi),
        time_grid(c.PLAN_STEP, c.T_FINAL, c.RECORD),
        name="towers",
        n_p=2,
        n_q=1,
        workers=workers,
        law={
            "aeroplane": f"JSBSim {c.MODEL}",
            "wind": c.WIND,
            "turbulence": f"MIL-F-8785C, {c.SURFACE_WIND:g} ft/s at 20 ft, severity {c.SEVERITY}",
        },
        simulate_from=fly_from,
        points=POINTS,
        k_labels=("bank [deg]", "pitch [deg]", "time banked [s]"),
        q_labels=("climb [m]",),
    )
