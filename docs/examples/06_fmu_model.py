"""A model that another tool exported (Simulink, Modelica, ...) as an FMU of FMI 2 or 3 for
co-simulation: python 06_fmu_model.py GLIDER.fmu

The glider of the tests: parameters vx, vy [m/s], outputs x, y [m] and heading [rad], and a seed
that decides its gust. Worker processes import this file, so its start is guarded.
"""

import functools
import hashlib
import sys
from pathlib import Path

import fmpy
import jax
import numpy as np

import parc_jax as pj

TIME = pj.learning.time_grid(dt=0.25, t_f=1.0, dt_record=0.05)


@functools.cache
def unpacked(path):
    """The folder of its files, once per process, and what it says of itself."""
    return fmpy.extract(path), fmpy.read_model_description(path)


def glide(path, rng, k):
    """One co-simulation of k in a new instance: p (n_record + 1, 2) [m], q (1,) [rad]."""
    folder, described = unpacked(path)
    values = {"vx": k[0], "vy": k[1], "seed": int(rng.integers(2**31 - 1))}
    ran = fmpy.simulate_fmu(
        folder,
        model_description=described,
        fmi_type="CoSimulation",
        stop_time=TIME.t_f,
        output_interval=TIME.dt_record,
        start_values=values,
        output=["x", "y", "heading"],
    )
    if len(ran) != TIME.n_record + 1:
        raise RuntimeError(f"the FMU ended at {ran['time'][-1]:g} s")  # this run has failed
    return np.column_stack([ran["x"], ran["y"]]), ran["heading"][-1:]


if __name__ == "__main__":
    path = str(Path(*(sys.argv[1:] or sys.exit(__doc__))).absolute())
    domain = pj.box([0.5, -0.5], [0.9, 0.5])
    law = {"fmu": hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16]}
    run = functools.partial(glide, path)
    glider = pj.python_system(run, domain, TIME, name="glider", n_p=2, n_q=1, workers=2, law=law)
    model = pj.learn(glider, jax.random.PRNGKey(0), rollouts=400, hidden=(8,), eps=0.05, delta=0.05)
    glider.close()
    goal, wall = pj.box([0.6, -0.3, -1.0], [1.1, 0.3, 1.0]), pj.box([0.2, 0.25], [0.5, 0.5])
    scene = pj.reach_avoid(goal, [wall], 0.1)
    answer = pj.Planner(model).solve(scene, jax.random.PRNGKey(0), pj.Settings.fast())
    print(answer.details())
    print("a safe plan (p0, k):", answer.samples[0])
